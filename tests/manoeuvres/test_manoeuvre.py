"""Manoeuvres keep their distance, get through, out of dead ends, and end when they do not work."""

import math

import numpy as np
import pytest
import shapely

from drake_starnav.geometry.footprint import Footprint, find_covered_area, footprint
from drake_starnav.manoeuvres.manoeuvre import (
    STUCK_TIME,
    TRIES,
    count_reached,
    find_manoeuvre,
    step_docking,
    step_manoeuvre,
)
from drake_starnav.planning.state import ManoeuvreContext, ManoeuvreState
from drake_starnav.robot import BASES, Base, RobotParameters
from drake_starnav.robot.limits import wrap_angle
from drake_starnav.worlds.world import World
from tests.helpers.scans import cast, observe_scan

BASE = BASES["differential"]
SHAPE = footprint(((0.254, -0.215), (0.254, 0.215), (-0.254, 0.215), (-0.254, -0.215)))
MARGIN, PATIENCE = 0.0145, 4.0
LIMITS = RobotParameters().limits


def body(world: World, pose: np.ndarray, shape: Footprint = SHAPE, base: Base = BASE) -> ManoeuvreContext:
    surroundings = observe_scan(cast(world, pose, beams=720), pose, shape.cover_radius + MARGIN, 2.0, shape=shape)
    return ManoeuvreContext(shape, surroundings, MARGIN, base.motion_primitives(shape.radius, LIMITS), LIMITS, base)


def boxes(*sides: tuple[float, float, float, float]) -> World:
    corners = tuple(np.array(((a, b), (c, b), (c, d), (a, d))) for a, b, c, d in sides)
    return World("boxes", (0, 0, 0), (0, 0), polygons=corners, bounds=(-3.0, -3.0, 3.0, 3.0))


DOOR = boxes((0.5, 0.27, 0.6, 3.0), (0.5, -3.0, 0.6, -0.27))
SHAPES = {
    "rectangle": footprint(((0.4, -0.25), (0.4, 0.25), (-0.4, 0.25), (-0.4, -0.25))),
    "T": footprint(
        (((-0.35, -0.15), (0.2, -0.15), (0.2, 0.15), (-0.35, 0.15)), ((0.15, -0.4), (0.3, 0.0), (0.15, 0.4)))
    ),
    "L": footprint(
        (((-0.3, -0.25), (0.3, -0.25), (0.3, 0.25), (-0.3, 0.25)), ((-0.3, 0.2), (-0.1, 0.2), (-0.3, 0.45)))
    ),
}
DEAD_END = boxes((-0.6, 0.28, 0.5, 0.4), (-0.6, -0.4, 0.5, -0.28), (0.4, -0.4, 0.5, 0.4))


def swept_clearance(world: World, start: np.ndarray, poses: np.ndarray) -> float:
    """Least distance to the obstacles of the footprint on its way over the poses of a manoeuvre."""
    solid, least, before = shapely.union_all([shapely.Polygon(p) for p in world.polygons]), math.inf, start
    for x, y, yaw, gear in poses:
        count = 1 + int(math.hypot(x - before[0], y - before[1]) / 0.01 + abs(yaw - before[2]) / 0.02)
        turn, way = yaw - before[2], gear * math.hypot(x - before[0], y - before[1])
        pose = np.array(before[:3], dtype=float)
        arc = way if abs(turn) < 1e-9 else way * 0.5 * turn / math.sin(0.5 * turn) if gear else 0.0
        for _ in range(count):
            middle = pose[2] + 0.5 * turn / count
            pose = pose + np.array((math.cos(middle) * arc / count, math.sin(middle) * arc / count, turn / count))
            least = min(least, float(shapely.distance(find_covered_area(SHAPE, pose), solid)))
        before = np.array((x, y, yaw))
    return least


@pytest.mark.parametrize(
    ("world", "start", "path"),
    [
        (DOOR, (0.0, 0.05, 0.6), [(1.6, 0.0)]),
        (DOOR, (0.0, -0.4, -1.2), [(0.4, 0.0), (1.6, 0.0)]),
        (DEAD_END, (0.05, 0.0, 0.0), [(-1.0, 0.0)]),
    ],
)
def test_a_manoeuvre_keeps_its_distance_and_leads_along_the_path(world, start, path):
    start, path = np.array(start), np.array(path)
    poses = find_manoeuvre(start, path, body(world, start), 0)
    assert len(poses)
    assert swept_clearance(world, start, poses) > 0.004
    before, after = (math.dist(place[:2], path[-1]) for place in (start, poses[-1]))
    assert after < before - 0.3


def test_no_manoeuvre_leads_where_the_robot_does_not_fit():
    narrow = boxes((0.5, 0.22, 0.6, 3.0), (0.5, -3.0, 0.6, -0.22))
    start = np.array((0.1, 0.0, 0.0))
    poses = find_manoeuvre(start, np.array(((1.9, 0.0),)), body(narrow, start), 0)
    assert not len(poses) or poses[:, 0].max() < 0.3


def test_poses_are_reached_in_their_gear():
    poses = np.array(((0.0, 0.0, 0.5, 0.0), (0.3, 0.0, 0.5, 1.0), (0.1, 0.0, 0.5, -1.0)))
    assert count_reached(np.array((0.0, 0.0, 0.4)), poses, BASE, SHAPE.radius) == 0
    assert count_reached(np.array((0.0, 0.0, 0.49)), poses, BASE, SHAPE.radius) == 1
    assert count_reached(np.array((0.3, 0.0, 0.5)), poses, BASE, SHAPE.radius) == 2
    assert count_reached(np.array((0.1, 0.0, 0.5 - 2.0 * math.pi)), poses[2:], BASE, SHAPE.radius) == 1


def stuck_for(
    duration: float, poses: list[np.ndarray], path: np.ndarray, robot: ManoeuvreContext
) -> list[ManoeuvreState]:
    """The manoeuvres at each scan of a robot that is at one pose after the other, and follows none of its own."""
    state, states = ManoeuvreState(), []
    for k in range(int(duration / 0.1)):
        state = step_manoeuvre(state, path, poses[k % len(poses)], 0.1 * k, robot, PATIENCE)
        states.append(state)
    return states


def test_a_robot_that_stands_with_a_path_begins_manoeuvres_gives_its_way_up_and_begins_anew():
    pose, path = np.array((0.0, 0.05, 0.6)), np.array(((1.6, 0.0),))
    states = stuck_for(20.0, [pose], path, body(DOOR, pose))
    assert not len(states[int(STUCK_TIME / 0.1) - 1].poses)
    assert any(len(state.poses) for state in states)
    first = next(k for k, state in enumerate(states) if state.has_given_up)
    assert len(states[first].attempts) == TRIES and not len(states[first].poses)
    assert 0.1 * first < TRIES * PATIENCE + 1.0
    assert not states[first + 1].has_given_up and len(states[first + 1].attempts) == 0
    assert any(state.has_given_up for state in states[first + 1 :])


def test_a_robot_that_shuttles_between_two_places_gives_its_way_up():
    path, poses, state = np.array(((1.6, 0.0),)), [np.array((x, 0.05, 0.6)) for x in (0.1, -0.9)], ManoeuvreState()
    time, gave_up = 0.0, False
    for k in range(2 * TRIES + 2):  # each time stuck at the other place
        for _ in range(5):
            time += 0.1
            state = step_manoeuvre(
                state._replace(poses=state.poses[:0]), path, poses[k % 2], time, body(DOOR, poses[k % 2]), PATIENCE
            )
            gave_up |= state.has_given_up
    assert gave_up


def test_a_manoeuvre_ends_where_the_robot_may_turn_on_its_path():
    poses = np.array(((1.6, 0.0, 0.0, 1.0),))
    for x, others, ends in ((-1.2, (-0.6, 0.0), True), (0.0, (1.6, 0.0), False), (1.6, (2.3, 0.0), True)):
        pose, path = np.array((x, 0.0, 0.0)), np.array((others,))
        state = step_manoeuvre(ManoeuvreState(poses + (x, 0.0, 0.0, 0.0)), path, pose, 0.0, body(DOOR, pose), PATIENCE)
        assert (len(state.poses) == 0) == ends


def test_a_robot_without_a_path_or_that_moves_begins_none():
    pose, path = np.array((0.0, 0.05, 0.6)), np.array(((1.6, 0.0),))
    robot, state, creeping = body(DOOR, pose), ManoeuvreState(), ManoeuvreState()
    for k in range(30):
        state = step_manoeuvre(state, path[:0], pose, 0.1 * k, robot, PATIENCE)
        creeping = step_manoeuvre(creeping, path, pose + (0.02 * k, 0.0, 0.0), 0.1 * k, robot, PATIENCE)
        assert not len(state.poses) and not len(creeping.poses)


@pytest.mark.parametrize("base", ["differential", "omnidirectional"])
@pytest.mark.parametrize("name", SHAPES)
def test_a_robot_that_turns_on_the_spot_finds_its_way_into_any_dock(name: str, base: str) -> None:
    """Close to a wall with any heading, from where it stands aslant there; and forwards and backwards into a bay."""
    shape, ahead = SHAPES[name], 0.5 * math.pi
    docks = [(k * 0.25 * math.pi, False, (0.15, -0.15, 0.0)) for k in range(16)]
    docks += [(yaw, True, (0.5, -1.4, -0.9)) for yaw in (ahead, -ahead) * 3]
    for seed, (yaw, is_bay, (aside, low, high)) in enumerate(docks):
        x, y, u, v = shapely.bounds(find_covered_area(shape, (0.0, 0.0, yaw)))
        sides = (x - 0.5, 0.1, x - 0.07, v + 0.037), (u + 0.07, 0.1, u + 0.5, v + 0.037)
        world = boxes((-3.0, v + 0.037, 3.0, 3.0), *(sides if is_bay else ()))
        solid, rng = shapely.union_all([shapely.Polygon(p) for p in world.polygons]), np.random.default_rng(2 * seed)
        start = np.zeros(3)
        while shapely.distance(find_covered_area(shape, start), solid) < 0.03 or not start.any():
            start = rng.uniform((-aside, low, -math.pi), (aside, high, math.pi))
        robot = body(world, start, shape, BASES[base])
        dock = np.array((0.0, 0.0, yaw, 0.03))
        poses = step_docking(ManoeuvreState(pose=start), dock, start, STUCK_TIME + 1.0, robot, PATIENCE).poses
        assert len(poses), (yaw, is_bay, start)
        assert math.dist(poses[-1, :2], dock[:2]) < dock[3] and abs(wrap_angle(poses[-1, 2] - yaw)) < 1e-9
        assert all(shapely.distance(find_covered_area(shape, pose[:3]), solid) > MARGIN - 0.002 for pose in poses)


@pytest.mark.parametrize("yaw", [-3.0, -1.5, -0.3, 0.0, 0.8, 2.2])
def test_a_car_at_its_goal_manoeuvres_to_its_heading(yaw: float) -> None:
    """And begins another manoeuvre while it is not there, but none once it is."""
    start, dock = np.zeros(3), np.array((0.2, 0.1, yaw))
    robot = RobotParameters(base="car")
    car = body(boxes(), start)._replace(
        base=robot.drive, motion_primitives=robot.drive.motion_primitives(SHAPE.radius, robot.limits)
    )
    now = step_docking(ManoeuvreState(), dock, start, STUCK_TIME, car, PATIENCE)
    assert (len(now.poses) == 0) == (yaw == 0.0)
    if len(now.poses):
        end = now.poses[-1]
        assert math.dist(end[:2], dock[:2]) < 0.13 and abs(math.remainder(end[2] - yaw, 2.0 * math.pi)) < 0.025
        done = step_docking(now._replace(poses=now.poses[-1:]), dock, end[:3], STUCK_TIME + 5.0, car, PATIENCE)
        assert not len(done.poses) and not len(step_docking(done, dock, end[:3], 9.0, car, PATIENCE).poses)
        assert len(step_docking(done, dock, start, 9.0, car, PATIENCE).poses)
