"""The robot's limits."""

import dataclasses
import math

import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.robot import RobotParameters


@pytest.mark.parametrize("base", ["differential", "omnidirectional", "car"])
def test_a_robot_brakes_as_hard_as_it_speeds_up_unless_it_is_declared(base: str) -> None:
    robot = RobotParameters(base=base, max_acceleration=0.7)
    assert robot.limits.max_deceleration == 0.7
    assert dataclasses.replace(robot, max_acceleration=0.9).limits.max_deceleration == 0.9
    assert dataclasses.replace(robot, max_deceleration=2).limits[2:4] == (0.7, 2.0)


SQUARE = [[0.2, 0.2], [-0.2, 0.2], [-0.2, -0.2], [0.2, -0.2]]


def test_a_footprint_gives_the_radius_and_stays_when_something_else_changes() -> None:
    robot = RobotParameters(footprint=SQUARE)
    assert robot.radius == pytest.approx(0.2 * math.sqrt(2.0))
    assert not robot.shape.is_disc
    assert dataclasses.replace(robot, max_speed=0.5).shape == robot.shape
    assert RobotParameters(radius=0.3).shape.is_disc


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ({"footprint": SQUARE, "radius": 0.3}, "beside robot.footprint"),
        ({"footprint": [[0.0, 0.0], [1.0, 0.0]]}, "robot.footprint"),
        ({"footprint": [1.0, 2.0, 3.0]}, "robot.footprint"),
        ({"footprint": [[320, 250], [-320, 250], [-320, -250], [320, -250]]}, r"reaches 406\.\d+ m .* in metres"),
        ({"footprint": ["a", "b", "c"]}, "robot.footprint"),
        ({"footprint": [[0.0, 0.0], [1.0, 0.0], [0.1, 0.1], [0.0, 1.0]]}, "not convex"),
        ({"base": "legged"}, "robot.base"),
    ],
)
def test_what_is_no_robot_is_refused(given: dict, reason: str) -> None:
    with pytest.raises(StarnavError, match=reason):
        RobotParameters(**given)


def test_a_car_is_limited_by_its_least_radius_and_its_turning_rate() -> None:
    tight, fast = RobotParameters(base="car", least_radius=0.5), RobotParameters(base="car", max_speed=8.0)
    assert tight.limits.max_yaw_rate == pytest.approx(2.0) and tight.limits.steers == 1.0
    assert fast.limits.max_yaw_rate * fast.max_speed == pytest.approx(fast.max_yaw_rate)
    assert not tight.shape.is_disc and tight.shape.radius == pytest.approx(0.25, rel=0.01)


@pytest.mark.parametrize("base", ["differential", "omnidirectional", "car"])
def test_a_base_that_cannot_turn_on_the_spot_is_driven_with_a_polygon(base: str) -> None:
    robot = RobotParameters(base=base)
    assert robot.body(robot.shape) is robot.shape
    assert robot.body(RobotParameters(radius=0.3).shape).is_disc == (base != "car")
