"""The shield: a free twist passes, one towards a wall is slowed down, and nothing unseen is driven into."""

import numpy as np
import pytest

from drake_starnav.control.shield import ramped_twist
from drake_starnav.regions.safe_region import CertifiedRegion
from drake_starnav.robot import RobotParameters
from tests.helpers.motions import PERIOD, actuation, starred_twist

ROBOT = RobotParameters()
HITS = np.column_stack((np.full(81, 1.0), np.linspace(-2.0, 2.0, 81)))


def driven(desired, star: CertifiedRegion, periods: int = 200) -> tuple[np.ndarray, list[bool]]:
    """Where a perfect robot gets in so many periods, and which commands were certified."""
    pose, twist, certified = np.zeros(3), np.zeros(2), []
    for _ in range(periods):
        *target, accepted = starred_twist(pose, twist, np.array(desired), PERIOD, ROBOT.limits, star)
        certified.append(accepted)
        after = np.array(ramped_twist(twist, target, actuation(ROBOT)))
        v, omega = 0.5 * (twist + after)
        middle = pose[2] + 0.5 * omega * PERIOD
        pose = pose + PERIOD * np.array((v * np.cos(middle), v * np.sin(middle), omega))
        twist = after
    return pose, certified


def wall() -> CertifiedRegion:
    """A wall at x = 1 m, and free space up to 0.7 m for the robot's centre."""
    bearings = 2.0 * np.pi * np.arange(720) / 720
    values = np.where(np.cos(bearings) > 0.0, np.minimum(0.7 / np.maximum(np.cos(bearings), 1e-9), 5.0), 5.0)
    return CertifiedRegion(np.zeros(2), 0.0, values, HITS, HITS, np.full(81, 0.025), seen=True, reach=5.0)


def test_it_stops_before_a_wall_that_the_twist_leads_to() -> None:
    pose, certified = driven((0.8, 0.0), wall())
    assert 0.6 < pose[0] < 0.75
    assert certified[0]


def test_a_free_twist_passes_within_the_limits() -> None:
    pose, certified = driven((-9.0, 0.0), wall(), periods=100)
    assert all(certified)
    assert pose[0] == pytest.approx(-(0.8 * 2.0 - 0.5 * 0.8**2), abs=0.02)


def test_nothing_seen_is_nothing_driven() -> None:
    pose, _ = driven((0.8, 0.0), CertifiedRegion.none())
    assert pose == pytest.approx(np.zeros(3))
