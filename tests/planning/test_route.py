"""What a robot expects past its target: it turns to it as soon as it is seen, and plans anew when a scan bars it."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings

from drake_starnav.lidar.laser_scan import DYNAMIC
from drake_starnav.planning import PlannerInput, PlannerParameters, PlannerState, PlannerStatus, plan_step
from drake_starnav.planning import state as planner_state
from drake_starnav.planning.frontiers import find_region_frontiers
from drake_starnav.planning.grid import STRIDE
from drake_starnav.planning.monitoring import REPLAN_DISTANCE, is_obstructed
from drake_starnav.planning.roadmap import CLOSURE_RADIUS, ClosedPlaces, StarRoadmap
from drake_starnav.planning.route import LARGEST_EXIT_SHIFT, LENGTH_OUTSIDE, _find_exit, find_frontier_point, find_route
from drake_starnav.worlds.world import World
from tests.helpers.path_follower import BAFFLES, PERIOD, drive
from tests.helpers.scans import (
    MARGINS,
    RADIUS,
    cast,
    distance,
    explored,
    in_view,
    noisy,
    planner_input,
    seeds,
    wandered,
)

PARAMETERS = PlannerParameters()
PLAIN = World("plain", (0.0, 0.0, 0.0), (12.0, 0.0), bounds=(-1.0, -3.0, 13.0, 3.0))
"""What lies farther than 5 m is not seen, and taken for free."""
POST = dataclasses.replace(PLAIN, cylinders=[(5.35, 0.0, 0.3)])
"""There a post stands, 5.05 m from the start."""
FARTHER = (REPLAN_DISTANCE * RADIUS + 0.02, 0.0)
HALF_CELL = 0.5 * STRIDE * PARAMETERS.cell(RADIUS)
"""Half of a side of a cell of the cost-to-go, m."""


def planned(before: PlannerState, world: World, place=FARTHER, noise=0.0, motion=None):
    """The state once a robot at a place has seen the world."""
    pose = np.array((*place, 0.0))
    scan = dataclasses.replace(noisy(cast(world, pose), noise, np.random.default_rng(1)), time=place[0])
    if motion is not None:
        scan = dataclasses.replace(scan, motion=np.where(scan.hits, motion, 0).astype(np.int8))
    return plan_step(before, planner_input(scan, pose, world.goal))


def beginning() -> PlannerState:
    state = planned(PlannerState.initial(PARAMETERS, RADIUS), PLAIN, (0.0, 0.0))
    assert state.status is PlannerStatus.EXPLORING and state.progress.plan_count == 1 and len(state.roadmap) == 1
    return state


def test_an_obstructed_optimistic_path_triggers_a_plan():
    before = beginning()
    after = planned(before, POST)
    assert (len(after.roadmap), after.progress.plan_count) == (1, 2)
    hits = cast(POST, np.array((*FARTHER, 0.0))).points((*FARTHER, 0.0))
    assert is_obstructed(before.route.beyond, hits, RADIUS) and not is_obstructed(after.route.beyond, hits, RADIUS)
    again = planned(after, POST, (FARTHER[0] + REPLAN_DISTANCE * RADIUS + 0.02, 0.0))
    assert again.progress.plan_count == 2


def test_none_is_triggered_right_after_a_plan_by_what_was_expected_or_by_what_moves():
    too_early = planned(beginning(), POST, (REPLAN_DISTANCE * RADIUS - 0.02, 0.0))
    for state in (too_early, planned(beginning(), PLAIN, noise=0.01), planned(beginning(), POST, motion=DYNAMIC)):
        assert state.progress.plan_count == 1


def looks_ahead(state: PlannerState) -> bool:
    """Whether the guidance leads past the exit."""
    return len(state.guidance.path) > 0 and state.guidance.path[0].tolist() != state.route.path[0].tolist()


def test_the_robot_turns_to_the_optimistic_path_as_soon_as_the_latest_scan_shows_it(monkeypatch):
    states = drive(BAFFLES, PARAMETERS, steps=700)
    monkeypatch.setattr(planner_state, "look_ahead", lambda state: None)
    bare = drive(BAFFLES, PARAMETERS, steps=700)
    assert not any(looks_ahead(state) for state in bare)
    early = [state for state in states if looks_ahead(state)]
    assert len(early) >= 3 and len(states) <= len(bare)
    for state in early:
        aim = state.guidance.path[0]
        assert state.status is PlannerStatus.EXPLORING and not state.guidance.arrives
        assert (state.route.beyond == aim).all(axis=1).any() and state.guidance.regions.size == 1
        assert in_view(state.guidance.regions, state.guidance.regions.center[0], aim)
    assert not looks_ahead(states[-1]) and not len(states[-1].with_new_goal().guidance.path)


def test_the_robot_does_not_turn_to_an_optimistic_path_past_a_closure():
    states = drive(BAFFLES, PARAMETERS, steps=700)
    turned = 0
    for k in range(1, len(states)):
        before, after = states[k - 1 : k + 1]
        if not looks_ahead(after) or after.progress.plan_count > before.progress.plan_count:
            continue
        position, aim = after.guidance.regions.center[0], after.guidance.path[0]
        now = moment(BAFFLES, position, BAFFLES.goal)._replace(time=PERIOD * k)
        if (plan_step(before, now).guidance.path[0] != aim).any():  # from another yaw the region differs a little
            continue
        turned += 1
        closures = ClosedPlaces(np.vstack((before.roadmap.closures.failed_places, aim)))
        barred = dataclasses.replace(before, roadmap=dataclasses.replace(before.roadmap, closures=closures))
        later = plan_step(barred, now)
        assert later.progress.plan_count == before.progress.plan_count
        assert not looks_ahead(later) or float(np.hypot(*(later.guidance.path[0] - aim))) > CLOSURE_RADIUS * RADIUS
    assert turned


def left(roadmap: StarRoadmap, path: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
    """Where a path leaves the regions: the last place inside, the first outside, and the index of the former."""
    path, last, first = _find_exit(path, HALF_CELL, roadmap.union, LENGTH_OUTSIDE * RADIUS)
    return path[last], path[first], last


@settings(max_examples=15)
@given(seeds)
def test_the_exit_is_where_a_path_leaves_the_regions_for_good(seed):
    world, roadmap = wandered(seed, nodes=3)
    start, angle = roadmap.union.center[0], np.random.default_rng(seed).uniform(-np.pi, np.pi)
    path = start + np.arange(0.0, 12.0, 0.1)[:, None] * (np.cos(angle), np.sin(angle))
    viewpoint, probe, _ = left(roadmap, path)
    assert roadmap.union.contains(viewpoint[None])[0]
    away = np.hypot(*(path - viewpoint).T)
    assert away.min() < HALF_CELL + 1e-9
    after = np.argmin(away) + 1
    last = np.argmin(np.hypot(*(path - probe).T))
    around = HALF_CELL * np.array([(0, 0), (1, 0), (0, 1), (-1, 0), (0, -1)])
    beyond = (path[after : last + 1, None] + around).reshape(-1, 2)
    assert len(beyond) and not any(region.contains(beyond).any() for region in roadmap.regions)
    assert (
        LENGTH_OUTSIDE * RADIUS - HALF_CELL
        <= np.hypot(*(probe - viewpoint))
        < LENGTH_OUTSIDE * RADIUS + 0.1 + HALF_CELL + 1e-9
    )


def state_of(roadmap: StarRoadmap) -> PlannerState:
    return dataclasses.replace(PlannerState.initial(PARAMETERS, RADIUS), roadmap=roadmap)


def moment(world: World, position: np.ndarray, goal: np.ndarray) -> PlannerInput:
    pose = np.array((*position, 0.0))
    return planner_input(cast(world, pose), pose, goal)


@settings(max_examples=20)
@given(seeds)
def test_a_frontier_point_lies_inside_its_gap_near_where_the_path_crosses_it(seed):
    world, roadmap = wandered(seed)
    now = moment(world, roadmap.union.center[-1], np.array((9.0, 4.0)))
    state = state_of(roadmap)
    route = find_route(state, now.observation.region, now)
    if route is None:
        return
    assert route.exit is not None
    viewpoint, probe = route.exit
    np.testing.assert_array_equal(route.path[-1], viewpoint)
    np.testing.assert_array_equal(route.beyond[0], probe)
    assert not roadmap.union.contains(probe[None])[0]
    for owner in range(len(roadmap)):
        for gap in find_region_frontiers(roadmap, RADIUS, owner):
            k = len(gap.boundary) // 2
            inside, outside = 2.0 * gap.boundary[k] - gap.probes[k], gap.probes[k]
            point = find_frontier_point(state, RADIUS, inside, outside)
            if point is not None:
                assert np.hypot(*(point - inside)) < LARGEST_EXIT_SHIFT * RADIUS + 0.5


@settings(max_examples=15)
@given(seeds)
def test_the_goal_is_the_target_as_soon_as_the_way_to_it_is_known(seed):
    world, roadmap = wandered(seed)
    rng = np.random.default_rng(seed)
    position = roadmap.union.center[-1]
    for goal in rng.uniform(-3.0, 3.0, (20, 2)):
        now = moment(world, position, goal)
        route = find_route(state_of(roadmap), now.observation.region, now)
        known = any(r.contains(goal) for r in (*roadmap.regions, now.observation.region))
        if now.observation.region.contains(goal) or in_view(roadmap.union, position, goal):
            np.testing.assert_array_equal(route.path, [goal])
        if route is not None and route.exit is None and known:
            np.testing.assert_allclose(route.path[-1], goal, atol=1e-12)


def test_hits_that_leave_no_way_leave_no_route():
    wall = [(1.0, -3.0), (1.1, -3.0), (1.1, 3.0), (1.0, 3.0)]
    world = World("wall", (0, 0, 0), (3, 0), polygons=(wall,), bounds=(-1.0, -2.0, 4.0, 2.0))
    now = moment(world, np.zeros(2), np.array(world.goal))
    assert find_route(state_of(explored(world, np.zeros((1, 2)))), now.observation.region, now) is None


@pytest.mark.parametrize("tolerance", [0.0, 0.25])
def test_a_goal_beside_a_wall_is_approached_as_near_as_the_tolerance_lets(tolerance):
    world = World("wall", (0, 0, 0), (1.85, 0.3), bounds=(-1.0, -2.0, 2.0, 2.0))
    goal = np.array(world.goal)
    now = moment(world, np.zeros(2), goal)._replace(goal_tolerance=tolerance)
    route = find_route(state_of(explored(world, np.zeros((1, 2)))), now.observation.region, now)
    if tolerance:
        assert route.exit is None and np.hypot(*(route.path[-1] - goal)) < tolerance
        assert distance(world, route.path[-1:])[0] > RADIUS + MARGINS.preferred
        assert abs(route.path[-1, 1] - goal[1]) < 0.1
    else:
        assert route is None or route.exit is not None
