"""Trials on a Dask cluster of two workers: one is killed, the scheduler is lost, or there is none."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from drake_starnav.cli.benchmark import benchmark
from drake_starnav.errors import StarnavError
from drake_starnav.evaluation import cluster
from drake_starnav.evaluation.cluster import connect_dask_pool

pytestmark = pytest.mark.slow

dask = pytest.importorskip("dask", reason="Dask is not installed")
distributed = pytest.importorskip("distributed", reason="Dask is not installed")

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
    monkeypatch.setattr(cluster, "find_versions", lambda: {"source": str(os.getpid())})
    with (
        pytest.raises(StarnavError, match=f"source [0-9]+, here {os.getpid()}"),
        connect_dask_pool(two_workers.scheduler_address),
    ):
        pass
