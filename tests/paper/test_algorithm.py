"""The paper's planner, alone and in a trial."""

import dataclasses

import numpy as np
import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.footprint import disc
from drake_starnav.paper import choices, method, perceive, plan
from drake_starnav.paper.roadmap import PaperState, delete_point, generate_roadmap
from drake_starnav.paper.short_term_goal import find_shortest_sequence
from drake_starnav.planning import PlannerInput, PlannerParameters, PlannerState, PlannerStatus
from drake_starnav.scenario.scenario_file import load_scenario, parse_scenario
from drake_starnav.simulation.run import run_trial
from drake_starnav.surroundings import Observation
from drake_starnav.surroundings.perception import PerceptionSettings, PerceptionState
from drake_starnav.worlds import World
from tests.helpers.scans import MARGINS, RADIUS, cast, free_point, scattered

PARAMETERS = PlannerParameters()
SETTINGS = PerceptionSettings(MARGINS, disc(RADIUS))
OPEN = World("open", (0, 0, 0), (1.5, 0), bounds=(-1.5, -1.5, 2.5, 1.5))
GATE = World("gate", (0, 0, 0), (7.0, 0.0), cylinders=[(1.2, 0.9, 0.3), (1.2, -0.9, 0.3)])
START = PlannerState.initial(PARAMETERS, RADIUS)


def observed(world: World, x: float, y: float = 0.0, time: float = 0.0) -> Observation:
    pose = np.array((x, y, 0.0))
    scan = dataclasses.replace(cast(world, pose), time=time)
    return perceive(PerceptionState.initial(), (scan,), pose, SETTINGS).observation


def given(seen: Observation, goal: tuple[float, float]) -> PlannerInput:
    return PlannerInput(seen, seen.pose[:2], np.array(goal), seen.scan.time, PARAMETERS, MARGINS, RADIUS)


def explored(seed: int, nodes: int = 5) -> PaperState:
    """The state after a look at places in a random world."""
    rng = np.random.default_rng(seed)
    world, state = scattered(rng, discs=8, walls=6), PaperState.of(START)
    for x, y in [np.zeros(2)] + [free_point(rng, world, RADIUS + 0.05) for _ in range(nodes - 1)]:
        state = generate_roadmap(state, observed(world, x, y))
    return state


def test_a_goal_in_sight_is_approached_without_another_node() -> None:
    state = plan(START, given(observed(OPEN, 0.0), OPEN.goal))
    assert state.status is PlannerStatus.APPROACHING and state.route.exit is None and len(state.roadmap) == 1
    np.testing.assert_array_equal(state.route.path, [OPEN.goal])
    again = plan(state, given(observed(OPEN, 1.0, time=1.0), OPEN.goal))
    assert (
        len(again.roadmap) == 1
        and np.array_equal(again.route.path, state.route.path)
        and again.progress.plan_count == 1
    )


def test_a_node_is_added_on_arrival_at_the_frontier_point() -> None:
    state = plan(START, given(observed(GATE, 0.0), GATE.goal))
    assert state.status is PlannerStatus.EXPLORING and state.route.exit is not None
    place = state.route.exit[0]
    before = place - 1.2 * choices.ARRIVAL * place / np.hypot(*place)
    assert len(plan(state, given(observed(GATE, *before, time=0.5), GATE.goal)).roadmap) == 1
    arrived = plan(state, given(observed(GATE, *place, time=1.0), GATE.goal))
    assert len(arrived.roadmap) == 2 and arrived.progress.plan_count == 2
    assert not (arrived.points == place).all(axis=1).any()


def test_a_robot_that_does_not_move_deletes_its_short_term_goal_and_looks_again() -> None:
    state = plan(START, given(observed(GATE, 0.0), GATE.goal))
    late = choices.STUCK_TIME + 0.1
    stuck = plan(state, given(observed(GATE, 0.5 * choices.STUCK_DISTANCE, time=late), GATE.goal))
    assert len(stuck.roadmap) == 2 and not (stuck.points == state.route.path[0]).all(axis=1).any()
    moved = plan(state, given(observed(GATE, 1.5 * choices.STUCK_DISTANCE, time=late), GATE.goal))
    assert moved.roadmap is state.roadmap


def test_an_enclosed_robot_gives_up() -> None:
    world = World("box", (0, 0, 0), (4.0, 0.0), bounds=(-0.7, -0.7, 0.7, 0.7))
    assert plan(START, given(observed(world, 0.0), world.goal)).status is PlannerStatus.UNREACHABLE


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_frontier_points_lie_in_no_older_region(seed: int) -> None:
    state = explored(seed)
    assert len(state.roadmap) == 5 and len(state.points)
    for point, owner in zip(state.points, state.owners, strict=True):
        assert not any(region.contains(point) for region in state.roadmap.regions[:owner])
    lines = state.frontiers(RADIUS)
    np.testing.assert_allclose(lines.mean(axis=1), state.points)
    np.testing.assert_allclose(np.hypot(*(lines[:, 1] - lines[:, 0]).T), RADIUS)


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_the_path_to_the_frontier_point_of_least_length_and_straight_line_is_chosen(seed: int) -> None:
    state, goal = explored(seed), np.array((9.0, 4.0))
    here = state.roadmap.union.center[-1]
    path, arrives = find_shortest_sequence(state, here, goal)
    roadmap, points = state.roadmap, state.points
    center = roadmap.union.center
    length = np.full((5, 5), np.inf)
    for i, j in roadmap.edges:
        length[i, j] = length[j, i] = np.hypot(*(center[i] - center[j]))
    np.fill_diagonal(length, 0.0)
    for k in range(5):  # Floyd and Warshall
        length = np.minimum(length, length[:, k, None] + length[None, k, :])
    to_point = np.hypot(*(points - center[state.owners]).T)
    cost = length[-1, state.owners] + to_point + np.hypot(*(points - goal).T)
    assert not arrives
    np.testing.assert_array_equal(path[-1], points[np.argmin(cost)])
    nodes = np.vstack((center[-1], path[:-1]))
    assert all((center == node).all(axis=1).any() for node in nodes)


def test_a_deleted_frontier_point_is_not_chosen_again() -> None:
    state, goal = explored(1), np.array((9.0, 4.0))
    here = state.roadmap.union.center[-1]
    chosen = find_shortest_sequence(state, here, goal).places[-1]
    rest = delete_point(state, chosen)
    assert len(rest.points) == len(state.points) - 1
    assert not np.array_equal(find_shortest_sequence(rest, here, goal).places[-1], chosen)


def test_the_method_drives_to_a_goal_in_the_open() -> None:
    text = "world: !Obstacles {bounds: [-1, -2, 5, 2], cylinders: [[1.7, 1.2, 0.3], [1.5, -1.3, 0.3]], goal: [3.5, 0]}"
    trial = run_trial(parse_scenario(text, name="open", method="star_paper"), method="star_paper", seed=1)
    assert trial.outcome == "reached"
    assert trial.command["count"] > 0


def test_what_moves_is_scanned_like_what_stands() -> None:
    scenario = load_scenario("crowd_room", method="star_paper", overrides=["simulation.timeout=0.5"])
    assert run_trial(scenario, method="star_paper").outcome in ("timeout", "collision")


def test_the_search_begins_at_the_robot_in_each_pass() -> None:
    state, goal = explored(2), np.array((9.0, 4.0))
    here = state.roadmap.union.center[-1]
    ahead = here + 0.3 * (find_shortest_sequence(state, here, goal).places[0] - here)
    first, then = (find_shortest_sequence(state, place, goal).places for place in (here, ahead))
    np.testing.assert_array_equal(first, then)  # what is nearer by as much as was driven stays the nearest


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("robot.base=omnidirectional", "method star_paper with robot.base omnidirectional; allowed: star"),
        ("goals=[[1.0, 0.0, 0.5]]", r"goals\[0\] has a yaw with method star_paper"),
    ],
)
def test_what_it_cannot_do_is_refused(override: str, words: str) -> None:
    with pytest.raises(StarnavError, match=words):
        method(load_scenario("room", method="star_paper", overrides=[override]))


def test_a_scenario_of_another_method_is_refused() -> None:
    with pytest.raises(StarnavError, match="method is star_paper, and the scenario was loaded with star; allowed"):
        run_trial(load_scenario("room"), method="star_paper")
