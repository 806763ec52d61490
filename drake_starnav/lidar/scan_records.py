"""What a log's records of scans mean, in whatever format they are written."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.laser_scan import LaserScan

Sectors = Sequence[tuple[float, float]]
"""Bearings in the sensor frame S, from the first counter-clockwise to the second of each pair, rad."""


@dataclass(frozen=True)
class LoggedScan:
    """A scan in the sensor frame S with the pose (x, y, yaw) of S in W at its time, m and rad."""

    scan: LaserScan
    pose: np.ndarray


class ScanRecord(NamedTuple):
    """One scan as a log has it, with the field names of ROS `sensor_msgs/LaserScan`.

    Attributes:
        time: s.
        pose: (x, y, yaw) of S in W, m and rad.
        angle_min, angle_increment: bearing of the first beam, and from beam to beam, rad; negative if they turn
            clockwise.
        range_min, range_max: limits of the sensor, m; see `logged_scans`.
        ranges: shape (n,), m.
    """

    time: float
    pose: np.ndarray
    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    ranges: np.ndarray


def logged_scans(records: Sequence[ScanRecord], log: str, mask: Sectors = ()) -> list[LoggedScan]:
    """Scans from what drivers write.

    Ranges mean what they do in a `LaserScan` whose beams may be lost. A `range_max` that is infinite or not above
    `range_min` is not known: all that the log shows of it is its longest finite range. A `range_min` that is negative
    or not finite counts as 0.

    Args:
        records: at least one.
        log: what they are of, for messages.
        mask: where the robot sees itself: beams there are lost.

    Raises:
        StarnavError: a record is no scan, or the log has no range from which its unknown `range_max` would follow.
    """
    longest = 0.0
    for record in records:
        finite = record.ranges[np.isfinite(record.ranges)]
        longest = max(longest, float(finite.max(initial=0.0)))
    scans = []
    for record in records:
        low = record.range_min if 0.0 <= record.range_min < math.inf else 0.0
        high = record.range_max
        if not low < high < math.inf:
            high = math.nextafter(longest, math.inf)
            if high <= low:
                raise StarnavError(
                    f"{log}: range_max is {record.range_max:g} with range_min {record.range_min:g}, and no range is "
                    "longer; allowed: range_min < range_max, or at least one range from which to tell"
                )
        angles = record.angle_min, record.angle_increment
        try:
            scan = LaserScan(record.time, *angles, low, high, record.ranges, lost_beams=True)
        except StarnavError as error:
            raise StarnavError(f"{log}, at {record.time:.3f} s: {error}") from None
        scans.append(LoggedScan(scan.masked(mask) if len(mask) else scan, record.pose))
    return scans
