"""De-skewing: a rolling scan, measured beam after beam while the robot drives, becomes a scan taken at one time."""

import math

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.geometry.se2 import find_pose_in_frame
from drake_starnav.lidar.field_of_view import TURN
from drake_starnav.lidar.laser_scan import UNKNOWN, LaserScan

UNSWEPT = 0.001
"""Within the margin: beside a limited view, what is unseen because the sensor moved by this, m, does not count."""


def deskew_scan(
    scan: LaserScan, earlier: np.ndarray, time: float, pose: np.ndarray, own: float = math.inf
) -> LaserScan:
    """The scan as if all beams had been measured with the last one, from the sensor's pose at that time.

    The end point of each beam is transformed into the sensor frame at the end of the sweep and assigned to the beam of
    the nearest bearing there; of several points in one beam the nearest counts. Beams without a point are lost: single
    ones where the robot's motion stretched the sweep, and a gap at the seam if the robot turned against the sweep. So
    are those that lead through what lay beside the sweep: past its first beam, if the sensor has moved to that side.

    Args:
        scan: rolling, i.e. with a time increment, which is negative if the last beam was measured first.
        earlier: (x, y, yaw) of the sensor frame S in W at an earlier time, m and rad; constant velocity since then.
        time: that earlier time, s.
        pose: (x, y, yaw) of S in W at the time of the scan, i.e. of the beam that was measured last.
        own: how far around the sensor there is only the robot itself, m; infinite: nobody relies on what is free.

    Returns:
        A scan with as many beams and time increment 0.
    """
    x, y, turn = find_pose_in_frame(pose, earlier)
    step = np.array((x, y, turn)) * (abs(scan.time_increment) / (scan.time - time))
    field, is_clockwise = scan.field_of_view, scan.time_increment < 0.0
    ranges, source = _rebin_ranges(scan.ranges, step, is_clockwise, field, field.seam, scan.range_min, scan.range_max)
    if own < math.inf:
        _lose_unswept(ranges, scan, step, max(own, scan.thinnest))
    motion = None if scan.motion is None else np.where(source >= 0, scan.motion[source], UNKNOWN)
    thinnest = scan.thinnest * scan.angle_increment / (scan.angle_increment + abs(step[2]))  # beams are farther apart
    return scan.again(ranges, time_increment=0.0, lost_beams=True, motion=motion, thinnest=thinnest)


def _lose_unswept(ranges: np.ndarray, scan: LaserScan, step: np.ndarray, own: float) -> None:
    """Lose the beams (n,) of a de-skewed scan that lead past the first beam of its sweep farther away than `own`, m."""
    valid_beams, side = np.flatnonzero(~np.isnan(scan.ranges)), -1.0 if scan.time_increment < 0.0 else 1.0
    if not len(valid_beams):
        return
    first = valid_beams[0] if side > 0.0 else valid_beams[-1]
    last_beam = len(ranges) - 1 - first if side > 0.0 else first
    bearing, (x, y) = scan.bearings[first] + last_beam * step[2], last_beam * step[:2]
    outside_distance = side * (math.sin(bearing) * -x - math.cos(bearing) * -y)  # of the line of the first beam, m
    if outside_distance > (scan.thinnest if scan.full_circle else UNSWEPT):
        turn_beyond = np.mod(side * (scan.bearings - bearing), TURN)
        lost_range = max(own, 2.0 * outside_distance)
        ranges[(turn_beyond < 0.5 * math.pi) & (lost_range * np.sin(turn_beyond) < outside_distance)] = math.nan


@kernel
def _rebin_ranges(ranges, step, clockwise, field, seam, range_min, range_max):
    """The ranges (n,), m, as seen from the end of the sweep, and the index of the beam each came from, or -1.

    `step` is (x, y, yaw) of the sensor one beam earlier, as seen from where it is, m and rad; `clockwise` whether the
    last beam was measured first; field and seam are as of `FieldOfView`.
    """
    angle_min, increment, n = field.angle_min, field.angle_increment, field.beams
    out, source = np.full(n, np.nan), np.full(n, -1)
    for i in range(n):
        if math.isnan(ranges[i]):
            continue
        beam_in_order = i if clockwise else n - 1 - i
        bearing = angle_min + i * increment + beam_in_order * step[2]
        x, y = math.cos(bearing), math.sin(bearing)
        if ranges[i] > -math.inf:  # a hit that is too close has only a bearing
            reach = min(ranges[i], range_max)
            x, y = beam_in_order * step[0] + reach * x, beam_in_order * step[1] + reach * y
        turn_beyond = (math.atan2(y, x) - angle_min + 0.5 * increment) % (2.0 * math.pi)
        k = int(turn_beyond / increment)
        if k >= n:
            if seam == math.inf:
                continue  # outside the field of view
            k = n - 1 if turn_beyond < (n - 0.5) * increment + 0.5 * seam else 0
        distance = math.hypot(x, y)
        if ranges[i] == math.inf or distance >= range_max:
            distance = math.inf
        elif ranges[i] == -math.inf or distance < range_min:
            distance = -math.inf
        if not distance >= out[k]:  # nearer, or the first
            out[k], source[k] = distance, i
    return out, source
