"""The paper's planner, alone and in a trial."""

import dataclasses

import numpy as np
import pytest

from drake_starnav.baselines.paper.perception import perceive
from drake_starnav.baselines.paper.planner import ARRIVAL_DISTANCE, extended, find_route, plan_step, way_ahead
from drake_starnav.control import ControllerParameters
from drake_starnav.planning import PlannerInput, PlannerParameters, PlannerState, PlannerStatus, StarRoadmap
from drake_starnav.regions import Observation
from drake_starnav.regions.perception import Perceived, PerceptionSettings
from drake_starnav.scenario import load_scenario, parse_scenario
from drake_starnav.simulation import run_trial
from drake_starnav.worlds import World
from tests.helpers.scans import RADIUS, cast, free_point, scattered

PARAMETERS = PlannerParameters()
SETTINGS = PerceptionSettings(PARAMETERS, ControllerParameters(kind="star_paper"), RADIUS)
OPEN = World("open", (0, 0, 0), (1.5, 0), bounds=(-1.5, -1.5, 2.5, 1.5))


def looked(world: World, x: float, y: float = 0.0, time: float = 0.0) -> Observation:
    pose = np.array((x, y, 0.0))
    scan = dataclasses.replace(cast(world, pose), time=time)
    return perceive(Perceived.nothing(), scan, pose, SETTINGS).observation


def now(seen: Observation, goal: tuple[float, float]) -> PlannerInput:
    return PlannerInput(seen, seen.pose[:2], np.array(goal), seen.scan.time, PARAMETERS, RADIUS)


def explored(seed: int, nodes: int = 5) -> tuple[World, StarRoadmap, Observation]:
    """A random world, a roadmap of places in it, and the last look."""
    rng = np.random.default_rng(seed)
    world, roadmap = scattered(rng, discs=8, walls=6), StarRoadmap.empty(PARAMETERS, RADIUS)
    for x, y in [np.zeros(2)] + [free_point(rng, world, RADIUS + 0.05) for _ in range(nodes - 1)]:
        seen = looked(world, x, y)
        roadmap = extended(roadmap, seen.region, seen.scan, seen.pose, RADIUS)
    return world, roadmap, seen


def test_a_goal_in_sight_is_approached_without_another_node() -> None:
    seen = looked(OPEN, 0.0)
    state = plan_step(PlannerState.initial(PARAMETERS, RADIUS), now(seen, OPEN.goal))
    assert state.status is PlannerStatus.APPROACHING and state.target is None and len(state.roadmap) == 1
    np.testing.assert_array_equal(state.path, [OPEN.goal])
    again = plan_step(state, now(looked(OPEN, 1.0, time=1.0), OPEN.goal))
    assert len(again.roadmap) == 1 and again.path is state.path and again.plans == 1


def test_a_node_is_added_on_arrival_at_the_frontier() -> None:
    world = World("wide", (0, 0, 0), (4.0, 0.0), cylinders=[(1.2, 0.9, 0.3), (1.2, -0.9, 0.3)])
    seen = looked(world, 0.0)
    state = plan_step(PlannerState.initial(PARAMETERS, RADIUS), now(seen, world.goal))
    assert state.status is PlannerStatus.EXPLORING and state.target is not None
    on_the_way = state.target[0] - 1.2 * ARRIVAL_DISTANCE * state.target[0] / np.hypot(*state.target[0])
    assert len(plan_step(state, now(looked(world, *on_the_way, time=0.5), world.goal)).roadmap) == 1
    arrived = plan_step(state, now(looked(world, *state.target[0], time=1.0), world.goal))
    assert len(arrived.roadmap) == 2 and arrived.plans == 2


def test_an_enclosed_robot_gives_up() -> None:
    world = World("box", (0, 0, 0), (4.0, 0.0), bounds=(-0.7, -0.7, 0.7, 0.7))
    state = PlannerState.initial(PARAMETERS, RADIUS)
    first = plan_step(state, now(looked(world, 0.0), world.goal))
    assert first.status is PlannerStatus.WAITING and not len(first.roadmap)  # the scan may be at fault
    late = dataclasses.replace(first, progress_position=np.zeros(2), progress_time=-PARAMETERS.progress_timeout)
    assert plan_step(late, now(looked(world, 0.0, time=0.1), world.goal)).status is PlannerStatus.UNREACHABLE


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_the_frontier_of_least_length_and_straight_line_is_chosen(seed: int) -> None:
    world, roadmap, seen = explored(seed)
    assert len(roadmap) == 5 and len(roadmap.frontiers)
    route = find_route(roadmap, seen.region, now(seen, (9.0, 4.0)))
    frontiers, position = roadmap.frontiers, seen.pose[:2]
    away = np.hypot(*(frontiers.stand - position).T) + np.hypot(*(frontiers.probe - frontiers.stand).T)
    least = away + np.hypot(*(frontiers.probe - (9.0, 4.0)).T)  # no way is shorter
    way = np.vstack((position, route.path, route.target.probe))
    cost = np.hypot(*np.diff(way, axis=0).T).sum() + np.hypot(*(route.target.probe[0] - (9.0, 4.0)))
    assert cost >= least.min() - 1e-9
    np.testing.assert_array_equal(route.path[-1], route.target.stand[0])


def test_a_way_point_is_reached_from_nearby_but_the_last_one_stays() -> None:
    path = np.array([(0.2, 0.0), (0.4, 0.0), (1.0, 0.0)])
    np.testing.assert_array_equal(way_ahead(path, np.zeros(2)), path[1:])
    np.testing.assert_array_equal(way_ahead(path[-1:], np.array((1.0, 0.0))), path[-1:])


def test_the_method_drives_to_a_goal_in_the_open() -> None:
    text = "world: !Obstacles {bounds: [-1, -2, 5, 2], cylinders: [[1.7, 1.2, 0.3], [1.5, -1.3, 0.3]], goal: [3.5, 0]}"
    trial = run_trial(parse_scenario(text, name="open", method="star_paper"), method="star_paper", seed=1)
    assert trial.outcome == "reached"
    assert trial.command["count"] > 0


def test_what_moves_is_scanned_like_what_stands() -> None:
    scenario = load_scenario("crowd_room", method="star_paper", overrides=["simulation.timeout=0.5"])
    assert run_trial(scenario, method="star_paper").outcome in ("timeout", "collision")
