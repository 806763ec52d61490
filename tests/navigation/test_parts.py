"""Parts of the user's own, and methods that are made of them."""

import json
from pathlib import Path

import pytest
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from drake_starnav import Parts, add_navigation, make_simulator, parse_scenario, run_trial
from drake_starnav.cli.benchmark import benchmark
from drake_starnav.errors import StarnavError
from drake_starnav.navigation.robot import robot_mounts
from drake_starnav.scenario.shipped import METHODS
from tests.helpers.methods import Ahead, ahead

TEXT = "world: !Obstacles {bounds: [-1, -2, 5, 2], cylinders: [[2.6, 0, 0.3]], goal: [%s, 0.0]}\n"
NEAR, BEHIND = TEXT % 1.5, TEXT % 3.6
OWN = "tests.helpers.methods"


class Certifying:
    """A certificate that says something."""

    def __init__(self, said: object) -> None:
        """What it says."""
        self.said = said

    def accepts(self, motion: object) -> object:
        """Whatever it was told to say."""
        return self.said


class Elsewhere(LeafSystem):
    """A controller whose output has another name."""

    def __init__(self) -> None:
        """It has the port `twist`."""
        super().__init__()
        self.DeclareVectorOutputPort("twist", 2, lambda context, output: output.SetFromVector([0.0, 0.0]))


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        (Parts(controller=Elsewhere()), "controller has the output ports twist; allowed: one named desired_twist"),
        (Parts(goal=Elsewhere()), "goal has the output ports twist; allowed: one named goal"),
        (Parts(shield=Elsewhere()), "shield has the output ports twist; allowed: one named twist_command"),
        (Parts(certificates=(object(),)), r"certificates\[0\] is a object without a method accepts; allowed"),
        (
            Parts(certificates=(Certifying(True), Certifying("yes"))),
            r"certificates\[1\] is a Certifying whose accepts\(motion\) is 'yes'; allowed: True or False",
        ),
        (Parts(certificates=(Certifying(None),)), r"whose accepts\(motion\) is None; allowed: True or False"),
        (Parts(controller=LeafSystem), "controller is <class 'pydrake.*LeafSystem'>; allowed: a System of Drake"),
        (Parts(goal="there"), "goal is 'there'; allowed: a System of Drake"),
        (Parts(shield=True), "shield is True; allowed: a System of Drake"),
    ],
)
def test_parts_that_lack_something_are_refused_when_they_are_wired(parts: Parts, words: str) -> None:
    with pytest.raises(StarnavError, match=words):
        add_navigation(DiagramBuilder(), parse_scenario(NEAR, name="near"), parts)


@pytest.mark.parametrize(
    ("method", "parts", "words"),
    [
        ("star_paper", Parts(certificates=(Certifying(True),)), "certificates of your own with parts that are not"),
        (
            "foa",
            Parts(controller=Elsewhere()),
            "method foa has a controller, and you have one of your own; allowed",
        ),
    ],
)
def test_parts_that_a_method_does_not_leave_open_are_refused(method: str, parts: Parts, words: str) -> None:
    with pytest.raises(StarnavError, match=words):
        add_navigation(DiagramBuilder(), parse_scenario(NEAR, name="near", method=method), parts)


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ({"station": Elsewhere()}, "station is .*Elsewhere.*; allowed: a Robot, which has scenario and mounts"),
        ({"certificates": Certifying(True)}, "certificates is .*Certifying.*; allowed: a list of certificates"),
        ({"world": "room"}, "world is 'room'; allowed: a World"),
    ],
)
def test_parts_of_another_kind_are_refused_at_once(parts: dict, words: str) -> None:
    with pytest.raises(StarnavError, match=words):
        Parts(**parts)


def test_certificates_may_be_a_list_and_a_station_needs_its_ports() -> None:
    assert Parts(certificates=[Certifying(True)]).certificates  # type: ignore[arg-type]
    scenario, station = parse_scenario(NEAR, name="near"), Elsewhere()
    station.scenario, station.mounts = scenario, robot_mounts(scenario)
    with pytest.raises(StarnavError, match="station"):
        add_navigation(DiagramBuilder(), scenario, Parts(station=station))


def test_a_method_of_one_s_own_drives_by_its_name_alone() -> None:
    trial = run_trial(parse_scenario(NEAR, name="near", method=f"{OWN}:ahead"))
    assert (trial.outcome, trial.method) == ("reached", f"{OWN}:ahead")
    assert trial.state_hash == run_trial(parse_scenario(NEAR, name="near"), Parts(controller=Ahead())).state_hash
    assert run_trial(parse_scenario(BEHIND, name="behind", method=f"{OWN}:blind")).outcome == "collision"


def test_a_method_can_be_entered_by_a_name(monkeypatch) -> None:
    monkeypatch.setitem(METHODS, "onwards", ahead)
    trial = run_trial(parse_scenario(NEAR, name="near", method="onwards"))
    assert (trial.outcome, trial.method) == ("reached", "onwards")


@pytest.mark.parametrize(
    ("method", "words"),
    [
        ("nowhere.at_all:make", "No module named 'nowhere'; allowed: module:function"),
        (f"{OWN}:ahaed", "has no attribute 'ahaed'; allowed: module:function"),
        (f"{OWN}:NOT_A_FUNCTION", "is 3; allowed: a function, or a class"),
        (f"{OWN}:nothing", f"what method {OWN}:nothing returns is None; allowed: "),
    ],
)
def test_a_method_that_is_none_is_refused_in_one_sentence(method: str, words: str) -> None:
    with pytest.raises(StarnavError, match=words):
        add_navigation(DiagramBuilder(), parse_scenario(NEAR, name="near", method=method))


@pytest.mark.slow
def test_a_method_of_one_s_own_is_benchmarked_beside_others(tmp_path: Path, capsys) -> None:
    scenario, path, page = tmp_path / "near.yaml", tmp_path / "a.jsonl", tmp_path / "a.html"
    scenario.write_text(NEAR)
    own = f"{OWN}:ahead"
    few = ["--trials", "2", "--jobs", "2", "--json", str(path), "--html", str(page)]
    assert benchmark([str(scenario), "--method", "star", own, *few]) == 0
    records = [json.loads(line) for line in path.read_text().splitlines()[1:]]
    assert {(record["method"], record["outcome"]) for record in records} == {("star", "reached"), (own, "reached")}
    assert own in capsys.readouterr().out and own in page.read_text(encoding="utf-8")
    suite = ["--suite", "table1", str(scenario), "--method", own, "--trials", "1", "--jobs", "1"]
    assert benchmark(suite) == 0
    assert f"| near     | {own} |" in capsys.readouterr().out


def test_what_is_sent_now_is_read_by_its_name() -> None:
    builder = DiagramBuilder()
    navigation = add_navigation(builder, parse_scenario(NEAR, name="near"))
    simulator = make_simulator(builder.Build())
    simulator.AdvanceTo(1.0)
    context = simulator.get_context()
    x, y, _, v, _ = navigation.read("state", context)
    assert (x, v) > (0.05, 0.05) and abs(y) < 0.2
    assert navigation.read("goal", context).tolist() == [1.5, 0.0]
    assert navigation.read("twist_command", context)[0] > 0.05
    assert navigation.read("certificate", context).certified
    assert len(navigation.read("scan", context).ranges) == len(navigation.read("ranges", context))
    assert navigation.read("guidance", context).arrives
    with pytest.raises(StarnavError, match="unknown signal 'sate': did you mean state"):
        navigation.read("sate", context)
