"""Logs of scans with their poses: read from CSV files and ROS bags, written as CSV files."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.laser_scan import LaserScan

CSV_HEADER = ("angle_min", "angle_increment", "range_min", "range_max")
"""The first line of a CSV file, a comment `# name=value, ...`; each further line is time, x, y, yaw, ranges."""


@dataclass(frozen=True)
class LoggedScan:
    """A scan with its pose.

    Attributes:
        scan: in the sensor frame S.
        pose: (x, y, yaw) of S in W at the scan's time, m and rad.
    """

    scan: LaserScan
    pose: np.ndarray


def write_csv(file: Path, log: Sequence[LoggedScan]) -> None:
    """Write scans of one sensor, rounded to 1 mm.

    Args:
        file: path of the file.
        log: at least one scan; all share the angles and range limits of the first.
    """
    header = ", ".join(f"{name}={getattr(log[0].scan, name)!r}" for name in CSV_HEADER)
    rows = [(seen.scan.time, *seen.pose, *seen.scan.ranges) for seen in log]
    np.savetxt(file, rows, fmt="%.3f", delimiter=",", header=header)


def read_scan_log(path: str | Path) -> list[LoggedScan]:
    """The scans of a log: a CSV file as of `read_csv`, or else a bag with the topics `/scan` and `/odom`.

    Raises:
        StarnavError: as of `read_csv` and `read_rosbag`.
    """
    path = Path(path)
    return read_csv(path) if path.suffix == ".csv" else read_rosbag(path)


def read_csv(file: Path) -> list[LoggedScan]:
    """The scans of a file in the format of `write_csv`.

    Raises:
        StarnavError: the file cannot be read or has another format.
    """
    try:
        with file.open(encoding="utf-8") as lines:
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
    return [
        LoggedScan(LaserScan(time=row[0], ranges=row[4:], lost_beams=True, motion=None, **header), row[1:4])
        for row in rows
    ]


def read_rosbag(path: Path, *, scan_topic: str = "/scan", odometry_topic: str = "/odom") -> list[LoggedScan]:
    """The scans of a ROS 1 or ROS 2 bag with their poses from odometry; ROS need not be installed.

    The lidar is assumed to be mounted on the robot's axis and aligned with its base; the odometry frame is W. Poses are
    interpolated between odometry messages; scans before the first or after the last message are omitted. A range of NaN
    or 0, which some drivers report for a beam without a measurement, is a lost beam.

    Args:
        path: folder or file of the bag.
        scan_topic: topic of `sensor_msgs/LaserScan`.
        odometry_topic: topic of `nav_msgs/Odometry`.

    Raises:
        StarnavError: the extra `rosbag` is not installed, the bag cannot be read, or a topic is missing.
    """
    try:
        from rosbags.highlevel import AnyReader, AnyReaderError
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise StarnavError(
            f"bag {path}: package rosbags is missing; allowed: pip install drake-starnav[rosbag]"
        ) from None
    scans, poses = [], []
    try:
        with AnyReader([path], default_typestore=get_typestore(Stores.LATEST)) as reader:
            topics = sorted({connection.topic for connection in reader.connections})
            for topic in (scan_topic, odometry_topic):
                if topic not in topics:
                    raise StarnavError(f"bag {path} has no topic {topic}; allowed: {', '.join(topics) or 'none'}")
            chosen = [c for c in reader.connections if c.topic in (scan_topic, odometry_topic)]
            for connection, _, data in reader.messages(connections=chosen):
                message = reader.deserialize(data, connection.msgtype)
                time = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
                if connection.topic == scan_topic:
                    scans.append((time, message))
                else:
                    poses.append((time, *_planar(message.pose.pose)))
    except (AnyReaderError, OSError) as error:
        raise StarnavError(f"bag {path} cannot be read: {error}; allowed: a ROS 1 or ROS 2 bag") from None
    if not scans or not poses:
        raise StarnavError(f"bag {path}: {len(scans)} scans and {len(poses)} poses; allowed: at least one of each")
    times, *track = np.array(sorted(poses)).T
    track[2] = np.unwrap(track[2])
    log = []
    for time, message in scans:
        if times[0] <= time <= times[-1]:
            ranges = np.array(message.ranges, dtype=float)
            ranges[ranges == 0.0] = math.nan  # reported by many drivers for a beam without a measurement
            scan = LaserScan(
                time=time - times[0],
                angle_min=float(message.angle_min),
                angle_increment=float(message.angle_increment),
                range_min=float(message.range_min),
                range_max=float(message.range_max),
                ranges=ranges,
                lost_beams=True,
            )
            log.append(LoggedScan(scan, np.array([np.interp(time, times, values) for values in track])))
    return log


def _planar(pose) -> tuple[float, float, float]:
    """(x, y, yaw) of a `geometry_msgs/Pose`."""
    q = pose.orientation
    yaw = math.atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z))
    return pose.position.x, pose.position.y, yaw
