"""Trials on a Dask cluster of two workers: one is killed, the scheduler is lost, or there is none."""

import os
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from drake_starnav.cli.benchmark import benchmark
from drake_starnav.errors import StarnavError
from drake_starnav.evaluation import cluster
from drake_starnav.evaluation.cluster import dask_pool
from drake_starnav.evaluation.trial_file import read_trials

pytestmark = pytest.mark.slow

dask = pytest.importorskip("dask", reason="Dask is not installed")
distributed = pytest.importorskip("distributed", reason="Dask is not installed")

TIMES = ("wall_s", "command", "scan", "plan")
TRIALS = 12


@pytest.fixture(scope="module")
def two_workers() -> Iterator[Any]:
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as running:
        yield running


@pytest.fixture(scope="module")
def tiny(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("scenario") / "tiny.yaml"
    path.write_text("world: !Obstacles {cylinders: [[1.0, 0.9, 0.3]], goal: [1.5, 0.0]}\nsimulation: {timeout: 6.0}\n")
    return path


def arguments(scenario: Path, path: Path, address: str, *more: str) -> list[str]:
    return [str(scenario), "--trials", str(TRIALS), "--json", str(path), "--dask", address, "--quiet", *more]


def results(path: Path) -> dict[int, dict]:
    """The records of a file without wall-clock times, by number; each once."""
    records = read_trials(path)[1]
    found = {record["trial"]: {k: v for k, v in record.items() if k not in TIMES} for record in records}
    assert len(found) == len(records)
    return found


@pytest.mark.parametrize("address", ["localhost:1", "spoon://localhost:8786"])
def test_no_dask_at_the_address_is_reported_and_nothing_is_lost(address, tiny: Path, tmp_path: Path, capsys) -> None:
    path = tmp_path / "trials.jsonl"
    path.write_text("what was there\n")
    assert benchmark(arguments(tiny, path, address, "--resume")) == 2
    printed = capsys.readouterr().err
    assert f"--dask {address}: no Dask scheduler there" in printed
    assert printed.count("\n") == 1
    assert path.read_text() == "what was there\n"


def test_workers_of_other_versions_are_refused(two_workers, monkeypatch) -> None:
    monkeypatch.setattr(cluster, "versions", lambda: {"source": str(os.getpid())})
    with (
        pytest.raises(StarnavError, match=f"source [0-9]+, here {os.getpid()}"),
        dask_pool(two_workers.scheduler_address),
    ):
        pass


def test_a_lost_scheduler_ends_the_run_and_keeps_what_ended(tiny: Path, tmp_path: Path, capsys) -> None:
    path = tmp_path / "trials.jsonl"
    with (
        dask.config.set({"distributed.comm.timeouts.connect": "1s"}),  # after which the client stops to reconnect
        distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=":0") as doomed,
    ):

        def watch() -> None:
            while not path.exists() or path.read_bytes().count(b"\n") < 3:
                time.sleep(0.005)
            doomed.sync(doomed.scheduler.close)

        watcher = threading.Thread(target=watch)
        watcher.start()
        assert benchmark(arguments(tiny, path, doomed.scheduler_address)) == 2
        watcher.join()
    assert "--resume" in capsys.readouterr().err
    assert 2 <= len(results(path)) < TRIALS
