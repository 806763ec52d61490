"""Results from several files: what belongs together, and what would be compared wrongly."""

from pathlib import Path

import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.evaluation.jobs import make_cases
from drake_starnav.evaluation.report.results import make_page_name, make_results, read_results
from drake_starnav.evaluation.trial_file import TrialFile, make_header
from tests.helpers.trials import record


def written(
    path: Path, method: str = "star", *more: str, seed: int = 5, trials: int = 2, scenario: str = "forest", **header
) -> Path:
    overrides = ["robot.radius=0.3", *more]
    header = {**make_header(make_cases([scenario], [method], overrides), seed, overrides), **header}
    with TrialFile(path, header) as file:
        for trial in reversed(range(trials)):
            file.append(record(scenario, method, trial))
    return path


@pytest.mark.parametrize("program", ["starnav", "python -m drake_starnav"])
def test_a_command_is_shown_as_typed(program: str, tmp_path: Path) -> None:
    typed = f"{program} benchmark forest --trials 2 --html 'my report.html'"
    results = read_results([written(tmp_path / "a.jsonl", command=typed)])
    assert results.list_commands() == [typed]
    assert results.make_trial_command(results.records[0]).startswith(f"{program} simulate forest --method star --seed ")


def test_a_trial_s_command_names_a_file_as_it_was_given(tmp_path: Path) -> None:
    scenario = tmp_path / "yard.yaml"
    scenario.write_text("world: !Forest {}\n")
    cases = make_cases([str(scenario)], ["star"])
    results = make_results([make_header(cases, 5)], [record("yard")])
    assert f"starnav simulate {scenario} --method" in results.make_trial_command(results.records[0])


@pytest.mark.parametrize(
    ("other", "words"),
    [({"seed": 6}, "has seed 6"), ({"method": "star"}, "forest star, and so has"), ({"trials": 0}, None)],
)
def test_what_does_not_belong_together_is_refused(tmp_path: Path, other: dict, words: str | None) -> None:
    first = written(tmp_path / "a.jsonl")
    second = written(tmp_path / "b.jsonl", **{"method": "star_paper", **other})
    if words is None:
        assert read_results([first, second]).methods == ["star", "star_paper"]
        with pytest.raises(StarnavError, match="no trial has ended yet"):
            read_results([second])
    else:
        with pytest.raises(StarnavError, match=words):
            read_results([first, second])


@pytest.mark.parametrize("override", ["world.width=40", "robot.radius=0.2", "simulation.goal_tolerance=0.5"])
def test_trials_of_other_tasks_are_not_compared(tmp_path: Path, override: str) -> None:
    first, second = written(tmp_path / "a.jsonl"), written(tmp_path / "b.jsonl", "star_paper", override)
    said = f"a.jsonl and .*b.jsonl have other {override.partition('.')[0]} in scenario forest; allowed"
    with pytest.raises(StarnavError, match=said):
        read_results([first, second])


def test_settings_are_compared_by_what_they_override(tmp_path: Path) -> None:
    """The same worlds and method with another lidar, and a faster robot."""
    plain = written(tmp_path / "plain.jsonl")
    noisy = written(tmp_path / "noisy.jsonl", "star", "lidar.noise=0.03")
    fast = written(tmp_path / "fast.jsonl", "star", "robot.max_speed=0.5")
    results = read_results([noisy, plain, fast], ["star"])
    assert results.methods == ["star lidar.noise=0.03", "star", "star robot.max_speed=0.5"]
    assert [len(case) for case in results.cases.values()] == [2, 2, 2]
    first = results.records[0]
    assert results.scenario(first).lidar.noise == 0.03 and results.scenario(first).method == "star"
    command = results.make_trial_command(first)
    assert "--method star --seed" in command and "lidar.noise=0.03" in command
    with pytest.raises(StarnavError, match="have other world in scenario forest"):
        read_results([plain, written(tmp_path / "wide.jsonl", "star", "world.width=40")])


def test_a_recording_is_called_after_its_trial_and_stays_in_its_folder() -> None:
    assert make_page_name(record("forest", "star", 3)) == "forest_star_3.html"
    assert make_page_name(record("../../tmp/my forest; echo hi", "star", 3)) == "_tmp_my_forest_echo_hi_star_3.html"
    assert len(make_page_name(record("x" * 300, "star", 3))) < 100
