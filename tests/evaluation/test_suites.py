"""Suites: what they run, and their tables beside the published figures."""

import pytest

from drake_starnav.cli.benchmark import benchmark
from drake_starnav.evaluation.jobs import make_cases
from drake_starnav.evaluation.suites import SUITES, Published, Suite, make_suite_table
from tests.evaluation.test_summary import record
from tests.helpers.trials import run_trials_here


def by_case(rows) -> dict[tuple[str, str], list[str]]:
    return {(row[0], row[1]): list(row[2:]) for row in rows}


def printed_cells(text: str) -> dict[tuple[str, str], list[str]]:
    """The rows of the first Markdown table of a text."""
    lines = [line for line in text.split("\n\n")[1].splitlines()[2:]]
    return by_case([cell.strip() for cell in line.strip("|").split("|")] for line in lines)


@pytest.mark.parametrize("name", SUITES)
def test_a_suite_names_what_exists(name: str) -> None:
    suite = SUITES[name]
    cases = [(case.scenario, case.method) for case in make_cases(suite.scenarios, suite.methods)]
    assert set(suite.references) <= set(suite.methods)
    assert set(suite.published) <= set(cases)


def test_our_figures_stand_beside_the_published_ones() -> None:
    suite = Suite(
        "two", ("forest",), ("star", "foa", "dsm"), published={("forest", "foa"): Published(99.6, 109.9, 20.7)}
    )
    records = [
        record(0, time_s=10.0, path_length_m=5.0),
        record(1, time_s=20.0, path_length_m=10.0),
        record(0, method="foa", time_s=15.0, path_length_m=6.0),
        record(1, "collision", method="foa"),
        {"scenario": "forest", "method": "dsm", "trial": 0, "seed": 0, "outcome": "unsupported"},
    ]
    rows = by_case(make_suite_table(suite, records)[1])
    assert rows["forest", "star"][4:6] == ["100.0 (2)", "-"]
    assert rows["forest", "foa"] == [
        "2", "50.0 % (9.5 to 90.5)", "20.7", "1 collision", "150.0 (1)", "99.6", "120.0 (1)", "109.9", "0.020 / 0.050",
        "-",
    ]  # fmt: skip
    assert rows["forest", "dsm"] == ["0", "-", "-", "1 unsupported", "-", "-", "-", "-", "- / -", "-"]
    head, both = make_suite_table(suite, records, ("star", "foa"))
    assert head[6:8] == ("TTR % to star", "TTR % to foa")
    assert [row[6:8] for row in both[:2]] == [("100.0 (2)", "66.7 (1)"), ("150.0 (1)", "100.0 (1)")]


def test_a_suite_runs_and_prints_its_table(tmp_path, capsys, monkeypatch) -> None:
    run_trials_here(monkeypatch)
    (tmp_path / "post.yaml").write_text("world: !Obstacles {cylinders: [[1.0, 0.9, 0.3]], goal: [1.5, 0.0]}\n")
    (tmp_path / "box.yaml").write_text(
        "world: !Obstacles {polygons: [[[0.8, 1], [1.2, 1], [1, 1.4]]], goal: [1.5, 0.0]}\n"
    )
    scenarios = (str(tmp_path / "post.yaml"), str(tmp_path / "box.yaml"))
    monkeypatch.setitem(SUITES, "tiny", Suite("tiny", scenarios, ("star", "dsm")))
    arguments = ["--suite", "tiny", "--trials", "1", "--jobs", "1", "--json", str(tmp_path / "trials.jsonl")]
    assert benchmark(arguments) == 0
    rows = printed_cells(capsys.readouterr().out)
    assert rows["post", "star"][4] == "100.0 (1)"
    assert rows["post", "dsm"][4].endswith(" (1)")
    assert rows["box", "dsm"][3] == "1 unsupported"  # it cannot know a triangle as circles
    assert benchmark([*arguments, "--resume"]) == 0
    assert printed_cells(capsys.readouterr().out) == rows


def test_scenarios_or_a_suite_are_needed(capsys) -> None:
    assert benchmark([]) == 2
    printed = capsys.readouterr().err
    assert "--suite; allowed: one of the two" in printed
    assert "Traceback" not in printed
