import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_starnav.control import ControllerInputs
from drake_starnav.control.free_heading import FREE_HEADING_RANGE, OFF, OPEN_WAY, STEP, find_free_heading
from drake_starnav.control.parameters import ControllerParameters
from drake_starnav.planning.guidance import Guidance
from drake_starnav.robot import RobotParameters
from drake_starnav.surroundings.region_union import RegionUnion
from drake_starnav.surroundings.surroundings import Surroundings
from drake_starnav.worlds.world import World
from tests.helpers.motions import stepped
from tests.helpers.scans import MARGINS, RADIUS, cast, distance, observe_scan, seeds
from tests.helpers.scenes import moved

ROBOT = RobotParameters()
PARAMETERS = ControllerParameters()
MARGIN = MARGINS.safety
KEPT = RADIUS + MARGIN


def star_with_one_short_hit(world: World, pose: np.ndarray, bearing: float, short: float) -> Surroundings:
    """The certified star of an exact scan, but the beam next to a bearing in W measures this much too little."""
    scan = cast(world, pose)
    beam = round((bearing - pose[2] - scan.angle_min) / scan.angle_increment) % len(scan.ranges)
    measured = dataclasses.replace(scan, ranges=scan.ranges - short * (np.arange(len(scan.ranges)) == beam))
    return observe_scan(measured, pose, RADIUS + MARGIN, 1.2)


def way_is_open(hits: np.ndarray, position: np.ndarray, angle: float) -> bool:
    """Whether the way along a bearing keeps KEPT from hits, or comes no nearer to them and leads off them."""
    way = OPEN_WAY * RADIUS
    ahead = np.linspace(0.0, way, 400)[:, None] * (math.cos(angle), math.sin(angle))
    away = np.hypot(*np.moveaxis(hits - (position + ahead)[:, None], -1, 0))
    near = away.min(axis=0) >= np.minimum(KEPT, away[0]) - 1e-9
    return bool((near & (away[-1] >= np.minimum(KEPT, away[0] + OFF * way))).all())


def free_direction(position: np.ndarray, direction: np.ndarray, hits: np.ndarray) -> np.ndarray:
    return np.array(find_free_heading(*position, *direction, hits, RADIUS, KEPT))


@settings(max_examples=200)
@given(seeds, st.floats(-math.pi, math.pi))
def test_the_nearest_open_bearing_is_taken(seed, angle):
    rng = np.random.default_rng(seed)
    away, bearing = rng.uniform(KEPT - 0.01, KEPT + 0.03, 12), rng.uniform(-math.pi, math.pi, 12)
    position = rng.uniform(-1.0, 1.0, 2)
    hits = position + away[:, None] * np.column_stack((np.cos(bearing), np.sin(bearing)))
    direction = np.array((math.cos(angle), math.sin(angle)))
    out = free_direction(position, direction, hits)
    turn = math.atan2(direction[0] * out[1] - direction[1] * out[0], float(direction @ out))
    tried = STEP * np.arange(1, int(FREE_HEADING_RANGE / STEP) + 1)
    open_turns = [
        side * t
        for t in tried
        for side in (1.0, -1.0)
        if way_is_open(hits, position, angle + side * t) and way_is_open(hits, position, angle + side * (t + STEP))
    ]
    if way_is_open(hits, position, angle) or not open_turns:
        np.testing.assert_array_equal(out, direction)
    else:
        assert np.hypot(*out) == pytest.approx(1.0)
        assert turn == pytest.approx(open_turns[0], abs=1e-9)


@pytest.mark.parametrize("short", [0.001, 0.005, 0.014])
def test_a_robot_however_far_within_the_margin_is_led_along_the_wall_and_off_it(short: float):
    wall = np.column_stack((np.linspace(-1.0, 1.0, 401), np.full(401, KEPT - short)))
    for towards in (0.0, 0.2):
        ux, uy = free_direction(np.zeros(2), np.array((math.cos(towards), math.sin(towards))), wall)
        assert uy < 0.0 and ux > 0.7


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_one_short_hit_on_one_of_two_walls_does_not_stop_the_robot_between_them(side):
    room = MARGIN + 0.005
    corridor = World("corridor", (0, 0, 0), (5, 0), bounds=(-3.0, -(RADIUS + room), 7.0, RADIUS + room))
    goal, pose, twist, places = (
        Guidance(np.array(((5.0, 0.0),)), False, RegionUnion.none()),
        np.zeros(3),
        np.zeros(2),
        [],
    )
    for _ in range(200):
        star = star_with_one_short_hit(corridor, pose, side * math.pi / 2.0, 0.008)
        twist, _ = stepped(ControllerInputs(pose, twist, goal, star), PARAMETERS, ROBOT)
        pose = moved(pose, twist, 1.0 / 50.0)
        places.append(pose[:2])
    assert places[-1][0] > 0.5
    assert distance(corridor, np.array(places)).min() >= RADIUS
