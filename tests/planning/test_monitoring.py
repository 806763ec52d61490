"""All checks of a plan at once find what each finds alone, by plain NumPy."""

import dataclasses

import numpy as np
import pytest

from drake_starnav.geometry.polyline import measure_arc_lengths
from drake_starnav.planning import PlannerInput, PlannerParameters, PlannerState, PlannerStatus
from drake_starnav.planning.guidance import PASSED_DISTANCE
from drake_starnav.planning.impassable import bridge_observed_hits
from drake_starnav.planning.monitoring import OBSTRUCTION_SLACK, OUTSIDE_TOLERANCE, UNCERTAIN_WITHIN, check_plan
from drake_starnav.planning.roadmap import StarRoadmap
from drake_starnav.planning.state import Progress, Route
from drake_starnav.planning.string_pulling import LOOKAHEAD, find_farthest_in_sight
from drake_starnav.surroundings import StarRegion
from drake_starnav.surroundings.star_region import unite_regions
from tests.helpers.scans import MARGINS, RADIUS, cast, free_point, in_view, planner_input, wandered

PARAMETERS = PlannerParameters()


def seen_from(world, place: np.ndarray) -> tuple[StarRegion, PlannerInput]:
    pose = np.array((*place, 0.3))
    now = planner_input(cast(world, pose), pose, np.zeros(2))
    return now.observation.region, now


def state_in(rng: np.random.Generator, roadmap: StarRoadmap, position: np.ndarray) -> PlannerState:
    """A state with a plan that leads anywhere, as the checks do not mind."""
    path = position + np.cumsum(rng.uniform(-0.3, 0.3, (rng.integers(1, 4), 2)), axis=0)
    beyond = path[-1] + np.cumsum(rng.uniform(-0.1, 0.1, (40, 2)), axis=0)
    return dataclasses.replace(
        PlannerState.initial(PARAMETERS, RADIUS),
        roadmap=roadmap,
        status=PlannerStatus.EXPLORING,
        route=Route(path, np.stack((path[-1], path[-1] + rng.uniform(-1.0, 1.0, 2))), beyond),
        progress=Progress(node_position=position + (1.0, 0.0)),
    )


def test_a_check_finds_what_its_parts_find_alone() -> None:
    found: dict[str, set] = {}
    for seed in range(40):
        world, roadmap = wandered(seed, nodes=3)
        rng = np.random.default_rng(seed)
        place = roadmap.regions[0].center + rng.uniform(-2.5, 2.5, 2) if seed % 2 else free_point(rng, world, RADIUS)
        region, now = seen_from(world, place)
        state, stack = state_in(rng, roadmap, place), roadmap.union
        check = check_plan(state, region, now)
        passed = 0
        for way_point, following in zip(state.route.path[:-1], state.route.path[1:], strict=True):
            if np.hypot(*(way_point - place)) >= PASSED_DISTANCE * RADIUS and not in_view(stack, place, following):
                break
            passed += 1
        inside = stack.contains(place[None])[0]
        hits = bridge_observed_hits(now.observation, MARGINS, RADIUS)
        away = np.linalg.norm(state.route.beyond[1::2, None] - hits[None], axis=2)
        here = unite_regions([region])
        near = state.route.beyond[: 1 + int((measure_arc_lengths(state.route.beyond)[1:] < LOOKAHEAD * RADIUS).sum())]
        ahead = [k for k, point in enumerate(near) if in_view(here, place, point)]
        way = np.vstack((state.route.path, state.route.beyond))
        way = way[np.hypot(*(way - place).T) < UNCERTAIN_WITHIN * RADIUS]
        assert check.sees_probe == region.contains(state.route.exit[1])
        assert not (check.is_outside and inside)
        assert check.is_blocked == bool((away < RADIUS - OBSTRUCTION_SLACK * RADIUS).any())
        assert check.passed_count == passed
        assert check.has_strayed == (inside and not in_view(stack, place, state.route.path[passed]))
        assert check.is_uncertain == bool((roadmap.grid.distance(way) < RADIUS).any())
        assert find_farthest_in_sight(state.route.beyond, *place, region.as_union, RADIUS) == max(ahead, default=-1)
        for name, value in check._asdict().items():
            found.setdefault(name, set()).add(value)
    assert all(len(values) > 1 for values in found.values()), found


def test_what_is_too_early_or_not_wanted_is_not_checked() -> None:
    world, roadmap = wandered(1, nodes=3)
    place = roadmap.regions[0].center
    region, now = seen_from(world, place)
    rng = np.random.default_rng(0)
    hits = bridge_observed_hits(now.observation, MARGINS, RADIUS)
    state = dataclasses.replace(
        state_in(rng, roadmap, place), route=Route(place[None] + (0.1, 0.0), np.stack((place, place)), hits[:4])
    )
    check = check_plan(state, region, now)
    assert check.sees_probe and check.is_blocked
    assert not check_plan(dataclasses.replace(state, progress=Progress(node_position=place)), region, now).sees_probe
    assert not check_plan(dataclasses.replace(state, route=state.route._replace(start=place)), region, now).is_blocked


@pytest.mark.parametrize("beyond", [0.5, 2.0])
def test_a_robot_is_outside_when_it_is_farther_out_than_the_tolerance(beyond: float) -> None:
    world, roadmap = wandered(2, nodes=1)
    region = roadmap.regions[0]
    k = int(np.argmin(np.abs(np.diff(region.boundary.values))))
    bearing = region.bearing_0 + 2.0 * np.pi * (k + 0.5) / len(region.boundary.values)
    distance = region.boundary.values[k : k + 2].min() + beyond * OUTSIDE_TOLERANCE * RADIUS
    place = region.center + distance * np.array((np.cos(bearing), np.sin(bearing)))
    here, now = seen_from(world, place)
    state = state_in(np.random.default_rng(0), roadmap, place)
    assert check_plan(state, here, now).is_outside == (beyond > 1.0)
