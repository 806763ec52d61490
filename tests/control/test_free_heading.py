import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_starnav.control import ControllerInputs
from drake_starnav.control.free_heading import FREE_HEADING_RANGE, OPEN_WAY, SAMPLES, STEP, free_heading
from drake_starnav.control.parameters import ControllerParameters
from drake_starnav.planning.guidance import Guidance
from drake_starnav.robot import RobotParameters
from drake_starnav.surroundings.region_union import RegionUnion
from drake_starnav.surroundings.safe_region import CertifiedRegion, ScanMemory, certified_region
from drake_starnav.worlds.world import World
from tests.helpers.motions import stepped
from tests.helpers.scans import MARGINS, RADIUS, cast, distance, seeds

ROBOT = RobotParameters()
PARAMETERS = ControllerParameters()
MARGIN = MARGINS.safety


def star_with_one_short_hit(world: World, pose: np.ndarray, bearing: float, short: float) -> CertifiedRegion:
    """The certified region of an exact scan, but the beam next to a bearing in W measures this much too little."""
    scan = cast(world, pose)
    beam = round((bearing - pose[2] - scan.angle_min) / scan.angle_increment) % len(scan.ranges)
    measured = dataclasses.replace(scan, ranges=scan.ranges - short * (np.arange(len(scan.ranges)) == beam))
    return certified_region(ScanMemory(), measured, scan.distances, pose, RADIUS + MARGIN, 1.2, (2.0, 1))[0]


def way_is_open(star: CertifiedRegion, position: np.ndarray, angle: float) -> bool:
    """Whether the star contains the way along a bearing, by the smaller of the samples beside each place of it."""
    samples = len(star.values)
    for share in np.arange(1, SAMPLES + 1) / SAMPLES:
        offset = position + share * OPEN_WAY * RADIUS * np.array((math.cos(angle), math.sin(angle))) - star.center
        place = (math.atan2(offset[1], offset[0]) - star.bearing_0) / (2.0 * math.pi / samples)
        beside = [int(np.floor(place)) % samples, int(np.floor(place) + 1) % samples]
        if np.hypot(*offset) > star.values[beside].min():
            return False
    return True


def free_direction(position: np.ndarray, direction: np.ndarray, star: CertifiedRegion) -> np.ndarray:
    return np.array(free_heading(*position, *direction, star.alone[:3], RADIUS))


@settings(max_examples=200)
@given(seeds, st.floats(-math.pi, math.pi))
def test_the_nearest_open_bearing_is_taken(seed, angle):
    rng = np.random.default_rng(seed)
    values = np.where(np.repeat(rng.random(12) < 0.6, 30), 0.0, rng.uniform(0.0, 0.1, 360))
    star = CertifiedRegion(rng.uniform(-1.0, 1.0, 2), rng.uniform(-3.0, 3.0), values, np.zeros((0, 2)))
    position = star.center + rng.uniform(-0.005, 0.005, 2)
    direction = np.array((math.cos(angle), math.sin(angle)))
    out = free_direction(position, direction, star)
    turn = math.atan2(direction[0] * out[1] - direction[1] * out[0], float(direction @ out))
    tried = STEP * np.arange(1, int(FREE_HEADING_RANGE / STEP) + 1)
    open_turns = [
        side * t
        for t in tried
        for side in (1.0, -1.0)
        if way_is_open(star, position, angle + side * t) and way_is_open(star, position, angle + side * (t + STEP))
    ]
    if way_is_open(star, position, angle) or not open_turns:
        np.testing.assert_array_equal(out, direction)
    else:
        assert np.hypot(*out) == pytest.approx(1.0)
        assert turn == pytest.approx(open_turns[0], abs=1e-9)


def test_where_nothing_is_seen_nothing_is_open():
    direction = np.array((0.6, 0.8))
    np.testing.assert_array_equal(free_direction(np.ones(2), direction, CertifiedRegion.none()), direction)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_one_short_hit_on_one_of_two_walls_does_not_stop_the_robot_between_them(side):
    room = MARGIN + 0.005
    walls = [(-2.0, -(RADIUS + room), 6.0, -(RADIUS + room + 0.2)), (-2.0, RADIUS + room, 6.0, RADIUS + room + 0.2)]
    corridor = World(
        "corridor",
        (0.0, 0.0, 0.0),
        (5.0, 0.0),
        polygons=[np.array(((a, b), (c, b), (c, d), (a, d))) for a, b, c, d in walls],
        bounds=(-3.0, -2.0, 7.0, 2.0),
    )
    goal = Guidance(np.array(((5.0, 0.0),)), False, RegionUnion.none())

    def driven() -> np.ndarray:
        pose, twist = np.zeros(3), np.zeros(2)
        places = [pose[:2]]
        for _ in range(200):
            star = star_with_one_short_hit(corridor, pose, side * math.pi / 2.0, 0.008)
            twist, _ = stepped(ControllerInputs(pose, twist, goal, star), PARAMETERS, ROBOT)
            pose = pose + (twist[0] * math.cos(pose[2]) / 50.0, twist[0] * math.sin(pose[2]) / 50.0, twist[1] / 50.0)
            places.append(pose[:2])
        return np.array(places)

    goes = driven()
    assert goes[-1, 0] > 0.5
    assert distance(corridor, goes).min() >= RADIUS
