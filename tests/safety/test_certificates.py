"""The standard certificates: what one of them refuses is refused, and others may be added."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_starnav.moving.certificate import MOVING_MARGIN, MovingCertificate, make_certificates
from drake_starnav.moving.kalman_tracks import Tracks
from drake_starnav.moving.parameters import DynamicObstacleParameters
from drake_starnav.moving.prediction import add_radius
from drake_starnav.moving.tracker import TrackedObstacles
from drake_starnav.robot import RobotParameters
from drake_starnav.robot.motion import Motion, roll_out
from drake_starnav.safety.certificates import all_accept
from drake_starnav.safety.clear import ClearanceCertificate
from drake_starnav.safety.shield import find_certified_twist
from drake_starnav.surroundings.surroundings import Surroundings
from drake_starnav.surroundings.view_history import Odometer, ViewHistory
from drake_starnav.utils.snapshot import replace_fields
from tests.helpers.motions import actuation, only_star
from tests.helpers.scans import seeds, view_of_hits

ROBOT = RobotParameters()
OBSTACLES = DynamicObstacleParameters(max_speed=0.8)


def of_hits(hits: np.ndarray, values: np.ndarray, reach: float) -> Surroundings:
    """Surroundings of earlier hits (n, 2), with a star by its boundary at M bearings, known up to `reach`; m."""
    views = ViewHistory.of_one_time((view_of_hits(hits, reach=reach),), ((0.0, 0.0, 0.0),), 0.0, Odometer())
    return replace_fields(only_star(values), current_views=views)


@settings(max_examples=200, deadline=None)
@given(seeds, st.sampled_from([0.0, 0.03]), st.sampled_from([0.0, 0.05]))
def test_all_certificates_are_asked_for_all_that_is_declared(seed: int, margin: float, delay: float) -> None:
    rng = np.random.default_rng(seed)
    hits = rng.uniform(-1.2, 1.2, (8, 2))
    star = of_hits(hits[np.hypot(*hits.T) > 0.3], np.full(8, 0.5), reach=0.8)
    tracks = Tracks(time=0.0, hits=add_radius(rng.uniform(-2.0, 2.0, (1, 2)), 0.0), hit_track=np.array([-1]))
    tracked = TrackedObstacles(tracks, rng.uniform(0.0, 0.3), OBSTACLES)
    pose, twist = rng.uniform(-0.2, 0.2, 3), rng.uniform((0.0, -2.0), (0.8, 2.0))
    commands = actuation(ROBOT, hold=0.1, delay=delay)
    motion = roll_out(pose, twist, rng.uniform((-0.3, -2.0), (0.8, 2.0)), commands)
    clear = ClearanceCertificate(star, margin, ROBOT.shape)
    near_by = MovingCertificate.near(tracked, pose[:2], commands)
    assert near_by.distance == pytest.approx(MOVING_MARGIN * 0.25)
    asked = make_certificates(star, margin, commands, pose[:2], tracked)
    assert all_accept(motion, asked) == (clear.accepts(motion) and near_by.accepts(motion))
    assert all_accept(motion, asked[:1]) == clear.accepts(motion)


@pytest.mark.parametrize(("twist", "grips"), [((0.8, 2.0), True), ((2.0, 5.0), False)])
def test_a_motion_in_which_the_wheels_slide_is_refused_whatever_is_asked(twist: tuple[float, float], grips: bool):
    commands = actuation(RobotParameters(max_speed=2.0, max_yaw_rate=5.0))
    driven = roll_out(np.zeros(3), np.array(twist), np.array(twist), commands)
    assert all_accept(driven, ()) == grips


class Slow:
    """Accepts what is slower than a limit, and remembers what it was asked."""

    def __init__(self, limit: float) -> None:
        self.limit, self.asked = limit, 0

    def accepts(self, motion: Motion) -> bool:
        self.asked += 1
        return bool(np.abs(motion.twist[:, 0]).max() < self.limit)


def test_the_first_proposal_that_all_accept_is_taken_and_later_ones_are_not_asked_about() -> None:
    slow, pose, still, desired = Slow(0.5), np.zeros(3), np.zeros(2), np.array((0.8, 0.0))
    twist, certified = find_certified_twist(pose, still, desired, (slow,), actuation(ROBOT, hold=2.0))
    assert certified and twist == pytest.approx((0.48, 0.0)) and slow.asked == 3
    assert not find_certified_twist(pose, still, desired, (slow, Slow(0.0)), actuation(ROBOT, hold=2.0))[1]


@pytest.mark.parametrize(("clearance", "passes"), [(0.0025, True), (0.0015, False)])
def test_without_a_margin_two_millimetres_are_kept(clearance: float, passes: bool) -> None:
    beside = of_hits(np.array([(0.0, ROBOT.radius + clearance)]), np.zeros(8), reach=2.0)
    driven = roll_out(np.zeros(3), np.zeros(2), np.array((0.3, 0.0)), actuation(ROBOT))
    assert ClearanceCertificate(beside, 0.0, ROBOT.shape).accepts(driven) == passes
