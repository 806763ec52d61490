"""The robot's limits."""

import pytest

from drake_starnav.robot import RobotParameters


def test_the_speed_limit_grows_with_the_clearance_up_to_the_largest_speed() -> None:
    robot = RobotParameters(max_speed=2.0, close_speed=0.8, speed_per_clearance=4.0)
    assert [robot.speed_limit(clearance) for clearance in (-0.1, 0.0, 0.1, 0.3, 9.0)] == pytest.approx(
        [0.8, 0.8, 1.2, 2.0, 2.0]
    )


def test_without_a_law_clearance_does_not_limit_the_speed() -> None:
    assert RobotParameters(max_speed=2.0, close_speed=0.1).speed_limit(0.0) == 2.0


def test_the_limits_are_floats_by_name() -> None:
    limits = RobotParameters(max_speed=1, max_yaw_rate=2.0, max_acceleration=3.0, max_yaw_acceleration=4.0).limits
    assert limits == (1.0, 2.0, 3.0, 4.0) and limits.max_yaw_rate == 2.0
    assert all(type(value) is float for value in limits)  # kernels would be compiled again for whole numbers
