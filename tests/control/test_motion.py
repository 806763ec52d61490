"""A rolled-out motion: its phases, its times, and that it follows the ramps."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_starnav.control.motion import LONGEST_STEP, SAMPLE_SPACING, SAMPLES, BrakingMotion, roll_out
from drake_starnav.robot import RobotParameters
from tests.helpers.motions import actuation
from tests.helpers.scans import seeds

ROBOT = RobotParameters()
SPEEDS, ACCELERATIONS = np.array(ROBOT.limits[:2]), np.array(ROBOT.limits[2:])


@settings(max_examples=60)
@given(seeds, st.sampled_from([0.02, 0.3]), st.sampled_from([0.0, 0.05, 0.4]))
def test_the_twist_is_kept_the_target_is_held_and_the_robot_brakes_until_it_stands(seed, hold, delay) -> None:
    rng = np.random.default_rng(seed)
    twist, target = rng.uniform(-SPEEDS, SPEEDS), rng.uniform(-SPEEDS, SPEEDS)
    motion = roll_out(rng.uniform(-3.0, 3.0, 3), twist, target, actuation(ROBOT, hold, delay))
    assert motion.time[motion.commanded] == pytest.approx(delay)
    assert motion.time[motion.braking] == pytest.approx(delay + hold)
    assert (motion.twist[: motion.commanded + 1] == twist).all()
    np.testing.assert_allclose(motion.twist[-1], 0.0, atol=1e-9)
    for k, reach in ((motion.commanded, target), (motion.braking, np.zeros(2))):
        late = slice(k, motion.braking + 1 if k == motion.commanded else None)
        off = np.abs(motion.twist[late] - reach)
        assert (np.diff(off, axis=0) <= 1e-12).all()  # never away from what is wanted
    change = np.abs(np.diff(motion.twist, axis=0)) - np.diff(motion.time)[:, None] * ACCELERATIONS
    assert change[: motion.braking].max() <= 1e-9
    assert np.hypot(*np.diff(motion.position, axis=0).T).max() <= SAMPLE_SPACING + 1e-9
    assert np.diff(motion.time).min() >= 0.0 and np.diff(motion.time).max() <= LONGEST_STEP + 1e-9


def test_a_long_motion_has_room() -> None:
    motion = roll_out(np.zeros(3), np.zeros(2), np.array((0.8, 0.0)), actuation(ROBOT, hold=4.0))
    assert len(motion.samples) > 2 * SAMPLES
    assert motion.position[-1, 0] == pytest.approx(0.8 * 4.0, abs=0.02)


@pytest.mark.parametrize(("twist", "grips"), [((0.8, 2.0), True), ((2.0, 5.0), False)])
def test_a_motion_in_which_the_wheels_slide_does_not_grip(twist, grips) -> None:
    robot = RobotParameters(max_speed=2.0, max_yaw_rate=5.0)
    motion = roll_out(np.zeros(3), np.array(twist), np.array(twist), actuation(robot))
    assert motion.grips == grips


def test_nothing_is_guaranteed_before_the_first_command() -> None:
    none = BrakingMotion.none()
    assert not none.certified
    assert none.path.shape == (1, 3)
    with pytest.raises(AttributeError):
        none.certified = True
