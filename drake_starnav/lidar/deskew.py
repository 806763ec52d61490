"""Rolling scans, whose beams are measured one after the other while the robot drives, made into scans taken at once."""

import dataclasses
import math

import numpy as np
from numba import njit

from drake_starnav.geometry.se2 import now_in
from drake_starnav.lidar.laser_scan import UNKNOWN, LaserScan


def taken_at_once(scan: LaserScan, earlier: np.ndarray, time: float, pose: np.ndarray) -> LaserScan:
    """The scan as if all beams had been measured with the last one, from where the sensor was then.

    What each beam hit, or how far it saw, is moved into the sensor frame at the end and taken up by the beam that is
    nearest to it in bearing there; of several things in one beam the nearest counts. Beams that nothing falls into are
    lost: some where the sweep was stretched, and a gap at its seam if the robot turned against the sweep.

    Args:
        scan: rolling, i.e. with a time increment.
        earlier: (x, y, yaw) of the sensor frame S in W at an earlier time, m and rad; it moved evenly since.
        time: that time, s; earlier than the scan's.
        pose: (x, y, yaw) of S in W at the time of the scan, i.e. of its last beam.

    Returns:
        A scan with as many beams, of time increment 0.
    """
    x, y, turn = now_in(pose, earlier)
    begin = np.array((x, y, turn)) * (scan.time_increment / (scan.time - time))  # moved back by one beam's time
    ranges, source = _rebinned(scan.ranges, begin, scan.angle_min, scan.angle_increment, scan.range_min, scan.range_max)
    motion = None if scan.motion is None else np.where(source >= 0, scan.motion[source], UNKNOWN)
    return dataclasses.replace(scan, ranges=ranges, time_increment=0.0, lost_beams=True, motion=motion)


@njit(cache=True)
def _rebinned(ranges, step, angle_min, increment, range_min, range_max):
    """The ranges as seen from the end of the sweep, and which beam each came from, or -1."""
    n = len(ranges)
    out, source = np.full(n, np.nan), np.full(n, -1)
    for i in range(n):
        if math.isnan(ranges[i]):
            continue
        back = n - 1 - i
        bearing = angle_min + i * increment + back * step[2]
        x, y = math.cos(bearing), math.sin(bearing)
        if ranges[i] > -math.inf:  # what is too close has a bearing only
            reach = min(ranges[i], range_max)
            x, y = back * step[0] + reach * x, back * step[1] + reach * y
        k = int((math.atan2(y, x) - angle_min + 0.5 * increment) % (2.0 * math.pi) / increment)
        if k >= n:
            continue  # outside the view
        distance = math.hypot(x, y)
        if ranges[i] == math.inf or distance >= range_max:
            distance = math.inf
        elif ranges[i] == -math.inf or distance < range_min:
            distance = -math.inf
        if not distance >= out[k]:  # nearer, or the first
            out[k], source[k] = distance, i
    return out, source
