"""What drivers write into ranges and limits, and what it means."""

import math

import numpy as np
import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.scan_records import ScanRecord, logged_scans


def record(*ranges: float, **changes) -> ScanRecord:
    usual = ScanRecord(1.0, np.zeros(3), -1.0, 0.25, 0.125, 8.0, np.array(ranges))
    return usual._replace(**changes)


def test_what_is_no_measurement_is_a_lost_beam() -> None:
    ranges = (0.0, -0.0, 0.007, -1.0, -65.0, math.nan, 0.125, 2.0, math.inf, -math.inf, 9.0)
    (seen,) = logged_scans([record(*ranges)], "log")
    assert np.flatnonzero(seen.scan.lost).tolist() == [0, 1, 2, 3, 4, 5]
    assert np.flatnonzero(seen.scan.hits).tolist() == [6, 7, 9]
    assert (seen.scan.distances[6:8] == (0.125, 2.0)).all()


@pytest.mark.parametrize("low", [0.0, -1.0, math.nan, math.inf])
def test_zero_is_no_measurement_whatever_the_least_range(low: float) -> None:
    (seen,) = logged_scans([record(0.0, 0.02, 1.0, range_min=low)], "log")
    assert seen.scan.lost.tolist() == [True, False, False] and seen.scan.range_min == 0.0


@pytest.mark.parametrize("high", [math.inf, math.nan, 0.0, -1.0, 0.125])
def test_a_largest_range_that_is_not_known_is_the_longest_of_the_log(high: float) -> None:
    records = [record(1.0, math.inf, 2.0, range_max=high), record(3.0, math.inf, 2.0, range_max=high)]
    for seen in logged_scans(records, "log"):
        assert seen.scan.hits.tolist() == [True, False, True]
        assert seen.scan.distances[1] == seen.scan.range_max == pytest.approx(3.0)


def test_without_any_range_the_largest_cannot_be_told() -> None:
    with pytest.raises(StarnavError, match=r"^log: range_max is inf with range_min 0\.125, and no range is longer"):
        logged_scans([record(math.inf, math.inf, math.inf, range_max=math.inf)], "log")


def test_a_record_that_is_no_scan_is_named_by_its_time() -> None:
    with pytest.raises(StarnavError, match=r"^log, at 1\.000 s: laser scan: angle_increment 4 over 3 beams"):
        logged_scans([record(1.0, 1.0, 1.0, angle_increment=4.0)], "log")


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
    (seen,) = logged_scans([record(*np.ones(9))], "log", sectors)
    assert np.flatnonzero(seen.scan.lost).tolist() == lost


def test_a_mask_has_finite_bearings() -> None:
    with pytest.raises(StarnavError, match=r"a masked sector is \(0\.0, nan\); allowed: finite bearings"):
        logged_scans([record(1.0, 1.0, 1.0)], "log", [(0.0, math.nan)])
