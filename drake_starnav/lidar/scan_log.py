"""Logs of scans with their poses: CSV files, and ROS bags as of `rosbag`."""

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.rosbag import read_rosbag as read_rosbag
from drake_starnav.lidar.scan_records import LoggedScan as LoggedScan
from drake_starnav.lidar.scan_records import ScanRecord, Sectors, logged_scans

CSV_HEADER = ("angle_min", "angle_increment", "range_min", "range_max")
"""The first line of a CSV file, a comment `# name=value, ...`; each further line is time, x, y, yaw, ranges."""


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
    return read_rosbag(path, mask=mask, **topics)


def write_csv(file: Path, log: Sequence[LoggedScan]) -> None:
    """Write scans of one sensor, at least one, rounded to 1 mm; all share the angles and range limits of the first."""
    header = ", ".join(f"{name}={getattr(log[0].scan, name)!r}" for name in CSV_HEADER)
    rows = [(seen.scan.time, *seen.pose, *seen.scan.ranges) for seen in log]
    np.savetxt(file, rows, fmt="%.3f", delimiter=",", header=header)


def read_csv(file: Path, *, mask: Sectors = ()) -> list[LoggedScan]:
    """The scans of a file in the format of `write_csv`; what its numbers mean, `logged_scans` says.

    Raises:
        StarnavError: the file cannot be read or has another format.
    """
    try:
        with file.open(encoding="utf-8") as lines, warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of a file without rows, which is refused below
            fields = dict(part.strip().split("=") for part in lines.readline().lstrip("# ").split(","))
            header: dict[str, Any] = {name: float(fields[name]) for name in CSV_HEADER}
            rows = np.loadtxt(lines, delimiter=",", ndmin=2)
    except (OSError, UnicodeDecodeError, ValueError, KeyError) as error:
        names = ", ".join(f"{name}=..." for name in CSV_HEADER)
        raise StarnavError(
            f"scan log {file} cannot be read: {error}; allowed: a first line `# {names}`, then lines of "
            "time, x, y, yaw and the ranges"
        ) from None
    if rows.shape[1] < 7 or not np.isfinite(rows[:, :4]).all():
        raise StarnavError(
            f"scan log {file}: rows of {rows.shape[1]} numbers, or poses that are not finite; "
            "allowed: finite time, x, y, yaw and at least 3 ranges"
        )
    records = [ScanRecord(time=row[0], pose=row[1:4], ranges=row[4:], **header) for row in rows]
    return logged_scans(records, f"scan log {file}", mask)
