"""The curve of caution: each row is what it says, and the script leaves a table, a picture and the trials."""

import runpy
from pathlib import Path

import pytest

from drake_starnav.evaluation.trial_file import read_trials

pytestmark = pytest.mark.slow

SCRIPT = runpy.run_path(str(Path(__file__).parents[3] / "scripts" / "experiments" / "caution_curve.py"))


def test_script_leaves_table_picture_and_trials(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scenario = tmp_path / "tiny.yaml"
    scenario.write_text(
        "world: !Obstacles {cylinders: [[1.0, 0.9, 0.3]], goal: [1.5, 0.0]}\nobstacles: {max_speed: 0.5}\n"
    )
    out = tmp_path / "out"
    arguments = [str(scenario), "--cautions", "1", "0.5", "--trials", "1", "--jobs", "1", "--out", str(out)]
    assert SCRIPT["main"]([*arguments, "--set", "obstacles.cautions=1"]) == 2
    assert "did you mean caution" in capsys.readouterr().err
    assert SCRIPT["main"]([*arguments, "--cautions", "2"]) == 2
    assert "obstacles.caution is 2" in capsys.readouterr().err
    assert not out.exists()
    (out / "caution.svg").mkdir(parents=True)
    assert SCRIPT["main"](arguments) == 2
    assert "caution.svg: it is a folder" in capsys.readouterr().err
    assert [path.name for path in out.iterdir()] == ["caution.svg"]  # told before any trial
    (out / "caution.svg").rmdir()
    assert SCRIPT["main"](arguments) == 0
    names = ["obstacles.max_speed=0", "obstacles.caution=1", "obstacles.caution=0.5"]
    assert {path.name for path in out.iterdir()} == {"caution.md", "caution.svg", *(f"{name}.jsonl" for name in names)}
    rows = (out / "caution.md").read_text().splitlines()[2:]
    assert [row.split("|")[2].strip() for row in rows] == names
    assert all("100.0 %" in row for row in rows)
    for name in names:
        assert [record["outcome"] for record in read_trials(out / f"{name}.jsonl")[1]] == ["reached"]
    assert "<svg" in (out / "caution.svg").read_text()
