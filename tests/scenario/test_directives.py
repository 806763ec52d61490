"""Model directives in scenarios, and the files that these name."""

import re
import textwrap
from pathlib import Path

import pytest

from drake_starnav import RobotParameters, StarnavError
from drake_starnav.scenario.scenario_file import format_scenario, load_scenario, parse_scenario

DIRECTIVES = """
directives:
- add_model: {name: barrel, file: "package://drake_starnav/worlds/barrel.urdf"}
- add_weld: {parent: world, child: "barrel::barrel", X_PC: {translation: [3, 2, 0], rotation: !Rpy {deg: [0, 0, 30]}}}
"""


@pytest.mark.parametrize("kind", ["Barn", "DynaBarn"])
def test_files_of_worlds_are_found_beside_the_scenario(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text(f"world: !{kind} {{file: worlds.json, id: 1}}\n")
    assert load_scenario(str(file)).world.file == str(tmp_path / "worlds.json")
    monkeypatch.chdir(tmp_path)
    given = load_scenario(kind.lower(), overrides=["world.file=other.json"])
    assert given.world.file == str(tmp_path / "other.json")
    assert load_scenario(kind.lower()).world.file == f"{kind.lower()}_like"


def test_directives_at_the_top_are_those_of_the_model(tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text("world: !Model {goal: [4, 0]}" + DIRECTIVES)
    scenario = load_scenario(file, overrides=["world.start=[0, 1, 0]"])
    inside = "world: !Model" + DIRECTIVES.replace("\n", "\n  ") + "\n  start: [0, 1, 0]\n  goal: [4, 0]"
    assert scenario == parse_scenario(inside, name="mine")
    assert parse_scenario(format_scenario(scenario), name="mine") == scenario


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (DIRECTIVES, r" beside no world; allowed: beside world: !Model \{start: \[x, y, yaw\], goal: \[x, y\]\}"),
        ("world: !Forest {}" + DIRECTIVES, " beside world: !Forest; allowed: beside world: !Model"),
        ("world: {goal: [4, 0]}" + DIRECTIVES, r" beside world: \{'goal': \[4, 0\]\}; allowed: beside world: !Model"),
        ("world: !Model {goal: [4, 0], directives: a.sdf}" + DIRECTIVES, " beside world.directives; allowed: "),
        ("world: !Model {goal: [4, 0]}\ndirectives: a.sdf", " is 'a.sdf'; allowed: a list of Drake's model directives"),
    ],
)
def test_directives_at_the_top_that_no_model_takes_are_refused(text: str, message: str) -> None:
    with pytest.raises(StarnavError, match="directives in scenario" + message):
        parse_scenario(text, name="x")


@pytest.mark.parametrize("form", ["at the top", "a list of the world", "a text of the world"])
def test_files_of_embedded_directives_are_found_beside_the_scenario(
    form: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    entries = "- add_model: {name: a, file: parts/crate.sdf}\n- add_directives: {file: more.dmd.yaml}\n"
    entries += "- add_model: {name: b, file: 'package://mine/b.sdf'}\n"
    text = {
        "at the top": f"world: !Model {{goal: [4, 0]}}\ndirectives:\n{entries}",
        "a list of the world": f"world: !Model\n  goal: [4, 0]\n  directives:\n{textwrap.indent(entries, '  ')}",
        "a text of the world": "world: !Model\n  goal: [4, 0]\n  directives: |\n    directives:\n"
        + textwrap.indent(entries, "    "),
    }[form]
    (tmp_path / "mine.yaml").write_text(text)
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    scenario = load_scenario(tmp_path / "mine.yaml")
    files = re.findall(r"file: (.*)$|file: (.*)[,}]", scenario.world.directives, re.MULTILINE)
    assert [a or b for a, b in files] == [
        f"file://{tmp_path}/parts/crate.sdf",
        f"file://{tmp_path}/more.dmd.yaml",
        "package://mine/b.sdf",
    ]
    assert parse_scenario(format_scenario(scenario), name="mine") == scenario  # a worker may run elsewhere


LIMITS = "robot: {radius: 0.4, max_speed: 0.6}\nlidar: {beams: 180}\nnavigation_node: {gain: 3}\n"


def of(folder: Path, said: str = "", limits: str = LIMITS, name: str = "cart.urdf"):
    """The scenario that says something of a robot beside whose model lies a file of limits."""
    (folder / name).write_text("<robot/>", encoding="utf-8")
    (folder / "cart.yaml").write_text(limits, encoding="utf-8")
    return parse_scenario(f"world: !Forest {{}}\nrobot: {{model: {name}{said}}}\n", name="test", folder=folder)


@pytest.mark.parametrize("name", ["cart.urdf", "cart.urdf.xacro", "cart.xacro"])
def test_what_the_scenario_does_not_say_is_taken_from_beside_the_model(tmp_path: Path, name: str) -> None:
    scenario = of(tmp_path, ", max_speed: 0.7", name=name)
    assert (scenario.robot.radius, scenario.robot.max_speed, scenario.lidar.beams) == (0.4, 0.7, 180)
    assert scenario.robot.max_yaw_rate == RobotParameters.max_yaw_rate
    assert parse_scenario(format_scenario(scenario), name="test") == scenario


def test_a_model_may_have_several_lidars(tmp_path: Path) -> None:
    limits = "lidar: {beams: 90}\nlidars: [{frame: front}, {frame: rear, beams: 180}]\n"
    scenario = of(tmp_path, limits=limits)
    assert [(each.frame, each.beams) for each in scenario.lidars] == [("front", 90), ("rear", 180)]


@pytest.mark.parametrize(
    ("said", "limits", "radius"),
    [
        (", footprint: [[0.3, 0.4], [-0.3, 0.4], [-0.3, -0.4], [0.3, -0.4]]", LIMITS, 0.5),
        (", radius: 0.7", "robot: {footprint: [[3, 4], [-3, 4], [-3, -4], [3, -4]]}", 0.7),
        ("", "robot: {footprint: [[0.3, 0.4], [-0.3, 0.4], [-0.3, -0.4], [0.3, -0.4]], model: other.urdf}", 0.5),
        (", footprint: []", LIMITS, 0.4),
        (", footprint: []", "robot: {footprint: [[3, 4], [-3, 4], [-3, -4], [3, -4]]}", 5.0),
    ],
)
def test_radius_or_footprint_replaces_what_the_model_s_file_says(
    tmp_path: Path, said: str, limits: str, radius: float
) -> None:
    robot = of(tmp_path, said, limits).robot
    assert robot.radius == pytest.approx(radius) and Path(robot.model).name == "cart.urdf"


SQUARE = "[[0.3, 0.4], [-0.3, 0.4], [-0.3, -0.4], [0.3, -0.4]]"


@pytest.mark.parametrize("radius", ["0.25", "0.3", "wide"])
@pytest.mark.parametrize(
    ("written", "set_"),
    [
        ("robot: {{footprint: {0}, radius: {1}}}", []),
        ("robot: {{footprint: {0}}}", ["robot.radius={1}"]),
        ("robot: {{radius: {1}}}", ["robot.footprint={0}"]),
        ("robot: {{base: omnidirectional}}", ["robot.footprint={0}", "robot.radius={1}"]),
        ("robot: {{model: carrier}}", ["robot.radius={1}", "robot.footprint={0}"]),
        ("robots: [{{footprint: {0}, radius: {1}, start: [1, 1, 0], goal: [2, 2]}}, {{start: [3, 3, 0]}}]", []),
    ],
)
def test_of_radius_and_footprint_neither_is_left_out(written: str, set_: list[str], radius: str) -> None:
    written, *overrides = (text.format(SQUARE, radius) for text in (written, *set_))
    said = rf"robot\.radius is '?{radius}'? beside robot\.footprint; allowed: one of them"
    with pytest.raises(StarnavError, match=said):
        parse_scenario(f"world: !Room {{}}\n{written}\n", name="both", overrides=overrides)


def test_of_radius_and_footprint_one_may_be_taken_back() -> None:
    def robot(written: str, *overrides: str):
        return parse_scenario(f"world: !Room {{}}\nrobot: {written}\n", name="one", overrides=overrides).robot

    square = robot(f"{{footprint: {SQUARE}}}")
    assert square.radius == pytest.approx(0.5) and not square.shape.is_disc
    assert robot("{radius: 0.3}", "robot.radius=0", f"robot.footprint={SQUARE}") == square
    assert robot(f"{{footprint: {SQUARE}, radius: {square.radius!r}}}") == square
    small = robot("{radius: 0.3}").shape
    assert robot(f"{{footprint: {SQUARE}}}", "robot.footprint=[]", "robot.radius=0.3").shape == small
    listed = f"robots: [{{start: [1, 1, 0], goal: [2, 2], footprint: {SQUARE}}}, {{start: [3, 3, 0], goal: [1, 1]}}]"
    robots = parse_scenario(f"world: !Room {{}}\nrobot: {{radius: 0.3}}\n{listed}\n", name="two").robots
    assert [each.robot.radius for each in robots] == [square.radius, 0.3]


@pytest.mark.parametrize(
    ("limits", "said"),
    [("robot: {radus: 0.4}", "cart.yaml: robot.radus: did you mean radius"), ("robot: 3", "cart.yaml: robot is 3")],
)
def test_what_is_wrong_in_a_model_s_limits_is_said(tmp_path: Path, limits: str, said: str) -> None:
    with pytest.raises(StarnavError, match=said):
        of(tmp_path, limits=limits)
