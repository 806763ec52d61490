"""Options of the commands `benchmark` and `report`, and what these write."""

from pathlib import Path

import pytest

from drake_starnav.cli.benchmark import parse_world_numbers, report
from drake_starnav.errors import StarnavError
from drake_starnav.evaluation.trial_file import TrialFile
from tests.helpers.trials import made_up


def test_world_numbers_are_ascending_and_unique() -> None:
    assert parse_world_numbers("7, 3,20-22,21") == [3, 7, 20, 21, 22]


@pytest.mark.parametrize("text", ["", "a", "3-1", "1-", "-1", "0-100000"])
def test_other_texts_are_refused(text: str) -> None:
    with pytest.raises(StarnavError, match="--worlds .* allowed: "):
        parse_world_numbers(text)


def test_a_report_has_tables_figures_and_a_page(tmp_path: Path, capsys) -> None:
    results, path = made_up(trials=2), tmp_path / "a.jsonl"
    with TrialFile(path, results.headers[0]) as file:
        for record in results.records:
            file.append(record)
    kinds = ("html", "markdown", "csv")
    options = [part for kind in kinds for part in (f"--{kind}", str(tmp_path / f"r.{kind}"))]
    assert report([str(path), *options, "--panels", "1"]) == 0
    assert (tmp_path / "r.markdown").read_text().rstrip() in capsys.readouterr().out
    assert (tmp_path / "r.csv").read_text().count("\n") == 1 + 4  # scenarios with methods
    assert "reached the goal" in (tmp_path / "r.html").read_text(encoding="utf-8")
    assert report([str(tmp_path / "none.jsonl")]) == 2
    assert "cannot be read" in capsys.readouterr().err
