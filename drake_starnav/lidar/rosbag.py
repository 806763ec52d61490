"""Scans and poses from ROS 1 and ROS 2 bags; ROS need not be installed."""

import functools
import math
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from drake_starnav.errors import StarnavError, said_by
from drake_starnav.lidar.scan_log import LoggedScan, Record, Sectors, logged_scans

POSE_TOPICS = ("/odom", "/tf")
"""Where poses are looked for, in this order."""
FIXED_TRANSFORMS = "tf_static"
"""The end of the names of topics whose transforms never change."""


def read_rosbag(
    path: Path, *, scan_topic: str = "/scan", pose_topic: str | None = None, mask: Sectors = ()
) -> list[LoggedScan]:
    """The scans of a bag with their poses in a fixed frame W; what their numbers mean, `logged_scans` says.

    W is the frame of the poses, or the root of the tree of transforms. If transforms say how the lidar is mounted, the
    poses are those of the lidar, which may be upside down; otherwise they are those of the robot. They are interpolated
    between messages; scans before the first or after the last are left out, with a warning.

    Args:
        path: folder or file of the bag.
        scan_topic: of `sensor_msgs/LaserScan`.
        pose_topic: of `nav_msgs/Odometry`, `geometry_msgs/PoseStamped` or `PoseWithCovarianceStamped`, or of transforms
            such as `/tf`; None for the first of POSE_TOPICS that the bag has.
        mask: where the robot sees itself, as for `read_scan_log`.

    Raises:
        StarnavError: the extra `rosbag` is not installed, the bag cannot be read, a topic is missing or has no
            messages, no transform leads from the lidar to a fixed frame, the lidar is tilted, or all scans were taken
            before or after all poses.
    """
    scans, frames = [], _Frames(path)
    for topic, message in _messages(path, scan_topic, pose_topic):
        if topic == scan_topic:
            scans.append((_seconds(message.header.stamp), message))
        elif hasattr(message, "transforms"):
            for each in message.transforms:
                frames.add(each.child_frame_id, each.header, each.transform, moves=not topic.endswith(FIXED_TRANSFORMS))
        else:
            pose = getattr(message.pose, "pose", message.pose)  # the first of a pose with its covariance
            frames.add_robot(getattr(message, "child_frame_id", ""), message.header, pose)
    if not scans:
        raise StarnavError(f"bag {path}: 0 scans in {scan_topic}; allowed: at least one")
    chains = {frame: frames.chain(frame) for frame in {message.header.frame_id for _, message in scans}}
    spans = {frame: _span(chain) for frame, chain in chains.items()}
    first, last = next(iter(spans.values()))
    records = []
    for time, message in scans:
        frame = message.header.frame_id
        if spans[frame][0] <= time <= spans[frame][1]:
            pose = functools.reduce(lambda X, link: link.at(time) @ X, chains[frame], np.eye(4))
            records.append(_record(time - first, message, pose, path))
    taken = [time for time, _ in scans]
    said = f"scans are from {min(taken):.3f} to {max(taken):.3f} s, poses from {first:.3f} to {last:.3f} s"
    if not records:
        raise StarnavError(f"bag {path}: {said}; allowed: stamps of one clock, and scans between poses")
    if len(records) < len(scans):
        left_out = len(scans) - len(records)
        warnings.warn(f"bag {path}: {left_out} of {len(scans)} scans are left out: {said}", stacklevel=2)
    return logged_scans(records, f"bag {path}", mask)


def _messages(path: Path, scan_topic: str, pose_topic: str | None) -> Iterator[tuple[str, Any]]:
    """The topics and messages of the scans, the poses and the fixed transforms, in the order of the bag."""
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise StarnavError(
            f"bag {path}: package rosbags is missing; allowed: pip install drake-starnav[rosbag]"
        ) from None
    try:
        with AnyReader([path], default_typestore=get_typestore(Stores.LATEST)) as reader:
            topics = sorted({connection.topic for connection in reader.connections})
            has = ", ".join(topics) or "none"
            if pose_topic is None:
                pose_topic = next((topic for topic in POSE_TOPICS if topic in topics), None)
            if pose_topic is None:
                raise StarnavError(
                    f"bag {path} has neither {' nor '.join(POSE_TOPICS)}; allowed: pose_topic, one of {has}"
                )
            for topic in (scan_topic, pose_topic):
                if topic not in topics:
                    raise StarnavError(f"bag {path} has no topic {topic}; allowed: {has}")
            wanted = {scan_topic, pose_topic, *(topic for topic in topics if topic.endswith(FIXED_TRANSFORMS))}
            for connection, _, data in reader.messages([c for c in reader.connections if c.topic in wanted]):
                yield connection.topic, reader.deserialize(data, connection.msgtype)
    except StarnavError:
        raise
    except Exception as error:  # of the reader or of what it is built on: a damaged bag may raise anything
        raise StarnavError(f"bag {path} cannot be read: {said_by(error)}; allowed: a ROS 1 or ROS 2 bag") from None


@dataclass
class _Link:
    """The pose of a frame in its parent over time: rows of time, s, position, m, and quaternion (x, y, z, w)."""

    parent: str
    moves: bool
    rows: list[tuple[float, ...]] = field(default_factory=list)

    def at(self, time: float) -> np.ndarray:
        """The pose at a time, interpolated between the samples, as a matrix of shape (4, 4)."""
        table = np.array(self.rows)
        k = int(np.clip(np.searchsorted(table[:, 0], time), 1, len(table) - 1)) if len(table) > 1 else 0
        before, after = table[k - 1], table[k]
        if after[4:] @ before[4:] < 0.0:
            after = np.append(after[:4], -after[4:])  # the same rotation, by the shorter way
        step = after[0] - before[0]
        share = min(max((time - before[0]) / step, 0.0), 1.0) if step > 0.0 else 1.0
        return _matrix(before + share * (after - before))


class _Frames:
    """The tree of frames that the messages of a bag describe."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._links: dict[str, _Link] = {}
        self._robot: str | None = None

    def add(self, child: str, header: Any, transform: Any, *, moves: bool) -> None:
        """A transform of `tf2_msgs/TFMessage`."""
        self._sample(_name(child), header, transform.translation, transform.rotation, moves)

    def add_robot(self, child: str, header: Any, pose: Any) -> None:
        """A pose of the robot, whose frame may be unnamed."""
        self._robot = _name(child)
        self._sample(self._robot, header, pose.position, pose.orientation, True)

    def _sample(self, child: str, header: Any, p: Any, q: Any, moves: bool) -> None:
        link = self._links.setdefault(child, _Link(_name(header.frame_id), moves))
        row = _seconds(header.stamp), p.x, p.y, p.z, q.x, q.y, q.z, q.w
        if not all(map(math.isfinite, row)):
            raise StarnavError(
                f"bag {self._path}: the pose of {child or 'the robot'} at {row[0]:.3f} s is {row[1:]}; allowed: finite"
            )
        if moves:
            link.rows.append(row)
        else:
            link.rows = [row]

    def chain(self, frame: str) -> list[_Link]:
        """The links from the frame of a lidar up to the root; with poses of the robot alone, that of the robot."""
        chain: list[_Link] = []
        name = _name(frame)
        while name in self._links and self._links[name] not in chain:
            chain.append(self._links[name])
            name = chain[-1].parent
        if self._robot is not None and self._links[self._robot] not in chain:
            chain = [self._links[self._robot]]
        if not any(link.moves for link in chain):
            raise StarnavError(
                f"bag {self._path}: no transform that moves leads from the scan's frame {frame} to a fixed one; "
                f"allowed: one of {', '.join(sorted(self._links)) or 'none'}, or a pose_topic"
            )
        for link in chain:
            link.rows.sort()
        return chain


def _span(chain: list[_Link]) -> tuple[float, float]:
    """From when to when all moving links of a chain are known, s."""
    moving = [link.rows for link in chain if link.moves]
    return max(rows[0][0] for rows in moving), min(rows[-1][0] for rows in moving)


def _matrix(row: np.ndarray) -> np.ndarray:
    """The homogeneous matrix, shape (4, 4), of a row as in `_Link`; a quaternion of zeros turns nothing."""
    out = np.eye(4)
    out[:3, 3] = row[1:4]
    if row[4:].any():
        out[:3, :3] = Rotation.from_quat(row[4:]).as_matrix()
    return out


def _record(time: float, message: Any, X_WS: np.ndarray, path: Path) -> Record:
    """The pose and the fields of a message of an upright lidar; beams of one that is upside down turn the other way."""
    upright = float(X_WS[2, 2])
    if abs(upright) < 0.99:  # the cosine of its tilt
        raise StarnavError(
            f"bag {path}: the lidar {message.header.frame_id} is tilted by {math.degrees(math.acos(upright)):.0f} "
            "degrees; allowed: a level one, upright or upside down"
        )
    turns = math.copysign(1.0, upright)
    pose = np.array((X_WS[0, 3], X_WS[1, 3], math.atan2(X_WS[1, 0], X_WS[0, 0])))
    return pose, {
        "time": time,
        "angle_min": turns * float(message.angle_min),
        "angle_increment": turns * float(message.angle_increment),
        "range_min": float(message.range_min),
        "range_max": float(message.range_max),
        "ranges": np.array(message.ranges, dtype=float),
    }


def _name(frame: str) -> str:
    """A frame's name without the leading slash that ROS 1 allowed."""
    return frame.removeprefix("/")


def _seconds(stamp: Any) -> float:
    return float(stamp.sec + 1e-9 * stamp.nanosec)
