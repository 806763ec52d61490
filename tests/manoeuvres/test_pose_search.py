"""The search finds the ways that a base can drive, out of the tightest places, to the cheapest of several goals."""

import math

import numpy as np
import pytest
import shapely

from drake_starnav.geometry.footprint import find_covered_area, footprint
from drake_starnav.manoeuvres.pose_search import FIRST_SHARES, NEAR_GOAL, search_poses
from drake_starnav.robot import BASES, RobotParameters
from drake_starnav.surroundings.chords import Chords
from drake_starnav.surroundings.view_arrays import ViewArrays
from drake_starnav.surroundings.view_history import ViewHistory

SHAPE = footprint(((0.4, -0.25), (0.4, 0.25), (-0.4, 0.25), (-0.4, -0.25)))
MOVES = {name: base.motion_primitives(SHAPE.radius, RobotParameters(base=name).limits) for name, base in BASES.items()}
MARGIN, SPARE, ALIGNED = 0.02, 0.008, 0.3
VIEWS = ViewArrays.of(ViewHistory())


def walls(ends: np.ndarray, place: np.ndarray) -> Chords:
    """Surfaces that hide nothing."""
    return Chords(ends, np.ones(len(ends), np.bool_), np.zeros(len(ends), np.bool_), place)


OPEN = walls(np.full((1, 4), 50.0), np.zeros(2))


def moved(pose: np.ndarray, move: np.ndarray, steps: int = 20) -> list[np.ndarray]:
    """Poses (x, y, yaw) on a move (dx, dy, dyaw, ...) that is turned evenly."""
    poses = [pose]
    for _ in range(steps):
        yaw = poses[-1][2] + 0.5 * move[2] / steps
        turn = np.array(((math.cos(yaw), -math.sin(yaw)), (math.sin(yaw), math.cos(yaw))))
        poses.append(poses[-1] + np.array((*turn @ move[:2], move[2])) / steps)
    return poses


def surfaces_around(poses: list[np.ndarray], spare: float) -> Chords:
    """Surfaces that leave the footprint just the room to move over some poses, with the margin and a spare."""
    with np.errstate(invalid="ignore"):  # of mitres at corners that are almost straight
        swept = shapely.union_all([find_covered_area(SHAPE, pose) for pose in poses]).buffer(
            MARGIN + spare, join_style="mitre"
        )
    rings = [np.asarray(ring.segmentize(0.02).coords) for ring in (swept.exterior, *swept.interiors)]
    ends = np.vstack([np.hstack((ring[:-1], ring[1:])) for ring in rings])
    return walls(ends, poses[0][:2])


@pytest.mark.parametrize("base", BASES)
def test_a_robot_that_is_wedged_in_gets_out_as_it_came_in(base: str) -> None:
    """The only way out begins with a part of a move of the base, or with a bend of any radius, if it turns on the spot.

    A few are missed, since the search has cells.
    """
    moves, outcomes = MOVES[base], []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        drive = rng.choice(FIRST_SHARES)
        turn = drive if base == "car" else rng.choice(FIRST_SHARES)
        way = [np.array((drive, drive, turn, 1.0, 1.0)) * rng.choice(moves), *(rng.choice(moves) for _ in range(4))]
        poses = [np.array((*rng.uniform(-1.0, 1.0, 2), rng.uniform(-math.pi, math.pi)))]
        for move in way:
            poses += moved(poses[-1], move)
        start, goal = poses[0], poses[-1]
        if math.dist(start[:2], goal[:2]) < NEAR_GOAL * SHAPE.radius and abs(start[2] - goal[2]) < ALIGNED:
            continue
        surfaces = surfaces_around(poses, SPARE)
        found = search_poses(start, np.array(((*goal, ALIGNED, 0.0),)), moves, SHAPE, MARGIN, (surfaces, VIEWS))
        outcomes.append(len(found) > 0)
        solid = shapely.union_all(shapely.linestrings(surfaces.ends.reshape(-1, 2, 2)))
        assert all(shapely.distance(find_covered_area(SHAPE, pose[:3]), solid) > MARGIN - 1e-6 for pose in found)
    assert len(outcomes) > 35
    assert np.mean(outcomes) > 0.9


def test_what_it_costs_to_end_at_a_goal_decides_between_goals():
    start, moves = np.zeros(3), MOVES["differential"]
    for costs, x in (((0.0, 0.0), 0.6), ((1.0, 0.0), -0.9), ((0.1, 0.0), 0.6)):
        goals = np.array(((0.6, 0.0, 0.0, 0.3, costs[0]), (-0.9, 0.0, 0.0, 0.3, costs[1])))
        assert search_poses(start, goals, moves, SHAPE, MARGIN, (OPEN, VIEWS))[-1, 0] == pytest.approx(x, abs=0.121)


def test_there_is_no_way_to_where_no_disc_within_the_footprint_gets():
    wall = np.array([(0.7, y, 0.7, y + 0.05) for y in np.arange(-3.0, 3.0, 0.05)])
    surfaces = walls(wall, np.zeros(2))
    for moves in MOVES.values():
        goals = np.array(((1.4, 0.0, 0.0, 7.0, 0.0),))
        assert not len(search_poses(np.zeros(3), goals, moves, SHAPE, MARGIN, (surfaces, VIEWS)))
