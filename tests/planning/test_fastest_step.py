"""The planner on the fastest path, in a closed loop with a robot that moves along it exactly."""

import dataclasses

import numpy as np
import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.planning import PlannerInput, PlannerParameters, PlannerState, PlannerStatus, fastest_step
from drake_starnav.regions import Observation
from drake_starnav.regions.star_region import scan_region
from drake_starnav.robot import RobotParameters
from drake_starnav.worlds.world import World
from tests.helpers.scans import RADIUS, cast, distance
from tests.planning.test_planner import BAFFLES, VAULT

PARAMETERS = PlannerParameters(path="fastest", grid_resolution=0.03, grid_beyond=0.3, margin=0.01)
ROBOT = RobotParameters(radius=RADIUS, close_speed=0.4, speed_per_clearance=2.0)
PERIOD = 0.05


def drive(world: World, steps: int, parameters: PlannerParameters = PARAMETERS) -> list[PlannerState]:
    """The planner's states until it reaches the goal, gives up, or has used all steps."""
    position, goal = np.array(world.start[:2]), np.array(world.goal)
    state, states = PlannerState.initial(parameters, RADIUS), []
    for k in range(steps):
        pose = np.array((*position, 0.3 * np.sin(0.1 * k)))
        scan = cast(world, pose)
        seen = Observation(scan_region(scan, pose, RADIUS, parameters), scan, pose)
        state = fastest_step(state, PlannerInput(seen, position, goal, PERIOD * k, parameters, ROBOT.radius), ROBOT)
        states.append(state)
        if state.status is PlannerStatus.UNREACHABLE or np.hypot(*(position - goal)) < 0.05:
            break
        left = 0.8 * PERIOD
        begun = len(state.path) > 1 and np.hypot(*(state.path[0] - position)) < 1.5 * parameters.grid_resolution
        for point in state.path[1:] if begun else state.path:  # the first cell is the robot's own
            offset = point - position
            away = float(np.hypot(*offset))
            step = min(left, away)
            position = position + offset * (step / max(away, 1e-12))
            left -= step
        assert distance(world, position[None])[0] > RADIUS - 0.03  # what cells and smoothed corners cost at most
    return states


def test_the_goal_is_reached_and_the_roadmap_has_grown():
    states = drive(BAFFLES, steps=400)
    last = states[-1]
    assert last.status is PlannerStatus.APPROACHING and last.guidance.arrives
    np.testing.assert_array_equal(last.path[-1], BAFFLES.goal)
    assert states[0].status is PlannerStatus.EXPLORING
    assert len(states) < 400 and len(last.roadmap) > 3
    assert not len(last.progress_monitor.stall_points)


def test_a_far_goal_is_not_arrived_at_yet():
    (state,) = drive(World("open", (0, 0, 0), (9, 0)), steps=1)
    assert state.status is PlannerStatus.EXPLORING
    assert not state.guidance.arrives


def test_a_goal_too_far_for_the_grid_is_reported():
    with pytest.raises(StarnavError, match=r"too far.*5e\+07 cells of 0\.03 m; allowed: .*planner\.grid_resolution"):
        drive(World("open", (0, 0, 0), (2000, 2000)), steps=1)


def test_an_enclosed_goal_is_left_to_the_roadmap_which_gives_it_up():
    states = drive(VAULT, steps=3000, parameters=dataclasses.replace(PARAMETERS, margin=0.03, retries=0))
    assert states[-1].status is PlannerStatus.UNREACHABLE
    assert not len(states[-1].path)
    assert any(state.target is not None for state in states), "it explored as without a fastest path"


def test_a_robot_that_cannot_follow_has_the_narrow_place_shut():
    world = World(
        "door", (0.0, 0.0, 0.0), (3.0, 0.0),
        polygons=(
            [(0.5, -2.0), (0.6, -2.0), (0.6, -0.28), (0.5, -0.28)], [(0.5, 0.28), (0.6, 0.28), (0.6, 2.0), (0.5, 2.0)]
        ),
    )  # fmt: skip
    state = PlannerState.initial(PARAMETERS, RADIUS)
    pose = np.zeros(3)
    scan = cast(world, pose)
    seen = Observation(scan_region(scan, pose, RADIUS, PARAMETERS), scan, pose)
    for k in range(40):
        state = fastest_step(
            state, PlannerInput(seen, pose[:2], np.array(world.goal), PERIOD * k, PARAMETERS, ROBOT.radius), ROBOT
        )
    assert len(state.progress_monitor.stall_points) == 1
    np.testing.assert_allclose(state.progress_monitor.stall_points[0], (0.55, 0.0), atol=0.12)
    anew = state.with_new_goal()
    anew = fastest_step(
        anew, PlannerInput(seen, pose[:2], np.array((3.0, 0.3)), PERIOD * 100, PARAMETERS, ROBOT.radius), ROBOT
    )
    assert not len(anew.progress_monitor.stall_points), "it may be that the robot was to wait for its new goal"
    assert np.abs(state.path[:, 1]).max() > 1.0
