"""From scan to scan: what is told of each beam."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from shapely import LineString, Point, Polygon, box

from drake_starnav.geometry.se2 import compose_poses
from drake_starnav.lidar.laser_scan import DYNAMIC, STATIC
from drake_starnav.moving.certificate import GROWTH, RADIUS, find_reachable_discs
from drake_starnav.moving.parameters import DynamicObstacleParameters
from drake_starnav.moving.tracker import TrackerState, join_tracks, track
from drake_starnav.worlds.world import World
from tests.helpers.scans import cast, cast_rolling, seeds
from tests.helpers.scenes import PERIOD, Scene, hall, straight

OBSTACLES = DynamicObstacleParameters(max_speed=1.0)


def test_all_beams_of_a_track_that_counts_move() -> None:
    scene = Scene(hall((2.0, 1.5, 0.2)), (0.3,), straight((1.5, -1.0), (0.0, 0.5)))
    known = TrackerState()
    for k in range(25):
        known = track(known, scene.scan(k * PERIOD, np.zeros(3)), np.zeros(3), OBSTACLES)
    scan = known.scan
    points = scan.points_at(scan.distances, np.ones(360, bool), np.zeros(3))
    own = np.hypot(*(points - scene.at(24 * PERIOD)[0]).T) < 0.3 + 1e-6
    assert own.any()
    np.testing.assert_array_equal(scan.motion == DYNAMIC, own)


def test_with_full_caution_what_stands_may_start_and_else_is_trusted_to_stay() -> None:
    scene = Scene(hall((1.0, 0.0, 0.3), half=2.0), (), lambda t: np.zeros((0, 2)))
    for caution in (1.0, 0.99, 0.0):
        obstacles, known = DynamicObstacleParameters(max_speed=1.0, caution=caution), TrackerState()
        for k in range(60):
            known = track(known, scene.scan(k * PERIOD, np.zeros(3)), np.zeros(3), obstacles)
        standing, occlusions = known.tracks.possible_starters, known.tracks.occlusion_discs
        assert len(known.tracks.hits) == 0
        assert (
            (len(standing) > 10 and len(occlusions) > 10) if caution == 1.0 else (len(standing) == len(occlusions) == 0)
        )
        assert np.abs(np.hypot(standing[:, 0] - 1.0, standing[:, 1]) - 0.3).max(initial=0.0) < 1e-6


def test_nothing_moves_in_the_rolling_scans_of_a_lidar_that_turns() -> None:
    world, known, pose, period = hall((1.5, 1.2, 0.2), (-1.0, 2.0, 0.15)), TrackerState(), np.zeros(3), 0.2
    for k in range(12):
        step = (0.04, 0.0, 0.15 if k % 6 < 3 else -0.15) if k else (0.0, 0.0, 0.0)  # to and fro
        before, pose = pose, np.array(compose_poses(pose, step))
        scan = cast_rolling(world, before, pose, period, time=k * period, beams=180)
        known = track(known, scan, pose, OBSTACLES)
        assert known.scan.time_increment == 0.0 or k == 0
        assert not (known.scan.motion == DYNAMIC).any() and not known.tracks.is_confirmed.any()


BODY = box(-0.4, -0.25, 0.4, 0.25)
MOVER = 0.15
"""Radius of what comes, m."""
CENTRE = ((0.0, 0.0, 0.0, 2.0 * math.pi),)
CORNERS = ((0.4, 0.25, 0.25 * math.pi, 1.5 * math.pi), (-0.4, -0.25, -0.75 * math.pi, 1.5 * math.pi))
"""Poses and views of the lidars of a robot that stands at the origin."""


def coming(rng: np.random.Generator) -> tuple[Polygon, LineString, float]:
    """A partition, the way of a disc from behind it, round one of its ends, to the robot, and when it begins, s."""
    while True:
        middle, along, half = rng.uniform(-1.6, 1.6, 2), rng.uniform(-math.pi, math.pi), rng.uniform(0.4, 0.9)
        ahead, aside = np.array((math.cos(along), math.sin(along))), np.array((-math.sin(along), math.cos(along)))
        behind = math.copysign(rng.uniform(0.19, 0.5), aside @ middle) * aside
        partition = LineString((middle - half * ahead, middle + half * ahead)).buffer(0.03, cap_style="square")
        hides = middle + rng.uniform(-half, half) * ahead + behind
        turn = middle + rng.choice((-1, 1)) * (half + rng.uniform(0.2, 0.4)) * ahead
        way = LineString((hides, turn, BODY.exterior.interpolate(rng.uniform(0.0, 2.6)).coords[0]))
        begin = -rng.uniform(0.0, 0.25)
        free = partition.distance(BODY) > 0.1 and partition.distance(way) > MOVER
        if free and way.interpolate(-begin).distance(BODY) > MOVER + 0.1:
            return partition, way, begin


@pytest.mark.parametrize(
    ("lidars", "ages"), [(CENTRE, (0.0,)), (CORNERS, (0.0, 0.0)), (CORNERS, (0.0, 0.1)), (CORNERS, (0.2, 0.0))], ids=str
)
@settings(max_examples=60, deadline=None)
@given(seed=seeds)
def test_what_comes_to_the_robot_was_reachable_whoever_saw_it(lidars: tuple, ages: tuple, seed: int) -> None:
    """Be it seen by one lidar, by both or by none: a reachable disc is at the robot no later than the obstacle."""
    rng, obstacles = np.random.default_rng(seed), DynamicObstacleParameters(max_speed=1.0, caution=1.0, max_radius=0.25)
    partition, way, begin = coming(rng)

    def at(time: float) -> np.ndarray:
        return np.array(way.interpolate(max(time - begin, 0.0)).coords)

    corners = (np.array(partition.exterior.coords)[:-1],)
    states = [TrackerState()] * len(lidars)
    for k, ((x, y, yaw, view), age) in enumerate(zip(lidars, ages, strict=True)):
        for time in -age - np.array((0.3, 0.2, 0.1, 0.0)):
            discs = [(*at(time)[0], MOVER)]
            world = World("one", (0, 0, 0), (0, 0), discs, polygons=corners, bounds=(-4, -4, 4, 4))
            pose, beams = np.array((x, y, yaw)), {"beams": 540, "angle_min": -0.5 * view, "angle_increment": view / 540}
            scan = dataclasses.replace(cast(world, pose, **beams), time=time)
            states[k] = track(states[k], scan, pose, obstacles)
        shown = np.abs(np.hypot(*(scan.points(pose) - at(-age)[0]).T) - MOVER) < 1e-3
        if shown.any() and not len(states[k].tracks.hits):
            return  # beside the end of the partition it looks like a part of it
    reachable = find_reachable_discs(join_tracks(states, obstacles), obstacles)
    comes = next(time for time in np.arange(0.0, 9.0, 0.005) if Point(at(time)[0]).distance(BODY) <= MOVER)
    away = np.array([Point(place).distance(BODY) for place in reachable[:, :2]]) - reachable[:, RADIUS]
    assert (away / reachable[:, GROWTH]).min() <= comes


@pytest.mark.parametrize("range_max", [5.0, 10.0, 30.0])
def test_where_everything_moves_nothing_is_remembered_however_far_the_lidar_sees(range_max: float) -> None:
    rng = np.random.default_rng(int(range_max))
    first, velocity = rng.uniform(-16.0, 16.0, (25, 2)), rng.uniform(0.5, 2.0, 25)[:, None]
    first, angle = first[np.hypot(*first.T) > 2.0], rng.uniform(-math.pi, math.pi, 25)
    velocity = (velocity * np.column_stack((np.cos(angle), np.sin(angle))))[: len(first)]
    known, moving = TrackerState(), DynamicObstacleParameters(max_speed=2.0)
    for k in range(60):
        time, pose = k * PERIOD, np.array((0.5 * k * PERIOD, 0.0, 0.3 * k * PERIOD))
        discs = [(*place, 0.5) for place in first + time * velocity if math.dist(place, pose[:2]) > 0.7]
        arena = World("arena", (0, 0, 0), (0, 0), cylinders=discs, polygons=(), bounds=None)
        scan = dataclasses.replace(cast(arena, pose, beams=720, range_max=range_max), time=time)
        known = track(known, scan, pose, moving)
        assert scan.hits.any()
        assert (known.scan.motion[scan.hits] != STATIC).all()
