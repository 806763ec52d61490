"""Messages have the bytes that ROS 2 gives them, by rosbags' serialisation."""

import numpy as np
import pytest

pytest.importorskip("cyclonedds")
pytest.importorskip("rosbags")
from rosbags.typesys import Stores, get_typestore

from drake_starnav.runtime.ros2_cyclone import FIELDS, MESSAGES, PLAIN

OURS, THEIRS = MESSAGES, get_typestore(Stores.ROS2_JAZZY)
LENGTHS = {"ranges": 361, "intensities": 0, "data": 5, "covariance": 36}


def filled(kind: str, rng: np.random.Generator):
    """A message of ours and one of theirs, with the same values in all fields."""
    ours, theirs = {}, {}
    for each in FIELDS[kind].split(", "):
        base, name = each.split()
        base, _, many = base.partition("[")
        full = next((key for key in FIELDS if key.endswith(f"/{base}")), None)
        values = []
        for _ in range(LENGTHS.get(name, 2) if many else 1):
            if full:
                values.append(filled(full, rng))
            elif base == "string":
                values.append(2 * ("".join(map(chr, rng.integers(97, 123, rng.integers(0, 9)))),))
            elif base == "bool":
                values.append(2 * (bool(rng.integers(2)),))
            elif base.startswith("float"):
                values.append(2 * (float(np.float32(rng.standard_normal())),))
            else:
                values.append(2 * (int(rng.integers(0, 200)),))
        ours[name], theirs[name] = ([v[k] for v in values] if many else values[0][k] for k in (0, 1))
        if many and base in ("float32", "float64", "uint8"):
            theirs[name] = np.array(theirs[name], base)
    name = kind.replace("/", "/msg/")
    return getattr(OURS, kind.partition("/")[2])(**ours), THEIRS.types[name](**theirs)


@pytest.mark.parametrize("kind", FIELDS)
def test_bytes_are_those_of_ros(kind: str) -> None:
    ours, theirs = filled(kind, np.random.default_rng(0))
    name = kind.replace("/", "/msg/")
    data = bytes(THEIRS.serialize_cdr(theirs, name))
    assert bytes(ours.serialize()) == data.ljust(len(bytes(ours.serialize())), b"\0")
    assert type(ours).deserialize(data) == ours


def test_what_is_not_given_is_zero_empty_or_no_turn() -> None:
    assert OURS.Quaternion() == OURS.Quaternion(x=0.0, y=0.0, z=0.0, w=1.0)
    assert OURS.Path().poses == [] and OURS.Odometry().pose.covariance == [0.0] * 36
    with pytest.raises(AttributeError, match="no message PointCloud2; allowed: builtin_interfaces/Time"):
        _ = OURS.PointCloud2
    assert {"string", "bool", "float32"} <= set(PLAIN)
