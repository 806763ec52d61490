"""The table of ablations: each row is what it says, and the script leaves a table and the trials."""

import importlib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import pytest

from drake_starnav.evaluation.trial_file import read_trials
from scripts.experiments.ablate import ABLATIONS, main
from scripts.experiments.replacements import run_replaced
from tests.helpers.trials import run_trials_here


@pytest.mark.parametrize("replaced", ABLATIONS.values(), ids=ABLATIONS)
def test_a_row_replaces_names_that_there_are(replaced: Mapping[str, Any]) -> None:
    assert run_replaced(replaced, current, replaced) == list(replaced.values())
    assert all(now is not value for now, value in zip(current(replaced), replaced.values(), strict=True))


def current(names: Iterable[str]) -> list[object]:
    """What is found now under dotted names."""
    found = []
    for name in names:
        module, _, attribute = name.rpartition(".")
        found.append(getattr(importlib.import_module(module), attribute))
    return found


def test_script_leaves_table_and_trials(tmp_path: Path, monkeypatch, capsys) -> None:
    run_trials_here(monkeypatch)
    scenario = tmp_path / "tiny.yaml"
    scenario.write_text("world: !Obstacles {cylinders: [[1.0, 0.9, 0.3]], goal: [1.5, 0.0]}\n")
    arguments = [str(scenario), "--rows", "star_paper", "--trials", "2", "--jobs", "1", "--out", str(tmp_path / "out")]
    assert main(arguments) == 0
    files = {path.name for path in (tmp_path / "out").iterdir()}
    assert files == {"ablation.md", "star.jsonl", "star_paper.jsonl"}
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
