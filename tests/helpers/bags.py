"""ROS 2 bags of a few messages, as drivers write them."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

Message = tuple[str, float, Any]
"""Topic, time of recording, s, and message."""


class Bag:
    """Messages of the usual types; `write` makes a bag of them. Stamps are by `ahead` later than the recording, s."""

    def __init__(self) -> None:
        pytest.importorskip("rosbags")
        from rosbags.typesys import Stores, get_typestore

        self.store = get_typestore(Stores.ROS2_HUMBLE)
        self.messages: list[Message] = []
        self.ahead = 0.0

    def write(self, path: Path) -> Path:
        from rosbags.rosbag2 import Writer

        with Writer(path, version=9) as writer:
            topics = dict.fromkeys((topic, message.__msgtype__) for topic, _, message in self.messages)
            to = {key: writer.add_connection(*key, typestore=self.store) for key in topics}
            for topic, time, message in self.messages:
                kind = message.__msgtype__
                writer.write(to[topic, kind], round(1e9 * time), self.store.serialize_cdr(message, kind))
        return path

    def scan(
        self, time: float, ranges: Sequence[float] | np.ndarray, *, topic: str = "/scan", frame: str = "laser", **values
    ) -> None:
        """Add a scan; its numbers are rounded as in a message."""
        ranges = np.asarray(ranges, np.float32)
        given = {"angle_min": -1.0, "angle_increment": 0.5, "range_min": 0.1, "range_max": 8.0, **values}
        numbers = {name: float(np.float32(value)) for name, value in given.items()}
        angle_max = numbers["angle_min"] + numbers["angle_increment"] * (len(ranges) - 1)
        self._add(
            topic, time, "sensor_msgs/msg/LaserScan", header=self._header(time, frame), **numbers, angle_max=angle_max,
            time_increment=0.0, scan_time=0.1, ranges=ranges, intensities=np.zeros(0, np.float32),
        )  # fmt: skip

    def odometry(self, time: float, x: float, yaw: float, *, topic: str = "/odom", child: str = "base_link") -> None:
        """Add the robot's pose at (x, 0), m, with a yaw, rad."""
        twist = self._new("geometry_msgs/msg/Twist", linear=self._vector(0.0), angular=self._vector(0.0))
        self._add(
            topic, time, "nav_msgs/msg/Odometry",
            header=self._header(time, "odom"), child_frame_id=child,
            pose=self._new("geometry_msgs/msg/PoseWithCovariance", pose=self._pose(x, yaw), covariance=np.zeros(36)),
            twist=self._new("geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=np.zeros(36)),
        )  # fmt: skip

    def pose(self, time: float, x: float, yaw: float, *, topic: str) -> None:
        """Add a pose without the name of its frame."""
        header = self._header(time, "map")
        self._add(topic, time, "geometry_msgs/msg/PoseStamped", header=header, pose=self._pose(x, yaw))

    def transform(
        self,
        time: float,
        frames: tuple[str, str],
        place: tuple[float, float] = (0.0, 0.0),
        yaw: float = 0.0,
        *,
        topic: str = "/tf",
        upside_down: bool = False,
    ) -> None:
        """Add the pose of a frame in its parent: names of parent and child, (x, y), m, and yaw, rad."""
        moved = self._new(
            "geometry_msgs/msg/TransformStamped",
            header=self._header(time, frames[0]),
            child_frame_id=frames[1],
            transform=self._new(
                "geometry_msgs/msg/Transform",
                translation=self._vector(*place),
                rotation=self._quaternion(yaw, upside_down),
            ),
        )
        self._add(topic, time, "tf2_msgs/msg/TFMessage", transforms=[moved])

    def _add(self, topic: str, time: float, kind: str, **fields: Any) -> None:
        self.messages.append((topic, time, self._new(kind, **fields)))

    def _new(self, kind: str, **fields: Any) -> Any:
        return self.store.types[kind](**fields)

    def _header(self, time: float, frame: str) -> Any:
        time += self.ahead
        second = math.floor(time)
        stamp = self._new("builtin_interfaces/msg/Time", sec=second, nanosec=round(1e9 * (time - second)))
        return self._new("std_msgs/msg/Header", stamp=stamp, frame_id=frame)

    def _vector(self, x: float, y: float = 0.0) -> Any:
        return self._new("geometry_msgs/msg/Vector3", x=x, y=y, z=0.0)

    def _quaternion(self, yaw: float, upside_down: bool = False) -> Any:
        sine, cosine = math.sin(0.5 * yaw), math.cos(0.5 * yaw)
        if upside_down:  # first turned over about x
            return self._new("geometry_msgs/msg/Quaternion", x=cosine, y=sine, z=0.0, w=0.0)
        return self._new("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=sine, w=cosine)

    def _pose(self, x: float, yaw: float) -> Any:
        point = self._new("geometry_msgs/msg/Point", x=x, y=0.0, z=0.0)
        return self._new("geometry_msgs/msg/Pose", position=point, orientation=self._quaternion(yaw))
