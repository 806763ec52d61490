"""Scan logs: written logs are read back, and invalid ones are rejected."""

import math
from pathlib import Path

import numpy as np
import pytest

from drake_starnav import LaserScan, StarnavError
from drake_starnav.lidar.scan_log import LoggedScan, read_csv, read_scan_log, restore_scans, write_csv
from tests.helpers.bags import Bag

SHIPPED = Path(__file__).parents[2] / "scripts" / "examples" / "room_scans.csv"


def record(*ranges: float, **changes) -> tuple[np.ndarray, dict]:
    usual = {"time": 1.0, "angle_min": -1.0, "angle_increment": 0.25, "range_min": 0.125, "range_max": 8.0}
    return np.zeros(3), usual | {"ranges": np.array(ranges)} | changes


@pytest.mark.parametrize("low", [0.0, -1.0, math.nan, math.inf])
def test_zero_is_no_measurement_whatever_the_least_range(low: float) -> None:
    (seen,) = restore_scans([record(0.0, 0.02, 1.0, range_min=low)], "log")
    assert seen.scan.lost.tolist() == [True, False, False] and seen.scan.range_min == 0.0


@pytest.mark.parametrize("high", [math.inf, math.nan, 0.0, -1.0, 0.125])
def test_a_largest_range_that_is_not_known_is_the_longest_of_the_log(high: float) -> None:
    records = [record(1.0, math.inf, 2.0, range_max=high), record(3.0, math.inf, 2.0, range_max=high)]
    for seen in restore_scans(records, "log"):
        assert seen.scan.hits.tolist() == [True, False, True]
        assert seen.scan.distances[1] == seen.scan.range_max == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"ranges": np.full(3, math.inf), "range_max": math.inf}, "^log: range_max is inf with .*no range is longer"),
        ({"angle_increment": 4.0}, r"^log, at 1\.000 s: laser scan: angle_increment 4 over 3 beams"),
    ],
)
def test_a_record_that_is_no_scan_is_named(changes: dict, said: str) -> None:
    with pytest.raises(StarnavError, match=said):
        restore_scans([record(1.0, 1.0, 1.0, **changes)], "log")


@pytest.mark.parametrize(
    ("sectors", "lost"),
    [
        ([(-0.1, 0.1)], [4]),
        ([(0.9, -0.9)], [0, 8]),
        ([(-1.0, -0.75), (6.0, 6.3)], [0, 1, 3, 4]),
        ([(-math.pi, math.pi)], list(range(9))),
    ],
)
def test_a_mask_loses_the_beams_of_its_sectors(sectors: list[tuple[float, float]], lost: list[int]) -> None:
    (seen,) = restore_scans([record(*np.ones(9))], "log", sectors)
    assert np.flatnonzero(seen.scan.lost).tolist() == lost


def log(count: int = 3) -> list[LoggedScan]:
    rng = np.random.default_rng(4)
    found = []
    for k in range(count):
        ranges = rng.uniform(0.1, 4.0, 8)
        ranges[k], ranges[-1] = math.inf, -math.inf
        scan = LaserScan(0.1 * k, -math.pi, math.pi / 4.0, 0.02, 5.0, ranges)
        found.append(LoggedScan(scan, np.array((0.5 * k, -1.0, 3.0 + 0.1 * k))))
    return found


def test_csv_reads_back_to_a_millimetre(tmp_path: Path) -> None:
    write_csv(tmp_path / "log.csv", log())
    again = read_csv(tmp_path / "log.csv")
    assert len(again) == 3
    for before, after in zip(log(), again, strict=True):
        assert after.scan.time == pytest.approx(before.scan.time, abs=1e-3)
        assert after.scan.angle_increment == before.scan.angle_increment
        assert after.scan.ranges == pytest.approx(before.scan.ranges, abs=5.1e-4)
        assert after.pose == pytest.approx(before.pose, abs=5.1e-4)


def test_the_shipped_log_is_of_one_full_circle_lidar() -> None:
    seen = read_csv(SHIPPED)
    assert len(seen) == 25 and all(item.scan.full_circle and len(item.scan.ranges) == 180 for item in seen)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "time,x,y\n1,2,3\n",
        "# angle_min=0, angle_increment=1, range_min=0\n0,0,0,0,1,1,1\n",
        "# angle_min=0, angle_increment=1, range_min=0, range_max=5\n0,0,0,0,1,word,1\n",
        "# angle_min=0, angle_increment=1, range_min=0, range_max=5\n0,nan,0,0,1,1,1\n",
        "# angle_min=0, angle_increment=1, range_min=0, range_max=5\n0,0,0,0,1\n",
    ],
)
def test_an_invalid_log_is_rejected(tmp_path: Path, text: str) -> None:
    file = tmp_path / "log.csv"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(StarnavError, match=r"scan log .*log\.csv.*; allowed: "):
        read_csv(file)


def test_a_table_and_a_bag_of_one_scan_mean_the_same(tmp_path: Path) -> None:
    ranges = [0.0, 0.007, -1.0, math.nan, math.inf, -math.inf, 0.125, 1.5, 8.0, 65.5]
    bag = Bag()
    bag.odometry(0.0, 0.5, 0.25)
    bag.scan(0.0, ranges, angle_min=1.5, angle_increment=-0.5, range_min=0.125)
    text = ",".join(map(str, [0.0, 0.5, 0.0, 0.25, *ranges]))
    header = "# angle_min=1.5, angle_increment=-0.5, range_min=0.125, range_max=8\n"
    (tmp_path / "log.csv").write_text(header + text + "\n", encoding="utf-8")
    (table,), (bagged,) = read_scan_log(tmp_path / "log.csv"), read_scan_log(bag.write(tmp_path / "bag"))
    np.testing.assert_array_equal(table.scan.ranges, bagged.scan.ranges)
    assert table.scan.field_of_view == bagged.scan.field_of_view
    assert table.pose == pytest.approx(bagged.pose)
