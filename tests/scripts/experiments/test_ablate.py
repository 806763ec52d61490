"""The table of ablations: each row is what it says, and the script leaves a table, a plot and the trials."""

from pathlib import Path

import pytest

from drake_starnav.evaluation import make_cases, read_trials
from drake_starnav.scenario import METHODS
from scripts.experiments.ablate import ABLATIONS, REFERENCE, Ablation, main


def text(row: Ablation) -> str:
    (case,) = make_cases(["forest"], [row.method], row.overrides)
    return case.text


def test_rows_have_their_own_names_and_sources() -> None:
    assert ABLATIONS[0] is REFERENCE
    assert len({row.name for row in ABLATIONS}) == len({row.meaning for row in ABLATIONS}) == len(ABLATIONS)
    assert all("paper" in row.reference or "method" in row.reference for row in ABLATIONS)
    assert {row.method for row in ABLATIONS} <= set(METHODS)


def test_rows_differ_from_each_other() -> None:
    """An override that repeats a default would ablate nothing."""
    assert len({text(row) for row in ABLATIONS}) == len(ABLATIONS)


@pytest.mark.parametrize("row", [row for row in ABLATIONS if row.method == "star"], ids=lambda row: row.name)
def test_every_override_of_a_row_counts(row: Ablation) -> None:
    for k in range(len(row.overrides)):
        rest = row.overrides[:k] + row.overrides[k + 1 :]
        (case,) = make_cases(["forest"], [row.method], rest)
        # 16 segments are also the default, written out because the row's meaning depends on it
        assert case.text != text(row) or row.overrides[k] == "planner.segments=16"


def test_script_leaves_table_plot_and_trials(tmp_path: Path, capsys) -> None:
    pytest.importorskip("matplotlib")
    scenario = tmp_path / "tiny.yaml"
    scenario.write_text("world: !Obstacles {cylinders: [[1.0, 0.9, 0.3]], goal: [1.5, 0.0]}\n")
    arguments = [str(scenario), "--rows", "star_paper", "--trials", "2", "--jobs", "1", "--out", str(tmp_path / "out")]
    assert main(arguments) == 0
    files = {path.name for path in (tmp_path / "out").iterdir()}
    assert files == {"ablation.md", "ablation.png", "star.jsonl", "star_paper.jsonl"}
    table = (tmp_path / "out" / "ablation.md").read_text()
    assert table in capsys.readouterr().out + "\n"
    star, paper = table.splitlines()[2:]
    assert "100.0 % (34.2 to 100.0)" in star
    assert "1.00" in star  # its time over its own
    records = [read_trials(tmp_path / "out" / f"{name}.jsonl")[1] for name in ("star_paper", "star")]
    ratio = sum(r["time_s"] for r in records[0]) / sum(r["time_s"] for r in records[1])
    assert f"{ratio:.2f}" in paper
    assert main([*arguments, "--resume"]) == 0
    assert main(arguments) == 2
    assert "not empty" in capsys.readouterr().err
    assert main([*arguments, "--rows", "no_certificat"]) == 2
    assert "did you mean no_certificate" in capsys.readouterr().err


def test_script_tells_by_its_exit_code_that_trials_could_not_run(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    scenario = tmp_path / "broken.yaml"
    scenario.write_text("world: !Obstacles {cylinders: [[0.1, 0.0, 0.3]]}\n")
    arguments = [str(scenario), "--rows", "star", "--trials", "1", "--jobs", "1", "--out", str(tmp_path / "out")]
    assert main([*arguments, "--quiet"]) == 1
    assert (tmp_path / "out" / "ablation.md").is_file()
