"""The ROS 2 messages that a robot's loop reads and writes: their fields, their text, and how CDR writes them."""

import struct
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

FIELDS = {
    "builtin_interfaces/Time": "int32 sec, uint32 nanosec",
    "builtin_interfaces/Duration": "int32 sec, uint32 nanosec",
    "std_msgs/Header": "Time stamp, string frame_id",
    "std_msgs/ColorRGBA": "float32 r, float32 g, float32 b, float32 a",
    "std_msgs/String": "string data",
    "std_msgs/Empty": "uint8 structure_needs_at_least_one_member",
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
FULL_NAMES = {name.partition("/")[2]: name for name in FIELDS}
NUMBERS = {"bool": "?", "uint8": "B", "int32": "i", "uint32": "I", "float32": "f", "float64": "d"}
RULE = f"\n{80 * '='}\n"


def list_fields(kind: str) -> Iterator[tuple[str, str, str, str]]:
    """Yield the type, without brackets, the brackets, their content and the name of each field of a message."""
    for field in FIELDS[kind].split(", "):
        type_text, name = field.split()
        base, bracket, count = type_text.rstrip("]").partition("[")
        yield FULL_NAMES.get(base, base), bracket, count, name


def write_definition(kind: str) -> str:
    """Return the text of a message and of those in it, as `ros2msg`."""
    message_kinds, message_texts = [kind], []
    for each in message_kinds:  # it grows meanwhile
        lines = [f"{base}{f'[{count}]' if bracket else ''} {name}" for base, bracket, count, name in list_fields(each)]
        message_texts.append("\n".join(lines if each == kind else (f"MSG: {each}", *lines)))
        message_kinds += [base for base, *_ in list_fields(each) if base in FIELDS and base not in message_kinds]
    return RULE.join(message_texts)


def encode(kind: str, values: Mapping[str, Any]) -> bytes:
    """Return a message in CDR, little endian; fields that are not given are zero or empty."""
    message_data = bytearray()
    _append(message_data, kind, values)
    return b"\0\1\0\0" + bytes(message_data)


def _append(data: bytearray, kind: str, value: Any) -> None:
    if kind in NUMBERS:
        _append_numbers(data, kind, [value or 0])
    elif kind == "string":
        encoded_text = (value or "").encode() + b"\0"
        _append_numbers(data, "uint32", [len(encoded_text)])
        data += encoded_text
    else:
        for base, bracket, count, name in list_fields(kind):
            given_value = (value or {}).get(name)
            if bracket:
                _append_array(data, base, count, () if given_value is None else given_value)
            else:
                _append(data, base, given_value)


def _append_array(data: bytearray, base: str, count: str, values: Sequence[Any]) -> None:
    if count:
        values = values if len(values) else int(count) * [0]
    else:
        _append_numbers(data, "uint32", [len(values)])
    if base in NUMBERS:
        _append_numbers(data, base, values)
    else:
        for each in values:
            _append(data, base, each)


def _append_numbers(data: bytearray, kind: str, values: Sequence[float]) -> None:
    if len(values):
        data += bytes(-len(data) % struct.calcsize(NUMBERS[kind]))
        data += np.asarray(values, f"<{NUMBERS[kind]}").tobytes()


def decode_string(message: bytes) -> str:
    """Return the text of a `std_msgs/String`; raises a `ValueError` for what is none."""
    length = int.from_bytes(message[4:8], "little")
    if message[:2] != b"\0\1" or not 0 < length == len(message) - 8:
        raise ValueError("a message of it is no std_msgs/String in CDR, as logs of earlier checkouts have none")
    return message[8:-1].decode()
