"""The ROS 2 messages that a robot's loop reads and writes, as types of Cyclone DDS."""

import dataclasses
import re
from functools import partial
from types import new_class
from typing import Any

from cyclonedds.idl import IdlStruct, types

FIELDS = {
    "builtin_interfaces/Time": "int32 sec, uint32 nanosec",
    "builtin_interfaces/Duration": "int32 sec, uint32 nanosec",
    "std_msgs/Header": "Time stamp, string frame_id",
    "std_msgs/ColorRGBA": "float32 r, float32 g, float32 b, float32 a",
    "geometry_msgs/Vector3": "float64 x, float64 y, float64 z",
    "geometry_msgs/Point": "float64 x, float64 y, float64 z",
    "geometry_msgs/Quaternion": "float64 x, float64 y, float64 z, float64 w",
    "geometry_msgs/Twist": "Vector3 linear, Vector3 angular",
    "geometry_msgs/TwistStamped": "Header header, Twist twist",
    "geometry_msgs/TwistWithCovariance": "Twist twist, float64[36] covariance",
    "geometry_msgs/Pose": "Point position, Quaternion orientation",
    "geometry_msgs/PoseStamped": "Header header, Pose pose",
    "geometry_msgs/PoseWithCovariance": "Pose pose, float64[36] covariance",
    "geometry_msgs/Transform": "Vector3 translation, Quaternion rotation",
    "geometry_msgs/TransformStamped": "Header header, string child_frame_id, Transform transform",
    "tf2_msgs/TFMessage": "TransformStamped[] transforms",
    "nav_msgs/Odometry": "Header header, string child_frame_id, PoseWithCovariance pose, TwistWithCovariance twist",
    "nav_msgs/Path": "Header header, PoseStamped[] poses",
    "sensor_msgs/LaserScan": "Header header, float32 angle_min, float32 angle_max, float32 angle_increment, "
    "float32 time_increment, float32 scan_time, float32 range_min, float32 range_max, float32[] ranges, "
    "float32[] intensities",
    "sensor_msgs/CompressedImage": "Header header, string format, uint8[] data",
    "visualization_msgs/MeshFile": "string filename, uint8[] data",
    "visualization_msgs/UVCoordinate": "float32 u, float32 v",
    "visualization_msgs/Marker": "Header header, string ns, int32 id, int32 type, int32 action, Pose pose, "
    "Vector3 scale, ColorRGBA color, Duration lifetime, bool frame_locked, Point[] points, ColorRGBA[] colors, "
    "string texture_resource, CompressedImage texture, UVCoordinate[] uv_coordinates, string text, "
    "string mesh_resource, MeshFile mesh_file, bool mesh_use_embedded_materials",
    "visualization_msgs/MarkerArray": "Marker[] markers",
}
"""Types and names in the order of the definitions, which a message holds to the byte."""
PLAIN: dict[str, tuple[Any, Any]] = {"string": (str, ""), "bool": (bool, False)}
PLAIN |= {name: (getattr(types, name), 0) for name in ("uint8", "int32", "uint32")}
PLAIN |= {name: (getattr(types, name), 0.0) for name in ("float32", "float64")}


def dds_name(kind: str) -> str:
    """The name that DDS has for a type."""
    package, _, name = kind.partition("/")
    return f"{package}::msg::dds_::{name}_"


def ros_name(name: str) -> str:
    """The type that DDS has a name for; the name itself if it is no message of ROS."""
    found = re.fullmatch(r"(\w+)::msg::dds_::(\w+)_", name)
    return "/".join(found.groups()) if found else name


class Messages:
    """The classes of FIELDS as attributes; each field has a value from the start: zero, empty, or 1 of a `w`."""

    def __init__(self) -> None:
        for kind, definition in FIELDS.items():
            fields = [self._field(*each.split()) for each in definition.split(", ")]
            name = kind.partition("/")[2]
            made = new_class(name, (IdlStruct,), {"typename": dds_name(kind)}, partial(_declare, fields))
            setattr(self, name, dataclasses.dataclass(made))

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(f"no message {name}; allowed: {', '.join(FIELDS)}")

    def _field(self, kind: str, name: str) -> tuple[str, Any, Any]:
        """Name, type and initial value of a field."""
        base, _, count = kind.rstrip("]").partition("[")
        each, value = PLAIN[base] if base in PLAIN else (getattr(self, base), None)
        if kind != base:
            made = types.array[each, int(count)] if count else types.sequence[each]
            return name, made, dataclasses.field(default_factory=lambda: int(count or 0) * [value])
        return name, each, dataclasses.field(default_factory=each) if value is None else 1.0 if name == "w" else value


def _declare(fields: list[tuple[str, Any, Any]], space: dict[str, Any]) -> None:
    """The body of a class with these fields."""
    for name, kind, value in fields:
        space["__annotations__"][name] = kind
        space[name] = value


MESSAGES = Messages()
