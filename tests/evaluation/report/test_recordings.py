"""Which trials are chosen, and that their recordings are of the same runs."""

import re
from pathlib import Path

import pytest

from drake_starnav.cli.benchmark import benchmark
from drake_starnav.evaluation.report.recordings import choose_trials, record_chosen
from drake_starnav.evaluation.report.results import make_results, read_results
from tests.helpers.trials import made_up, record

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def trials(tmp_path_factory) -> Path:
    """Two trials that arrive and two that do not, with the report that was asked for at once."""
    folder = tmp_path_factory.mktemp("trials")
    (folder / "near.yaml").write_text("world: !Obstacles {goal: [1.0, 0.0]}\n")
    (folder / "far.yaml").write_text("world: !Obstacles {goal: [5.0, 0.0]}\nsimulation: {timeout: 0.5}\n")
    scenarios = [str(folder / "near.yaml"), str(folder / "far.yaml")]
    path = folder / "trials.jsonl"
    options = ["--html", str(folder / "report.html"), "--recordings", "1"]
    assert benchmark([*scenarios, "--trials", "2", "--jobs", "1", "--json", str(path), "--quiet", *options]) == 0
    return path


def commands(page: str, trials: Path) -> list[str]:
    """Commands on a page that run a failure again, by the program that ran the tests."""
    return re.findall(rf"simulate(?:\.py)? {re.escape(str(trials.with_name('far.yaml')))}", page)


def test_failures_the_median_and_the_worst_success_are_chosen() -> None:
    header = made_up().headers[0]
    times = (20.0, 50.0, 30.0, 40.0, 10.0)
    records = [record(trial=k, time_s=time) for k, time in enumerate(times)]
    records += [record(trial=5, outcome="timeout"), record(trial=6, outcome="collision")]
    records += [record(trial=7, outcome="error"), record(trial=8, outcome="unsupported")]
    chosen = choose_trials(make_results([header], records))
    expected = [(5, "timeout"), (6, "collision"), (2, "median success"), (1, "worst success")]
    assert [(c.record["trial"], c.reason) for c in chosen] == expected


def test_recordings_are_of_the_same_runs_and_failures_are_limited(trials: Path) -> None:
    page = trials.with_name("report.html").read_text(encoding="utf-8")
    folder = trials.with_name("report_recordings")
    recorded = sorted(path.name for path in folder.iterdir())
    assert [name.rpartition("_")[0] for name in recorded] == ["far_star", "near_star", "near_star"]
    for name in recorded:
        assert f'href="report_recordings/{name}"' in page
        assert (folder / name).stat().st_size > 100_000
    assert len(commands(page, trials)) == 1  # the second failure
    assert "not the same run" not in page


def test_another_run_than_the_recorded_one_is_reported(trials: Path, tmp_path: Path) -> None:
    results = read_results([trials])
    first = {**results.records[0], "state_hash": "of another version"}
    changed = make_results(results.headers, [first])
    steps = []
    (recording,) = record_chosen(
        changed, choose_trials(changed), tmp_path / "seen", failures=0, jobs=1,
        progress=lambda done, total: steps.append((done, total)),
    )  # fmt: skip
    assert steps == [(1, 1)]
    assert recording.file
    assert recording.remark.startswith("not the same run: reached after")
