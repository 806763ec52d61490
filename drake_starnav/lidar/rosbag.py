"""Scans and poses from ROS 1 and ROS 2 bags; ROS need not be installed."""

import math
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from drake_starnav.errors import StarnavError, counted
from drake_starnav.lidar.scan_log import LoggedScan, Record, Sectors, restore_scans
from drake_starnav.lidar.transforms import Frames, pose_along, seconds, span
from drake_starnav.utils.files import explain_read_errors

POSE_TOPICS = ("/odom", "/tf")
"""Where poses are looked for, in this order."""
SCANS, POSES = ("LaserScan",), ("Odometry", "PoseStamped", "PoseWithCovarianceStamped", "TFMessage", "tfMessage")
"""Messages of scans and of poses."""
FIXED_TRANSFORMS = "tf_static"
"""The end of the names of topics whose transforms never change."""


def read_rosbag(
    path: Path, *, scan_topic: str = "/scan", pose_topic: str | None = None, mask: Sectors = ()
) -> list[LoggedScan]:
    """The scans of a bag with their poses in a fixed frame W; what their numbers mean, `restore_scans` says.

    W is the frame of the poses, or the root of the tree of transforms. If transforms say how the lidar is mounted, the
    poses are those of the lidar, which may be upside down; otherwise they are those of the robot. They are interpolated
    between messages, but for the pose of a frame named `odom` in another, which holds until the next. With a warning
    that counts them are left out: scans before the first pose or after the last, scans without ranges, and all that
    comes after stamps went back, as when a simulation was restarted.

    Args:
        path: folder or file of the bag; a folder whose metadata.yaml is missing may hold .mcap or .db3 files.
        scan_topic: of `sensor_msgs/LaserScan`.
        pose_topic: of `nav_msgs/Odometry`, `geometry_msgs/PoseStamped` or `PoseWithCovarianceStamped`, or of transforms
            such as `/tf`; None for the first of POSE_TOPICS that the bag has.
        mask: where the robot sees itself, as for `read_scan_log`.

    Raises:
        StarnavError: the extra `rosbag` is not installed, the bag cannot be read, a topic is missing or has no
            messages, no transform leads from the lidar to a fixed frame, the lidar is tilted, or all scans were taken
            before or after all poses.
    """
    frames, messages = Frames(f"bag {path}"), list(_read_messages(path, scan_topic, pose_topic))
    messages = messages[: _find_restart(path, messages, scan_topic)]
    for topic, message in messages:
        if topic != scan_topic:
            _add_poses(frames, topic, message)
    scan_messages = _select_scans([message for topic, message in messages if topic == scan_topic], path, scan_topic)
    chains = {frame: frames.chain(frame) for frame in {message.header.frame_id for message in scan_messages}}
    spans = {frame: span(chain) for frame, chain in chains.items()}
    first_time, last_time = next(iter(spans.values()))
    records = []
    for message in scan_messages:
        frame, time = message.header.frame_id, seconds(message.header.stamp)
        if spans[frame][0] <= time <= spans[frame][1]:
            records.append(_record(time - first_time, message, pose_along(chains[frame], time), path))
    begin, end = (seconds(message.header.stamp) for message in (scan_messages[0], scan_messages[-1]))
    span_text = f"scans are from {begin:.3f} to {end:.3f} s, poses from {first_time:.3f} to {last_time:.3f} s"
    if not records:
        raise StarnavError(f"bag {path}: {span_text}; allowed: stamps of one clock, and scans between poses")
    if len(records) < len(scan_messages):
        omitted_count = len(scan_messages) - len(records)
        warnings.warn(f"bag {path}: {omitted_count} of {len(scan_messages)} scans left out: {span_text}", stacklevel=2)
    return restore_scans(records, f"bag {path}", mask)


def _add_poses(frames: Frames, topic: str, message: Any) -> None:
    """Add the transforms of a message, or the pose of the robot."""
    if hasattr(message, "transforms"):
        for each in message.transforms:
            frames.add(each.child_frame_id, each.header, each.transform, moves=not topic.endswith(FIXED_TRANSFORMS))
    else:
        pose = getattr(message.pose, "pose", message.pose)  # the first of a pose with its covariance
        frames.add_robot(getattr(message, "child_frame_id", ""), message.header, pose)


def _select_scans(messages: Sequence[Any], path: Path, scan_topic: str) -> list[Any]:
    """The scans that have ranges, by their stamps, with a warning of the others."""
    scans = sorted((each for each in messages if len(each.ranges)), key=lambda each: seconds(each.header.stamp))
    empty_count = len(messages) - len(scans)
    if not scans:
        empty_text = counted(empty_count, "scan")
        raise StarnavError(f"bag {path}: {scan_topic} has {empty_text} without ranges; allowed: one with")
    if empty_count:
        warnings.warn(f"bag {path}: {empty_count} of {len(messages)} scans left out, without ranges", stacklevel=3)
    return scans


def _find_restart(path: Path, messages: Sequence[tuple[str, Any]], scan_topic: str) -> int | None:
    """Index of the first message after the clock was set back, with a warning; None if it never was.

    It was where two messages in a row, of one topic or one pair of frames, are older than one before them: a single one
    may have been overtaken on its way.
    """
    latest_stamps: dict[tuple[str, str], float] = {}
    overtaken_indices: dict[tuple[str, str], int] = {}
    for k, (topic, message) in enumerate(messages):
        if topic.endswith(FIXED_TRANSFORMS):
            continue
        message_parts = message.transforms if hasattr(message, "transforms") else [message]
        for part in message_parts:
            part_stream = topic, f"{part.header.frame_id} {getattr(part, 'child_frame_id', '')}"
            time, last = seconds(part.header.stamp), latest_stamps.get(part_stream, -math.inf)
            if time >= last:
                latest_stamps[part_stream] = time
                overtaken_indices.pop(part_stream, None)
            elif part_stream in overtaken_indices:
                cut = overtaken_indices[part_stream]
                lost_scans = sum(topic == scan_topic for topic, _ in messages[cut:])
                warnings.warn(
                    f"bag {path}: stamps of {topic} go back from {last:.3f} to {time:.3f} s, as when a clock is set "
                    f"back: the log ends there, {counted(lost_scans, 'later scan')} left out",
                    stacklevel=3,
                )
                return cut
            else:
                overtaken_indices[part_stream] = k
    return None


def _read_messages(path: Path, scan_topic: str, pose_topic: str | None) -> Iterator[tuple[str, Any]]:
    """The topics and messages of the scans, the poses and the fixed transforms, in the order of the recording."""
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise StarnavError(
            f"bag {path}: package rosbags is missing; allowed: pip install drake-starnav[rosbag]"
        ) from None
    type_store = get_typestore(Stores.LATEST)
    whole_bag_text = "a whole bag of ROS 1 or ROS 2; `mcap recover` mends an .mcap file that was cut off"
    with (
        explain_read_errors(f"bag {path}", whole_bag_text),
        AnyReader(_find_files(path), default_typestore=type_store) as reader,
    ):
        kinds = {connection.topic: connection.msgtype.rpartition("/")[2] for connection in reader.connections}
        if pose_topic is None:
            pose_topic = next((topic for topic in POSE_TOPICS if topic in kinds), " or ".join(POSE_TOPICS))
        fixed_topics = {topic for topic in kinds if topic.endswith(FIXED_TRANSFORMS)}
        for name, topic, allowed_kinds in (("scan_topic", scan_topic, SCANS), ("pose_topic", pose_topic, POSES)):
            those = [each for each in sorted(kinds) if kinds[each] in allowed_kinds and each not in fixed_topics]
            if topic not in those:
                found_kind, names_text = kinds.get(topic, "not in it"), ", ".join(those) or "none"
                raise StarnavError(f"bag {path}: {name} is {topic}, {found_kind}; allowed: {names_text}")
        wanted_topics = {scan_topic, pose_topic, *fixed_topics}
        for connection, _, data in reader.messages([c for c in reader.connections if c.topic in wanted_topics]):
            yield connection.topic, reader.deserialize(data, connection.msgtype)


def _find_files(path: Path) -> list[Path]:
    """What the reader opens: the bag, or the files in the folder of one whose recording was cut off."""
    if not path.exists():
        raise StarnavError(f"bag {path}: no such file or folder; allowed: a bag of ROS 1 or ROS 2")
    if not path.is_dir() or (path / "metadata.yaml").exists():
        return [path]
    files = sorted(file for file in path.iterdir() if file.suffix in (".mcap", ".db3"))
    if not files:
        raise StarnavError(
            f"bag {path}: the folder has no metadata.yaml, and no file that ends in .mcap or .db3; allowed: a bag of "
            "ROS 2, made whole by `ros2 bag reindex` if its files are compressed, or a file of ROS 1"
        )
    return files


def _record(time: float, message: Any, X_WS: np.ndarray, path: Path) -> Record:
    """The pose and the fields of a message of an upright lidar; beams of one that is upside down turn the other way."""
    upright = float(X_WS[2, 2])
    if abs(upright) < 0.99:  # the cosine of its tilt
        raise StarnavError(
            f"bag {path}: the lidar {message.header.frame_id} is tilted by {math.degrees(math.acos(upright)):.0f} "
            "degrees; allowed: a level one, upright or upside down"
        )
    turn_side = math.copysign(1.0, upright)
    pose = np.array((X_WS[0, 3], X_WS[1, 3], math.atan2(X_WS[1, 0], X_WS[0, 0])))
    return pose, {
        "time": time,
        "angle_min": turn_side * float(message.angle_min),
        "angle_increment": turn_side * float(message.angle_increment),
        "range_min": float(message.range_min),
        "range_max": float(message.range_max),
        "ranges": np.array(message.ranges, dtype=float),
    }
