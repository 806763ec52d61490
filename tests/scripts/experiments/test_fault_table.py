"""The table of faults: each row is what it says, and the script leaves a table and the trials."""

import runpy
from pathlib import Path

import pytest

from drake_starnav.evaluation.trial_file import read_trials

pytestmark = pytest.mark.slow

SCRIPT = runpy.run_path(str(Path(__file__).parents[3] / "scripts" / "experiments" / "fault_table.py"))


def test_script_leaves_table_and_trials(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scenario = tmp_path / "tiny.yaml"
    scenario.write_text("world: !Obstacles {cylinders: [[1.0, 0.9, 0.3]], goal: [1.5, 0.0]}\n")
    rows = ["all_moderate", "lidar.delay_0.1"]
    arguments = [str(scenario), "--rows", *rows, "--trials", "2", "--jobs", "1", "--out", str(tmp_path / "out")]
    with pytest.raises(SystemExit):
        SCRIPT["main"](["--trials", "many"])
    assert SCRIPT["main"]([*arguments[:2], "nothing", *arguments[4:]]) == 2
    assert "row 'nothing'" in capsys.readouterr().err
    assert SCRIPT["main"](arguments) == 0
    files = {path.name for path in (tmp_path / "out").iterdir()}
    assert files == {"faults.md", "none.jsonl", "all_moderate.jsonl", "lidar.delay_0.1.jsonl"}
    table = (tmp_path / "out" / "faults.md").read_text()
    assert table in capsys.readouterr().out + "\n"
    together = read_trials(tmp_path / "out" / "all_moderate.jsonl")[1]
    assert [record["outcome"] for record in together] == ["reached", "reached"]
    assert "100.0 % (34.2 to 100.0)" in table.splitlines()[-1]
    least = min(record["min_clearance_m"] for record in together)
    assert table.splitlines()[-1].rstrip("| ").endswith(f"| {1e3 * least:.0f}")
