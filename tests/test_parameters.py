import dataclasses
import math
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_starnav.control.parameters import ControllerParameters
from drake_starnav.errors import StarnavError
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.parameters import (
    allowed_text,
    build,
    check_parameters,
    declared,
    parameter,
)
from drake_starnav.planning.parameters import PlannerParameters
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.schema import DriveParameters, LocalizationParameters

SHIPPED = (RobotParameters, PlannerParameters, ControllerParameters)


@dataclass(frozen=True)
class Example:
    speed: float = parameter(0.5, "how fast", unit="m/s", above=0.0, high=2.0)
    share: float = parameter(0.5, "how much", low=0.0, high=1.0)
    count: int = parameter(3, "how many", low=1)
    active: bool = parameter(True, "whether")
    kind: str = parameter("round", "which", choices=("round", "square"))
    name: str = parameter("a", "what it is called")
    offset: float = parameter(0.0, "any number", unit="m")
    counts: tuple[int, int] = parameter((1, 4), "how few and how many", low=0, high=9)
    gap: tuple[float, float] = parameter((0.5, 1.0), "how narrow and how wide", unit="m", above=0.0)


def field(name: str) -> dataclasses.Field:
    return next(f for f in dataclasses.fields(Example) if f.name == name)


@pytest.mark.parametrize("cls", SHIPPED)
def test_shipped_parameters_document_themselves_and_allow_their_defaults(cls):
    check_parameters(cls(), "defaults")
    assert build(cls, {f.name: getattr(cls(), f.name) for f in declared(cls)}, "copy") == cls()
    for f in declared(cls):
        assert f.metadata["help"] and allowed_text(f)
        if f.type is float or f.type is int:
            assert any(f.metadata.get(limit) is not None for limit in ("low", "above", "high")), f.name


@given(st.floats(allow_nan=True, allow_infinity=True))
def test_limits_are_exclusive_above_and_inclusive_high(value):
    if 0.0 < value <= 2.0:
        assert build(Example, {"speed": value}, "example").speed == value
    else:
        with pytest.raises(StarnavError, match=r"example\.speed is .*; allowed: 0 < x <= 2 m/s"):
            build(Example, {"speed": value}, "example")


@pytest.mark.parametrize(
    "mapping, message",
    [
        ({"share": -0.1}, r"example\.share is -0\.1; allowed: 0 <= x <= 1"),
        ({"count": 0}, r"example\.count is 0; allowed: 1 <= x"),
        ({"count": 2.0}, r"example\.count is 2\.0; allowed: a whole number"),
        ({"count": True}, r"example\.count is True; allowed: a whole number"),
        ({"share": "0.5"}, r"example\.share is '0\.5'; allowed: a number"),
        ({"active": 1}, r"example\.active is 1; allowed: true or false"),
        ({"kind": "oval"}, r"example\.kind is 'oval'; allowed: one of round, square"),
        ({"name": 3}, r"example\.name is 3; allowed: a text"),
        ({"counts": [5, 4]}, r"example\.counts is \[5, 4\]; allowed: \[least, most\], 0 <= x <= 9"),
        ({"counts": [5, 10]}, r"example\.counts is \[5, 10\]; allowed: \[least, most\], 0 <= x <= 9"),
        ({"counts": [5]}, r"example\.counts is \[5\]; allowed: \[least, most\], two whole numbers"),
        ({"gap": [0.5, "wide"]}, r"example\.gap is \[0\.5, 'wide'\]; allowed: \[least, most\], two numbers"),
        ({"gap": [0.0, 1.0]}, r"example\.gap is \[0\.0, 1\.0\]; allowed: \[least, most\], 0 < x m"),
        ({"gap": [float("nan"), 1.0]}, r"example\.gap is \[nan, 1\.0\]; allowed: \[least, most\], 0 < x m"),
        ({"offset": float("nan")}, r"example\.offset is nan; allowed: a finite number"),
        ({"sped": 1.0}, r"unknown key example\.sped: did you mean speed\? allowed: speed, share"),
        ([1, 2], r"example is \[1, 2\]; allowed: a mapping of speed, share"),
    ],
)
def test_bad_values_name_the_place_the_value_and_what_is_allowed(mapping, message):
    with pytest.raises(StarnavError, match=message):
        build(Example, mapping, "example")


def test_missing_keys_come_from_the_base_or_the_defaults():
    base = Example(speed=1.5, count=9)
    assert build(Example, {"share": 1}, "example", base) == dataclasses.replace(base, share=1.0)
    assert isinstance(build(Example, {"share": 1}, "example").share, float)
    assert build(Example, None, "example") == Example()
    with pytest.raises(StarnavError, match=r"example\.speed is 3"):
        build(Example, {}, "example", Example(speed=3.0))


@pytest.mark.parametrize(
    "name, value",
    [
        ("count", np.int64(0)), ("speed", np.float32(3.0)), ("speed", None), ("share", "0.25"), ("active", "no"),
        ("count", np.float64(2.0)), ("name", 3),
    ],
)  # fmt: skip
def test_values_given_in_python_are_checked_like_those_of_files(name, value):
    with pytest.raises(StarnavError, match=rf"example\.{name} is .*; allowed: "):
        check_parameters(Example(**{name: value}), "example")


def test_scalars_of_numpy_become_those_of_python():
    example = Example(speed=np.float64(1.5), share=1, count=np.int64(2), active=np.bool_(False))
    check_parameters(example, "example")
    assert example == Example(speed=1.5, share=1.0, count=2, active=False)
    assert [type(getattr(example, name)) for name in ("speed", "share", "count", "active")] == [float, float, int, bool]


def test_ranges_become_tuples_of_their_kind():
    example = build(Example, {"counts": [2, 2], "gap": [1, 2]}, "example")
    assert example == Example(counts=(2, 2), gap=(1.0, 2.0)) and hash(example)
    assert [type(end) for end in (*example.counts, *example.gap)] == [int, int, float, float]
    given = Example(counts=[np.int64(1), 3])
    check_parameters(given, "example")
    assert given == Example(counts=(1, 3))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: RobotParameters(radius=-1.0), "robot.radius is -1"),
        (lambda: RobotParameters(max_acceleration=math.nan), "robot.max_acceleration is nan"),
        (lambda: ControllerParameters(rate=-1.0), "controller.rate is -1"),
        (lambda: PlannerParameters(preferred_clearance=-0.2), "planner.preferred_clearance is -0.2"),
        (lambda: DriveParameters(delay=-1.0), "drive.delay is -1"),
        (lambda: LocalizationParameters(drift=7.0), "localization.drift is 7"),
        (lambda: LidarParameters(quantisation=2.0), "lidar.quantisation is 2"),
    ],
)
def test_parameters_are_checked_wherever_they_are_made(make, words):
    with pytest.raises(StarnavError, match=words):
        make()
