"""The robot's limits."""

from drake_starnav.robot import RobotParameters


def test_the_limits_are_floats_by_name() -> None:
    limits = RobotParameters(max_speed=1, max_yaw_rate=2.0, max_acceleration=3.0, max_yaw_acceleration=4.0).limits
    assert limits == (1.0, 2.0, 3.0, 4.0) and limits.max_yaw_rate == 2.0
    assert all(type(value) is float for value in limits)  # kernels would be compiled again for whole numbers
