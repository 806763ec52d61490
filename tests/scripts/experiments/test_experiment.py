"""What experiments share: the cells of their tables."""

from pathlib import Path

import pytest

from scripts.experiments.experiment import comparison_cells, comparison_head, experiment_parser, run_experiment


def trial(number: int, outcome: str, time: float, scenario: str = "forest") -> dict:
    return {"scenario": scenario, "trial": number, "outcome": outcome, "time_s": time, "path_length_m": 1.0}


def test_cells_of_each_scenario_stand_below_their_heads() -> None:
    reference = [trial(0, "reached", 10.0), trial(1, "reached", 10.0), trial(0, "reached", 5.0, "room")]
    records = [trial(0, "reached", 20.0), trial(1, "collision", 3.0), trial(0, "reached", 5.0, "room")]
    head = comparison_head(["forest", "room"], "star")
    cells = comparison_cells(records, reference, ["forest", "room"])
    assert head == [
        "forest: reached (95 %)", "collisions", "time / star", "room: reached (95 %)", "collisions", "time / star",
    ]  # fmt: skip
    assert [cell.partition(" ")[0] for cell in cells] == ["50.0", "1", "2.00", "100.0", "0", "1.00"]


@pytest.mark.slow
def test_the_size_of_all_rows_comes_first(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    (tmp_path / "short.yaml").write_text("world: !Room {}\nsimulation: {timeout: 0.1}\n")
    parser = experiment_parser("mine.py", "", ["room"], tmp_path / "out")
    options = parser.parse_args([str(tmp_path / "short.yaml"), "--trials", "2", "--jobs", "1"])
    variants = {"slow": ("star", ["robot.max_speed=0.1"]), "fast": ("star", ["robot.max_speed=0.9"])}
    run_experiment(variants, options, {"table.md": lambda results, scenarios: f"{len(results)} rows"})
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "2 rows, 4 trials of 1 case, 1 at a time"
    assert lines[1] == "slow 2 trials of 1 case, 1 at a time"
