"""Among obstacles that move: never into one, out of their way, and as ever where there are none."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings

from drake_starnav.control import ControllerInputs
from drake_starnav.moving.kalman_tracks import Tracks
from drake_starnav.moving.parameters import DynamicObstacleParameters
from drake_starnav.moving.prediction import add_radius
from drake_starnav.moving.tracker import TrackedObstacles
from drake_starnav.planning.guidance import Guidance
from drake_starnav.robot import RobotParameters
from drake_starnav.surroundings.surroundings import Surroundings
from tests.helpers.loop import CONTROLLER, ROBOT, command, drive, pacing
from tests.helpers.scans import seeds
from tests.helpers.scenes import Scene, hall, straight

pytestmark = pytest.mark.slow

STRICT = DynamicObstacleParameters(max_speed=0.8, caution=1.0)
AGILE = dataclasses.replace(ROBOT, max_speed=1.6, max_yaw_rate=4.0, max_acceleration=3.0, max_yaw_acceleration=10.0)
START, GOAL = np.array((-2.5, 0.0, 0.0)), np.array((2.5, 0.0))


@settings(max_examples=4, deadline=None)
@given(seed=seeds)
def test_a_robot_in_a_crowd_never_runs_into_anything(seed: int) -> None:
    rng = np.random.default_rng(seed)
    places = rng.uniform(-3.0, 3.0, (5, 2))
    places = places[np.hypot(*(places - START[:2]).T) > 1.5]
    heading, speed = rng.uniform(-math.pi, math.pi, len(places)), rng.uniform(0.3, 0.8, len(places))
    scene = pacing(places, speed[:, None] * np.column_stack((np.cos(heading), np.sin(heading))), 3.5)
    assert drive(scene, START, GOAL, STRICT, seed=seed, duration=15.0).outcome != "collision"


@pytest.mark.parametrize("offset", [-0.2, 0.0, 0.01])
@pytest.mark.parametrize(
    ("robot", "speed", "caution"),
    [(ROBOT, 0.6, 1.0), (ROBOT, 0.6, 0.5), (ROBOT, 0.6, 0.0), (ROBOT, 0.3, 1.0), (AGILE, 0.8, 1.0), (AGILE, 0.8, 0.5)],
)
def test_it_makes_way_for_one_that_comes_head_on(
    robot: RobotParameters, speed: float, caution: float, offset: float
) -> None:
    """Without retreating before it: whoever only puts off the encounter has it before him for ever."""
    oncoming = Scene(hall(), (0.3,), straight((3.0, offset), (-speed, 0.0)))
    obstacles = DynamicObstacleParameters(max_speed=0.8, caution=caution)
    run = drive(oncoming, START, GOAL, obstacles, robot=robot, duration=12.0)
    assert run.outcome == "reached"
    assert run.poses[:, 0].min() > START[0] - 0.3
    assert np.abs(run.poses[:, 1]).max() > 0.3  # not by luck


def test_nothing_that_moved_is_left_in_the_roadmap() -> None:
    scene = pacing(np.array([(1.0, 1.0), (0.0, -2.0)]), np.array([(-0.4, 0.2), (0.3, 0.4)]), 3.5)
    run = drive(scene, START, GOAL, STRICT, duration=6.0)
    inside = np.array([(x, y) for x in np.arange(-2.5, 2.6, 0.1) for y in np.arange(-2.5, 2.6, 0.1)])
    assert run.plan.roadmap.grid.distance(inside).min() > 0.4


def test_it_brakes_where_nothing_can_be_certified() -> None:
    angle = np.linspace(0.0, 2.0 * math.pi, 90)
    ring = 0.35 * np.column_stack((np.cos(angle), np.sin(angle)))
    tracks = Tracks(time=0.0, hits=add_radius(ring, 0.0), hit_track=np.full(len(ring), -1))
    twist = np.array((0.4, 0.1))
    inputs = ControllerInputs(np.zeros(3), twist, Guidance.none(), Surroundings.unknown())
    driven = command(inputs, TrackedObstacles(tracks, 0.0, STRICT))
    assert math.isclose(driven[0], 0.4 - ROBOT.max_acceleration / CONTROLLER.rate)
