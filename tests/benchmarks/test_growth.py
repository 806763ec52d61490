"""The tables of growing costs: their scenarios, and one of them driven."""

from dataclasses import replace
from pathlib import Path

from benchmarks import growth
from drake_starnav import run_trial


def test_each_row_differs_from_the_first_in_what_its_table_varies(tmp_path: Path) -> None:
    for table in growth.TABLES:
        first, *others = growth.scenarios(table, tmp_path).values()
        for row in others:
            assert len(row) == len(first) and all(a != b for a, b in zip(first, row, strict=True))
    assert [len(robots.robots) for (robots,) in growth.scenarios("six_robots", tmp_path).values()] == [1, 2, 3, 4, 5, 6]


def test_the_balls_stand_in_the_way_of_a_robot_that_sees_them(tmp_path: Path) -> None:
    trial = run_trial(growth.balls(tmp_path, 1))
    assert trial.outcome == "reached" and trial.path_length_m > 1.01 * trial.straight_line_m


def test_a_table_compares_its_rows_on_the_same_trials(tmp_path: Path) -> None:
    rows = growth.scenarios("six_robots", tmp_path)
    short = {name: [replace(row[0], simulation=replace(row[0].simulation, timeout=2.0))] for name, row in rows.items()}
    short = {name: short[name] for name in ("the first 1", "the first 2")}
    head, _, one, two = (line.split("|")[1:-1] for line in growth.measure("robots", short, 1).splitlines())
    assert head[0].strip() == "robots" and one[2].strip() == "1.00" and float(two[2]) > 1.0
    assert (one[-1].strip(), two[-1].strip()) == ("0 of 1", "0 of 2")
