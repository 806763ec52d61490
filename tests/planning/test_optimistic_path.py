"""What a robot expects past its target: it turns to it as soon as it is seen, and plans anew when a scan bars it."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_starnav.lidar.laser_scan import DYNAMIC
from drake_starnav.planning import PlannerInput, PlannerParameters, PlannerState, PlannerStatus, plan_step, planner
from drake_starnav.planning.distance_grid import STRIDE
from drake_starnav.planning.monitoring import REPLAN_DISTANCE
from drake_starnav.planning.optimistic_path import (
    OBSTRUCTION_SLACK,
    VIRTUAL_FRONTIER_LENGTH,
    is_obstructed,
    virtual_frontier,
)
from drake_starnav.regions import Observation
from drake_starnav.regions.star_region import scan_region
from drake_starnav.worlds.world import World
from tests.helpers.path_follower import BAFFLES, PERIOD, drive
from tests.helpers.scans import MARGINS, RADIUS, cast, in_view, noisy, seeds, wandered

PARAMETERS = PlannerParameters()
PLAIN = World("plain", (0.0, 0.0, 0.0), (12.0, 0.0), bounds=(-1.0, -3.0, 13.0, 3.0))
"""What lies farther than 5 m is not seen, and taken for free."""
POST = dataclasses.replace(PLAIN, cylinders=[(5.35, 0.0, 0.3)])
"""There a post stands, 5.05 m from the start."""
FARTHER = (REPLAN_DISTANCE + 0.02, 0.0)
HALF_CELL = 0.5 * STRIDE * PARAMETERS.grid_resolution
"""Half of a side of a cell of the cost-to-go, m."""


def planned(before: PlannerState, world: World, place=FARTHER, noise=0.0, motion=None):
    """The state once a robot at a place has seen the world."""
    pose = np.array((*place, 0.0))
    scan = dataclasses.replace(noisy(cast(world, pose), noise, np.random.default_rng(1)), time=place[0])
    if motion is not None:
        scan = dataclasses.replace(scan, motion=np.where(scan.hits, motion, 0).astype(np.int8))
    seen = Observation(scan_region(scan, pose, RADIUS, MARGINS), scan, pose)
    return plan_step(before, PlannerInput(seen, pose[:2], np.array(world.goal), scan.time, PARAMETERS, MARGINS, RADIUS))


def beginning() -> PlannerState:
    state = planned(PlannerState.initial(PARAMETERS, RADIUS), PLAIN, (0.0, 0.0))
    assert state.status is PlannerStatus.EXPLORING and state.plans == 1 and len(state.roadmap) == 1
    return state


def test_an_obstructed_optimistic_path_triggers_a_plan():
    before = beginning()
    after = planned(before, POST)
    assert (len(after.roadmap), after.plans) == (1, 2)
    hits = cast(POST, np.array((*FARTHER, 0.0))).points((*FARTHER, 0.0))
    assert is_obstructed(before.optimistic_path, hits, RADIUS) and not is_obstructed(
        after.optimistic_path, hits, RADIUS
    )
    again = planned(after, POST, (FARTHER[0] + REPLAN_DISTANCE + 0.02, 0.0))
    assert again.plans == 2


def test_it_triggers_none_right_after_a_plan():
    assert planned(beginning(), POST, (REPLAN_DISTANCE - 0.02, 0.0)).plans == 1


def test_what_was_expected_triggers_no_plan():
    assert planned(beginning(), PLAIN, noise=0.01).plans == 1


def test_what_moves_bars_no_way():
    assert planned(beginning(), POST, motion=DYNAMIC).plans == 1


@given(st.integers(0, 10_000))
def test_a_path_is_barred_by_a_hit_that_is_near_to_it(seed):
    """Its first point does not count, and of the others every other is looked at."""
    rng = np.random.default_rng(seed)
    path = np.cumsum(rng.uniform(-0.1, 0.1, (rng.integers(0, 30), 2)), axis=0)
    points = rng.uniform(-1.0, 1.0, (rng.integers(0, 4), 2))
    away = np.linalg.norm(path[1::2, None] - points[None], axis=2)
    assert is_obstructed(path, points, RADIUS) == bool((away < RADIUS - OBSTRUCTION_SLACK).any())


def test_the_robot_turns_to_the_optimistic_path_as_soon_as_the_latest_scan_shows_it(monkeypatch):
    states = drive(BAFFLES, PARAMETERS, steps=700)
    monkeypatch.setattr(planner, "_anticipated", lambda *arguments: None)
    bare = drive(BAFFLES, PARAMETERS, steps=700)
    assert not any(state.anticipated for state in bare)
    early = [state for state in states if state.anticipated]
    assert len(early) >= 3 and len(states) <= len(bare)
    for state in early:
        aim = state.guidance.path[0]
        assert state.status is PlannerStatus.EXPLORING and not state.guidance.arrives
        assert (state.next_segment == aim).all(axis=1).any() and state.guidance.regions.size == 1
        assert in_view(state.guidance.regions, state.guidance.regions.center[0], aim)
    assert states[-1].anticipated is None and states[-1].with_new_goal().anticipated is None


def test_the_robot_does_not_turn_to_an_optimistic_path_past_a_blocked_place():
    states, goal = drive(BAFFLES, PARAMETERS, steps=700), np.array(BAFFLES.goal)
    turned = 0
    for k in range(1, len(states)):
        before, after = states[k - 1 : k + 1]
        if not after.anticipated or after.plans > before.plans:
            continue
        position, aim = after.guidance.regions.center[0], after.guidance.path[0]
        pose = np.array((*position, 0.0))
        scan = cast(BAFFLES, pose)
        seen = Observation(scan_region(scan, pose, RADIUS, MARGINS), scan, pose)
        now = PlannerInput(seen, position, goal, PERIOD * k, PARAMETERS, MARGINS, RADIUS)
        if (plan_step(before, now).guidance.path[0] != aim).any():  # from another yaw the region differs a little
            continue
        turned += 1
        barred = dataclasses.replace(before, roadmap=dataclasses.replace(before.roadmap, stall_points=aim[None]))
        later = plan_step(barred, now)
        assert later.plans == before.plans
        assert later.anticipated is None or float(np.hypot(*(later.guidance.path[0] - aim))) > RADIUS
    assert turned


@settings(max_examples=15)
@given(seeds)
def test_a_virtual_frontier_is_where_a_path_leaves_the_regions_for_good(seed):
    world, roadmap = wandered(seed, nodes=3)
    start, angle = roadmap.union.center[0], np.random.default_rng(seed).uniform(-np.pi, np.pi)
    path = start + np.arange(0.0, 12.0, 0.1)[:, None] * (np.cos(angle), np.sin(angle))
    frontier, way = virtual_frontier(roadmap, path)
    assert len(frontier) == 1 and roadmap.regions[frontier.owner[0]].contains(frontier.viewpoint[0])
    away = np.hypot(*(path - frontier.viewpoint[0]).T)
    assert away.min() < HALF_CELL + 1e-9
    after = np.argmin(away) + 1
    last = np.argmin(np.hypot(*(path - frontier.probe[0]).T))
    around = HALF_CELL * np.array([(0, 0), (1, 0), (0, 1), (-1, 0), (0, -1)])
    beyond = (path[after : last + 1, None] + around).reshape(-1, 2)
    assert len(beyond) and not any(region.contains(beyond).any() for region in roadmap.regions)
    assert (
        VIRTUAL_FRONTIER_LENGTH - HALF_CELL
        <= np.hypot(*(frontier.probe[0] - frontier.viewpoint[0]))
        < VIRTUAL_FRONTIER_LENGTH + 0.1 + HALF_CELL + 1e-9
    )
    np.testing.assert_array_equal(way[-1], frontier.viewpoint[0])


def test_a_virtual_frontier_may_be_where_the_robot_stands_just_outside_of_the_regions():
    _, roadmap = wandered(1, nodes=1)
    direction = np.array((1.0, 0.0))
    edge = next(r for r in np.arange(0.05, 12.0, 0.05) if not roadmap.regions[0].contains(r * direction))
    for outside in (0.01, HALF_CELL + 0.01):
        path = (edge + outside + np.arange(0.0, 1.0, 0.1))[:, None] * direction
        frontier, way = virtual_frontier(roadmap, path)
        if outside > HALF_CELL:
            np.testing.assert_array_equal(frontier.viewpoint, path[:1])
        else:  # a place in the robot's cell is inside
            assert roadmap.regions[0].contains(frontier.viewpoint[0])
            assert np.hypot(*(frontier.viewpoint[0] - path[0])) == pytest.approx(HALF_CELL)
        assert len(way) == 1 and frontier.owner.tolist() == [0]
