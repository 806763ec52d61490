"""The project's results agree with what README and the docs say of them."""

import json
from pathlib import Path

import pytest

from drake_starnav.evaluation.trial_file import TrialFile
from scripts.maintenance import record_results
from tests.helpers.trials import made_up


@pytest.mark.parametrize("path", record_results.texts(), ids=lambda path: path.name)
def test_what_is_said_of_the_results_is_up_to_date(path: Path) -> None:
    assert not record_results.stale(path, record_results.texts()[path]), (
        "run python scripts/maintenance/record_results.py"
    )


@pytest.fixture
def place(tmp_path: Path, monkeypatch) -> Path:
    """A checkout with nothing but the pages."""
    monkeypatch.setattr(record_results, "ROOT", tmp_path)
    monkeypatch.setattr(record_results, "FOLDER", tmp_path / "benchmarks" / "results")
    (tmp_path / "docs").mkdir()
    for page, names in (("README.md", ["results"]), ("docs/benchmark.md", ["costs", "results"])):
        sections = "\n".join(
            f"<!-- {name}: written by `python scripts/maintenance/record_results.py` -->old<!-- end of {name} -->"
            for name in names
        )
        (tmp_path / page).write_text(f"before\n{sections}\nafter\n")
    return tmp_path


def file_of_trials(path: Path, **changes) -> Path:
    results = made_up(trials=4, **changes)
    with TrialFile(path, results.headers[0]) as file:
        for record in results.records:
            file.append(record)
    return path


def test_one_command_keeps_a_run_and_writes_what_is_said_of_it(place: Path, capsys) -> None:
    trials = file_of_trials(place / "run.jsonl")
    trials.write_bytes(trials.read_bytes() + b'{"cut off')
    assert record_results.main([str(trials)]) == 0
    assert sorted(path.name for path in record_results.FOLDER.iterdir()) == [
        "environment.json", "run.jsonl", "summary.md",
    ]  # fmt: skip
    readme = (place / "README.md").read_text()
    assert readme.startswith("before\n") and readme.endswith("<!-- end of results -->\nafter\n")
    assert "| 4 of 4" in readme
    page = (place / "docs" / "benchmark.md").read_text()
    assert "| star_paper |" in page and "trials cost:" in page
    assert page.startswith("before\n") and page.endswith("<!-- end of results -->\nafter\n")
    (environment,) = json.loads((record_results.FOLDER / "environment.json").read_text())
    assert environment["command"] in page
    assert record_results.main(["--check"]) == 0

    record_results.main([str(file_of_trials(place / "next.jsonl", nodes=3))])
    assert [path.name for path in record_results.stored()] == ["next.jsonl"]
