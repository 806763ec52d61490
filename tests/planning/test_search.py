import dataclasses
import math
from contextlib import contextmanager, nullcontext
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from drake_starnav.planning import search
from drake_starnav.planning.cost_field import STRIDE, Terrain, cost_to_go
from drake_starnav.planning.frontiers import Frontiers
from drake_starnav.planning.node_graph import graph_distances
from drake_starnav.planning.optimistic_path import NEXT
from drake_starnav.planning.parameters import PlannerParameters
from drake_starnav.planning.roadmap import blacklist_target
from drake_starnav.planning.search import (
    HYSTERESIS,
    estimates,
    find_route,
    optimistic_cost,
)
from drake_starnav.planning.state import PlannerInput
from drake_starnav.regions.observation import Observation
from drake_starnav.regions.star_region import StarRegion, scan_region
from drake_starnav.worlds.world import World
from tests.helpers.scans import MARGINS, RADIUS, cast, distance, explored, in_view, length, seeds, wandered

PARAMETERS = PlannerParameters()
HALF_CELL = 0.5 * STRIDE * PARAMETERS.grid_resolution
"""Half of a side of a cell of the cost-to-go, m."""


@contextmanager
def without_gates():
    """Only frontiers are targets."""

    def known_everywhere(roadmap, now, cost_to_come=None, at_robot=True, doubting=False):
        return optimistic_cost(roadmap, now, cost_to_come, False, doubting)

    with patch.multiple(search, VIRTUAL_FRONTIER_ADVANTAGE=math.inf, optimistic_cost=known_everywhere):
        yield


def here(world: World, position: np.ndarray) -> StarRegion:
    pose = np.array((*position, 0.0))
    return scan_region(cast(world, pose), pose, RADIUS, MARGINS)


def moment(position: np.ndarray, goal: np.ndarray) -> PlannerInput:
    """What the search is given of the robot at a place: no scan, for it looks at the roadmap alone."""
    return PlannerInput(Observation.none(), position, goal, 0.0, PARAMETERS, MARGINS, RADIUS)


@settings(max_examples=10)
@given(seeds)
def test_no_way_is_shorter_outside_of_what_is_known(seed):
    world, roadmap = wandered(seed)
    center, goal = roadmap.union.center, np.random.default_rng(seed).uniform(-6.0, 6.0, 2)
    low, high = center.min(axis=0) - 12.0, center.max(axis=0) + 12.0
    wide = cost_to_go(roadmap.hits, goal, low, high, Terrain(RADIUS))
    narrow = optimistic_cost(roadmap, moment(center[-1], goal))
    for points in (roadmap.frontiers.probe, center, roadmap.regions[-1].outline(100)):
        np.testing.assert_allclose(narrow.at(points), wide.at(points), atol=1e-9)


@settings(max_examples=15)
@given(seeds)
def test_the_goal_wins_as_soon_as_a_region_contains_it(seed):
    world, roadmap = wandered(seed)
    rng = np.random.default_rng(seed)
    position = roadmap.union.center[-1]
    region = here(world, position)
    for goal in rng.uniform(-3.0, 3.0, (20, 2)):
        seen = [r.contains(goal) for r in (*roadmap.regions, region)]
        route = find_route(roadmap, region, moment(position, goal))
        assert (route is not None and not len(route.target)) == any(seen)
        if any(seen):
            np.testing.assert_allclose(route.path[-1], goal, atol=1e-12)
    bare = dataclasses.replace(roadmap, frontiers=Frontiers.none())
    with without_gates():
        assert find_route(bare, region, moment(position, np.full(2, 9.0))) is None


def test_a_goal_in_sight_is_not_approached_by_the_node_behind():
    goal, position = np.array((3.0, 0.0)), np.array((0.7, 0.0))
    roadmap = explored(World("open", (0, 0, 0), tuple(goal)), np.zeros((1, 2)))
    hidden = here(World("post", (0, 0, 0), tuple(goal), cylinders=[(2.0, 0.0, 0.05)]), position)
    assert not hidden.contains(goal)
    with patch.object(search, "string_pulled", lambda path, position, regions: path):
        route = find_route(roadmap, hidden, moment(position, goal))
    np.testing.assert_allclose(route.path, [goal], atol=1e-12)


@settings(max_examples=15)
@given(seeds, st.booleans())
@example(9, False)
@example(58, False)
@example(13816, False)
@example(9, True)
@example(58, True)
def test_the_cheapest_frontier_is_chosen(seed, virtual_frontiers):
    world, roadmap = wandered(seed)
    if virtual_frontiers:  # none is left
        roadmap = dataclasses.replace(roadmap, blacklisted_targets=np.array([(0.0, 0.0, 100.0)]))
    position = roadmap.union.center[-1]
    goal = np.array((9.0, 4.0))
    region = here(world, position)
    frontiers = roadmap.frontiers
    for current in (None, frontiers.viewpoint[-1]):
        with nullcontext() if virtual_frontiers else without_gates():
            route = find_route(roadmap, region, moment(position, goal), current)
        distances, _ = graph_distances(roadmap, region, position)
        cost = distances[frontiers.owner] + np.hypot(*(frontiers.viewpoint - roadmap.union.center[frontiers.owner]).T)
        for k, viewpoint in enumerate(frontiers.viewpoint):
            if in_view(roadmap.union, position, viewpoint):
                cost[k] = min(cost[k], np.hypot(*(viewpoint - position)))
        cost += np.hypot(*(frontiers.probe - frontiers.viewpoint).T)
        closed = roadmap.blacklisted_probes if route is None else route.blacklisted_probes
        known = dataclasses.replace(roadmap, blacklisted_probes=closed)
        cost += estimates(optimistic_cost(known, moment(position, goal)), frontiers, goal)
        if route is None:
            assert np.isinf(cost).all()
            continue
        if current is not None:
            cost[np.hypot(*(frontiers.viewpoint - current).T) < 1e-9] -= HYSTERESIS
        chosen = np.flatnonzero((frontiers.viewpoint == route.target.viewpoint).all(axis=1))[0]
        assert cost[chosen] == pytest.approx(cost.min())
        np.testing.assert_allclose(route.path[-1], route.target.viewpoint[0], atol=1e-12)


def test_a_gap_that_shows_no_frontier_is_entered_by_a_virtual_frontier():
    # seen flat from (0, 0), the gap between the wall and the post is no jump of the free range
    wall = [(1.0, 0.45), (6.0, 0.45), (6.0, 0.55), (1.0, 0.55)]
    post = (0.3, 0.75, 0.1)
    world = World(
        "gap", (0.0, 0.0, 0.0), (1.5, 1.5), cylinders=(post,), polygons=(wall,), bounds=(-6.0, -0.5, 6.0, 6.0)
    )
    roadmap = explored(world, np.zeros((1, 2)))
    bare = dataclasses.replace(roadmap, frontiers=Frontiers.none())
    region, position, goal = here(world, np.zeros(2)), np.zeros(2), np.array(world.goal)
    with without_gates():
        assert find_route(bare, region, moment(position, goal)) is None
    route = find_route(bare, region, moment(position, goal))
    assert len(route.target) == 1 and route.target.probe[0, 1] > route.target.viewpoint[0, 1]
    tried = blacklist_target(bare, route.target.viewpoint[0], 0.2, route.target.probe[0])
    other = find_route(tried, region, moment(position, goal))
    assert other is None or np.hypot(*(other.target.viewpoint - route.target.viewpoint).T)[0] > 0.2


def test_the_optimistic_path_begins_at_the_probe_and_follows_the_optimistic_path():
    """Around the end of a wall: from the probe across the jump on to the goal behind the wall, the next metre first."""
    wall = [(1.0, -3.0), (1.1, -3.0), (1.1, 0.5), (1.0, 0.5)]
    world = World("wall", (0.0, 0.0, 0.0), (3.0, -2.0), polygons=(wall,), bounds=(-3.0, -3.0, 6.0, 4.0))
    roadmap = explored(world, np.zeros((1, 2)))
    position, goal = np.zeros(2), np.array(world.goal)
    for virtual_frontiers in (True, False):
        with nullcontext() if virtual_frontiers else without_gates():
            route = find_route(roadmap, here(world, position), moment(position, goal))
        np.testing.assert_array_equal(route.optimistic_path[0], route.target.probe[0])
        assert np.hypot(*(route.optimistic_path[-1] - goal)) < 2.0 * PARAMETERS.grid_resolution
        assert (
            distance(world, route.optimistic_path[1:]).min() > RADIUS - 0.05
        )  # the probe may lie nearer, out of sight
        np.testing.assert_array_equal(route.next_segment, route.optimistic_path[: len(route.next_segment)])
        assert NEXT - 0.15 < length(route.next_segment) < NEXT + 0.3  # the first step is from the probe to a cell
        to_go = np.hypot(*(route.next_segment - goal).T)
        assert to_go[-1] < to_go[0] - 0.5 and np.hypot(*(route.next_segment[-1] - route.target.viewpoint[0])) > 0.5
    route = find_route(roadmap, here(world, position), moment(position, np.array((0.5, 0.5))))
    assert not len(route.target) and not len(route.optimistic_path) and not len(route.next_segment)


def test_an_optimistic_path_that_leads_back_past_the_robot_has_no_next_part_but_the_probe():
    """The last frontier lies behind a post, away from the goal: the robot must go and see, not turn at once."""
    world = split_room(door=1.0)
    roadmap = explored(world, np.zeros((1, 2)))
    behind = roadmap.frontiers.where(roadmap.frontiers.probe[:, 0] < -1.0)
    roadmap, position, goal = dataclasses.replace(roadmap, frontiers=behind), np.zeros(2), np.array(world.goal)
    to_go = optimistic_cost(roadmap, moment(position, goal))
    assert len(behind) and (to_go.at(behind.probe) > to_go.at(position[None])).all()
    with without_gates():
        route = find_route(roadmap, here(world, position), moment(position, goal))
    np.testing.assert_array_equal(route.next_segment, route.target.probe)
    assert length(route.optimistic_path) > 3.0


@pytest.mark.parametrize("tolerance", [0.0, 0.25])
def test_a_goal_beside_a_wall_is_approached_as_near_as_the_tolerance_lets(tolerance):
    world = World("wall", (0, 0, 0), (1.85, 0.3), bounds=(-1.0, -2.0, 2.0, 2.0))
    roadmap, goal = explored(world, np.zeros((1, 2))), np.array(world.goal)
    now = moment(np.zeros(2), goal)._replace(goal_tolerance=tolerance)
    route = find_route(roadmap, here(world, np.zeros(2)), now)
    if tolerance:
        assert not len(route.target) and np.hypot(*(route.path[-1] - goal)) < tolerance
        assert distance(world, route.path[-1:])[0] > RADIUS + MARGINS.preferred
        assert abs(route.path[-1, 1] - goal[1]) < 0.1
    else:
        assert route is None or len(route.target)


def split_room(door: float) -> World:
    """Start and goal in two halves of a room with a door of some width (m) between; a post hides a part of one."""
    half = 0.5 * door
    walls = [[(2.0, low), (2.1, low), (2.1, high), (2.0, high)] for low, high in ((-3.0, -half), (half, 3.0))]
    return World("split", (0, 0, 0), (4.2, 2.5), cylinders=[(-0.9, 1.5, 0.3)], polygons=walls, bounds=(-3, -3, 5, 3))


@pytest.mark.parametrize(("door", "tried", "in_vain"), [(0.8, True, True), (0.8, False, False), (0.02, True, False)])
def test_only_a_place_that_was_tried_in_vain_is_barred_in_vain(door, tried, in_vain):
    world, position = split_room(door), np.array((1.0, 0.0))
    goal = np.array(world.goal)
    roadmap = explored(world, np.array([(0.0, 0.0), (1.0, 0.0), (0.5, -1.0), (0.5, 1.0)]))
    if tried:
        places = np.array([(2.05, y) for y in np.arange(-0.4, 0.41, 0.1)])
        frontiers = roadmap.frontiers.where(np.abs(roadmap.frontiers.viewpoint[:, 0]) < 1.6)
        roadmap = dataclasses.replace(roadmap, blacklisted_probes=places, frontiers=frontiers)
    route = find_route(roadmap, here(world, position), moment(position, goal))
    assert (route is None) == (tried or door < 0.1)
    nothing_tried = dataclasses.replace(roadmap, blacklisted_probes=np.zeros((0, 2)))
    again = find_route(nothing_tried, here(world, position), moment(position, goal), doubting=True)
    assert (again is not None) == (door > 0.1)
    assert (route is None and again is not None) == in_vain
