"""What experiments share: the cells of their tables."""

from scripts.experiments.experiment import comparison_cells, comparison_head


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
