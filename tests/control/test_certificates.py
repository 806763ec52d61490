"""Both certificates: what one of them refuses is refused."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_starnav.control import ControllerParameters
from drake_starnav.control.certificates import accepted, constraints_of
from drake_starnav.control.moving_certificate import MOVING_MARGIN, Threats, stays_clear
from drake_starnav.control.point_certificate import (
    ESCAPE_CLEARANCE,
    KnownHits,
    clearance_at,
    keeps_clear,
    needed_distances,
)
from drake_starnav.regions.erosion import smoothed_distances
from drake_starnav.regions.safe_region import SafetyStar, ScanMemory, safety_star
from drake_starnav.robot import RobotParameters
from drake_starnav.tracking.parameters import DynamicObstacleParameters
from tests.helpers.motions import certified
from tests.helpers.scans import cast, seeds
from tests.helpers.scenes import hall

ROBOT = RobotParameters()
LIMITS = ROBOT.limits
OBSTACLES = DynamicObstacleParameters(max_speed=0.8)
NOTHING, AHEAD = np.zeros((0, 6)), np.array([(0.7, 0.0, 0.0, 0.0, 0.8, 0.0)])


def accepts(star: SafetyStar, want: tuple[float, float], rows: np.ndarray = NOTHING, v: float = 0.0, **changes) -> bool:
    constraints = constraints_of(star, ControllerParameters(**changes), ROBOT)
    return accepted(0.0, 0.0, 0.0, v, 0.0, *want, LIMITS, constraints, rows, 0.0)


def seen(wall: float) -> SafetyStar:
    """What is certified in a hall whose column's face is `wall` (m) ahead."""
    scan, pose = cast(hall((wall + 0.2, 0.0, 0.2))), np.zeros(3)
    return safety_star(ScanMemory(), scan, smoothed_distances(scan), pose, ROBOT.radius + 0.01, 1.2, (2.0, 1))[0]


def test_either_certificate_may_refuse() -> None:
    assert accepts(seen(2.0), (0.8, 0.0), v=0.7)
    assert not accepts(seen(0.5), (0.8, 0.0), v=0.7)  # what stays
    assert not accepts(seen(2.0), (0.8, 0.0), AHEAD, v=0.7)  # what moves
    assert accepts(seen(2.0), (-0.3, 0.0), AHEAD)


def test_without_a_scan_nothing_is_accepted() -> None:
    assert not accepts(SafetyStar.none(), (0.5, 0.0))


@settings(max_examples=200, deadline=None)
@given(seeds, st.sampled_from([0.0, 0.03]), st.sampled_from([0.0, 0.05]))
def test_both_certificates_are_asked_for_all_that_is_declared(seed: int, margin: float, delay: float) -> None:
    rng = np.random.default_rng(seed)
    controller = ControllerParameters(safety_margin=margin, delay=delay, rate=10.0)
    hits, gaps = rng.uniform(-1.2, 1.2, (8, 2)), rng.uniform(0.0, 0.1, 8)
    hits = hits[np.hypot(*hits.T) > 0.3]
    star = SafetyStar(np.zeros(2), 0.0, np.full(8, 0.5), hits, hits, gaps[: len(hits)], seen=True, reach=0.8)
    rows = np.array([(*rng.uniform(-2.0, 2.0, 2), 0.0, 0.0, 0.5, 0.1)])
    pose, twist = rng.uniform(-0.2, 0.2, 3), rng.uniform((0.0, -2.0), (0.8, 2.0))
    desired, age = rng.uniform((-0.3, -2.0), (0.8, 2.0)), rng.uniform(0.0, 0.3)
    known = KnownHits(hits, needed_distances(star.half_gaps, ROBOT.radius), np.zeros(2), 0.8 - ROBOT.radius)
    enough = min(margin, clearance_at(*pose[:2], hits, known.needed))
    stands = keeps_clear(*pose, *twist, *desired, 0.1, delay, LIMITS, known, max(enough, ESCAPE_CLEARANCE))
    stands = stands or certified(pose, twist, desired, 0.1, LIMITS, star, delay)
    moves = stays_clear(pose, twist, desired, 0.1, LIMITS, Threats(rows, ROBOT.radius + MOVING_MARGIN, age), delay)
    constraints = constraints_of(star, controller, ROBOT)
    assert accepted(*pose, *twist, *desired, LIMITS, constraints, rows, age) == (stands and moves)


def beside(clearance: float) -> SafetyStar:
    """A hit to the left of the robot, whose neighbour on the surface is 0.1 m away; known up to 2 m."""
    hits = np.array([(0.0, ROBOT.radius + clearance)])
    return SafetyStar(np.zeros(2), 0.0, np.zeros(8), hits, hits, np.array([0.05]), seen=True, reach=2.0)


def test_the_standard_has_every_margin() -> None:
    constraints = constraints_of(beside(0.1), ControllerParameters(), ROBOT)
    assert constraints.distance == pytest.approx(ROBOT.radius + MOVING_MARGIN)
    assert constraints.hits.room == pytest.approx(2.0 - ROBOT.radius)
    assert constraints.hits.needed == pytest.approx([math.hypot(ROBOT.radius, 0.05)])


@pytest.mark.parametrize(("clearance", "passes"), [(0.0025, True), (0.0015, False)])
def test_without_a_margin_two_millimetres_are_kept(clearance: float, passes: bool) -> None:
    star = beside(math.hypot(ROBOT.radius, 0.05) - ROBOT.radius + clearance)
    assert accepts(star, (0.3, 0.0), safety_margin=0.0) == passes


def test_outside_of_the_star_only_the_way_away_from_the_wall_is_accepted() -> None:
    close = seen(ROBOT.radius + 0.005)
    assert not accepts(close, (0.3, 0.0))
    assert accepts(close, (-0.3, 0.0))
