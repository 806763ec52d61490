"""Logs of scans with their poses: CSV files, and ROS bags as of `rosbag`."""

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.utils.files import explain_read_errors

Sectors = Sequence[tuple[float, float]]
"""Bearings in the sensor frame S, from the first counter-clockwise to the second of each pair, rad."""
Record = tuple[np.ndarray, dict[str, Any]]
"""The pose (x, y, yaw) of S in W, m and rad, and the fields of a `LaserScan` as a log has them."""
CSV_HEADER = ("angle_min", "angle_increment", "range_min", "range_max")
"""The first line of a CSV file, a comment `# name=value, ...`; each further line is time, x, y, yaw, ranges."""


@dataclass(frozen=True)
class LoggedScan:
    """A scan in the sensor frame S with the pose (x, y, yaw) of S in W at its time, m and rad."""

    scan: LaserScan
    pose: np.ndarray


def restore_scans(records: Sequence[Record], log: str, mask: Sectors = ()) -> list[LoggedScan]:
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
    all_ranges = np.concatenate([fields["ranges"] for _, fields in records])
    longest_range, scans = float(all_ranges[np.isfinite(all_ranges)].max(initial=0.0)), []
    for pose, fields in records:
        range_min, range_max = fields["range_min"], fields["range_max"]
        range_min = range_min if 0.0 <= range_min < math.inf else 0.0
        if not range_min < range_max < math.inf:
            range_max = math.nextafter(longest_range, math.inf)
            if range_max <= range_min:
                raise StarnavError(
                    f"{log}: range_max is {fields['range_max']:g} with range_min {fields['range_min']:g}, and no range "
                    "is longer; allowed: range_min < range_max, or at least one range from which to tell"
                )
        try:
            scan = LaserScan(**(fields | {"range_min": range_min, "range_max": range_max, "lost_beams": True}))
        except StarnavError as error:
            raise StarnavError(f"{log}, at {fields['time']:.3f} s: {error}") from None
        scans.append(LoggedScan(scan.mask_sectors(mask) if len(mask) else scan, pose))
    return scans


def read_scan_log(path: str | Path, *, mask: Sectors = (), **topics: str) -> list[LoggedScan]:
    """The scans of a log: a CSV file as of `read_csv`, or else a ROS bag as of `read_rosbag`.

    Args:
        path: a file that ends in `.csv`, or a bag.
        mask: where the robot sees itself: pairs of bearings in S, rad, counter-clockwise; beams between are lost.
        topics: `scan_topic` and `pose_topic` of a bag.

    Raises:
        StarnavError: as of `read_csv` and `read_rosbag`.
    """
    path = Path(path)
    if path.suffix == ".csv":
        return read_csv(path, mask=mask)
    from drake_starnav.lidar.rosbag import read_rosbag  # late: it makes its scans by this module

    return read_rosbag(path, mask=mask, **topics)


def write_csv(file: Path, log: Sequence[LoggedScan]) -> None:
    """Write scans of one sensor, at least one, rounded to 1 mm; all share the angles and range limits of the first."""
    header = ", ".join(f"{name}={getattr(log[0].scan, name)!r}" for name in CSV_HEADER)
    rows = [(log_entry.scan.time, *log_entry.pose, *log_entry.scan.ranges) for log_entry in log]
    np.savetxt(file, rows, fmt="%.3f", delimiter=",", header=header)


def read_csv(file: Path, *, mask: Sectors = ()) -> list[LoggedScan]:
    """The scans of a file as from `write_csv`, see `restore_scans`; a `StarnavError` for a file of another format."""
    names = ", ".join(f"{name}=..." for name in CSV_HEADER)
    allowed_text = f"a first line `# {names}`, then lines of time, x, y, yaw and the ranges"
    with (
        explain_read_errors(f"scan log {file}", allowed_text),
        file.open(encoding="utf-8") as lines,
        warnings.catch_warnings(),
    ):
        warnings.simplefilter("ignore")  # of a file without rows, which is refused below
        first_line = lines.readline()
        fields = dict(part.split("=") for part in first_line.replace(" ", "").strip("#\n").split(",") if "=" in part)
        if missing := [name for name in CSV_HEADER if name not in fields]:
            raise ValueError(f"its first line has no {missing[0]}" if first_line else "it is empty")
        header: dict[str, Any] = {name: float(fields[name]) for name in CSV_HEADER}
        scan_rows = np.loadtxt(lines, delimiter=",", ndmin=2)
    if scan_rows.shape[1] < 7 or not np.isfinite(scan_rows[:, :4]).all():
        raise StarnavError(
            f"scan log {file}: rows of {scan_rows.shape[1]} numbers, or poses that are not finite; "
            "allowed: finite time, x, y, yaw and at least 3 ranges"
        )
    records = [(row[1:4], {"time": row[0], "ranges": row[4:], **header}) for row in scan_rows]
    return restore_scans(records, f"scan log {file}", mask)
