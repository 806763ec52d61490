"""The planner in a closed loop with a robot that moves along the path exactly."""

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.roadmap import (
    Observation,
    PlannerParameters,
    PlannerState,
    PlannerStatus,
    fastest_step,
    plan_step,
)
from drake_starnav.roadmap.planner import node_is_due
from drake_starnav.robot import RobotParameters
from drake_starnav.scan import MOVES, STAYS, UNKNOWN
from drake_starnav.stars.region import LINE_STEP, first_cover, scan_region, segment_covered
from drake_starnav.worlds.world import World
from tests.scans import RADIUS, cast, distance

PARAMETERS = PlannerParameters()
FRONTIER_FIRST = dataclasses.replace(PARAMETERS, anticipation=False)
PERIOD = 0.05
SLACK = 0.03
"""What smoothed corners and the sampling of lines cost at most; it is the certificate that rules out contact, m."""
BAFFLES = World(
    "baffles",
    (0.0, 0.0, 0.0),
    (5.0, 1.0),
    polygons=([(1.4, -2.0), (1.6, -2.0), (1.6, 1.0), (1.4, 1.0)], [(3.2, 0.0), (3.4, 0.0), (3.4, 3.0), (3.2, 3.0)]),
    cylinders=[(4.3, -0.9, 0.3)],
    bounds=(-1.0, -2.0, 6.0, 3.0),
)
VAULT = World(
    "vault",
    (0.0, 0.0, 0.0),
    (3.0, 0.0),
    polygons=(
        [(2.2, -0.8), (3.8, -0.8), (3.8, -0.7), (2.2, -0.7)],
        [(2.2, 0.7), (3.8, 0.7), (3.8, 0.8), (2.2, 0.8)],
        [(2.1, -0.8), (2.2, -0.8), (2.2, 0.8), (2.1, 0.8)],
        [(3.8, -0.8), (3.9, -0.8), (3.9, 0.8), (3.8, 0.8)],
    ),
    bounds=(-1.0, -2.0, 5.0, 2.0),
)


def drive(
    world: World,
    parameters: PlannerParameters,
    steps: int,
    speed: float = 0.8,
    refused: Callable[[np.ndarray], bool] = lambda place: False,
    silent: bool = False,
    averted: float = 0.0,
    stop: bool = True,
    begin: PlannerState | None = None,
) -> list[PlannerState]:
    """The planner's states until the goal is reached (unless `stop` is False), it gives up, or the steps are used up.

    The robot does not move to places that are `refused`; if `silent`, all scans but the first are missing; it looks
    `averted` (rad) from its way, swaying. `begin` is the state to begin with, if it is not the first one.
    """
    position, goal = np.array(world.start[:2]), np.array(world.goal)
    state, states = begin or PlannerState.initial(parameters, RADIUS), []
    first = round(state.roadmap.scans[-1][0].time / PERIOD) + 1 if len(state.roadmap) else 0
    for k in range(first, first + steps):
        path = state.guidance.path
        way = path[0] - position if len(path) else np.array((1.0, 0.0))
        pose = np.array((*position, np.arctan2(way[1], way[0]) + averted + 0.3 * np.sin(0.1 * k)))
        if k == first or not silent:
            scan = dataclasses.replace(cast(world, pose), time=PERIOD * k)
            seen = Observation(scan_region(scan, pose, RADIUS, parameters), scan, pose)
        state = plan_step(state, seen, position, goal, PERIOD * k, parameters, RADIUS)
        states.append(state)
        if state.status is PlannerStatus.UNREACHABLE or (stop and np.hypot(*(position - goal)) < 0.05):
            break
        left = speed * PERIOD
        for point in state.guidance.path:
            offset = point - position
            away = float(np.hypot(*offset))
            step = min(left, away)
            moved = position + offset * (step / max(away, 1e-12))
            if refused(moved):
                break
            position = moved
            left -= step
        if state.roadmap.margin == parameters.margin:
            assert distance(world, position[None])[0] > RADIUS - SLACK
    return states


@pytest.mark.parametrize(
    "change",
    [{}, {"string_pulling": False}, {"cost_to_go": "straight"}, {"anticipation": False}, {"replanning": False}],
)
def test_the_goal_is_reached(change):
    states = drive(BAFFLES, dataclasses.replace(PARAMETERS, **change), steps=700)
    assert states[-1].status is PlannerStatus.APPROACHING and states[-1].target is None
    np.testing.assert_array_equal(states[-1].path[-1], BAFFLES.goal)
    assert states[0].status is PlannerStatus.EXPLORING and states[0].target is not None
    assert len(states) < 700 and states[-1].guidance.arrives


def test_a_goal_in_sight_is_approached_at_once():
    world = World("open", (0, 0, 0), (2, 0))
    states = drive(world, PARAMETERS, steps=100)
    assert {s.status for s in states} == {PlannerStatus.APPROACHING} and len(states) < 55


def test_an_enclosed_goal_is_unreachable_in_finite_steps_and_stays_so():
    parameters = dataclasses.replace(PARAMETERS, margin_rounds=1)
    states = drive(VAULT, parameters, steps=4000)
    last = states[-1]
    assert last.status is PlannerStatus.UNREACHABLE
    assert not len(last.path) and not len(last.guidance.path)
    assert last.rounds == 1 and last.roadmap.margin == pytest.approx(PARAMETERS.margin - PARAMETERS.margin_step)
    again = plan_step(last, Observation.none(), np.zeros(2), np.zeros(2), 1e3, parameters, RADIUS)
    assert again is last


def test_without_margin_shrinking_it_gives_up_earlier():
    states = drive(VAULT, dataclasses.replace(PARAMETERS, margin_shrinking=False), steps=3000)
    assert states[-1].status is PlannerStatus.UNREACHABLE
    assert states[-1].rounds == 0 and states[-1].roadmap.margin == PARAMETERS.margin


def test_equal_inputs_give_equal_states():
    one, other = (drive(BAFFLES, PARAMETERS, steps=150) for _ in range(2))
    assert len(one) == len(other)
    for a, b in zip(one, other, strict=True):
        assert (a.status, a.plans, a.rounds, len(a.roadmap)) == (b.status, b.plans, b.rounds, len(b.roadmap))
        np.testing.assert_array_equal(a.path, b.path)
        np.testing.assert_array_equal(a.roadmap.stack.values, b.roadmap.stack.values)
        np.testing.assert_array_equal(a.roadmap.frontiers.stand, b.roadmap.frontiers.stand)
        np.testing.assert_array_equal(a.roadmap.edges, b.roadmap.edges)


def test_a_robot_that_makes_no_progress_gives_up_its_target():
    states = drive(BAFFLES, PARAMETERS, steps=int(4.2 / PERIOD) + 1, speed=0.0)
    first, last = states[0], states[-1]
    assert not len(first.roadmap.retired) and len(last.roadmap.retired) == 1
    np.testing.assert_allclose(last.roadmap.retired[0, :2], first.target[0])
    assert len(last.roadmap) == 2 and np.hypot(*(last.target[0] - first.target[0])) > PARAMETERS.retired_radius


def test_where_it_cannot_go_on_no_region_leads_any_more():
    last = drive(BAFFLES, PARAMETERS, steps=int(4.2 / PERIOD) + 1, speed=0.0)[-1]
    (place,) = last.roadmap.blocked
    assert RADIUS + PARAMETERS.margin < np.hypot(*(place - BAFFLES.start[:2])) < RADIUS + 0.1
    ring = RADIUS * np.array([(np.cos(a), np.sin(a)) for a in np.linspace(0.0, 2.0 * np.pi, 60)])
    for region in last.roadmap.regions:
        assert not region.contains(place + ring).any()
        assert region.contains(BAFFLES.start[:2])


def test_a_robot_that_only_turns_blocks_nothing():
    last = drive(BAFFLES, PARAMETERS, steps=int(4.2 / PERIOD) + 1, speed=0.0, averted=1.0)[-1]
    assert len(last.roadmap.retired) == 1 and not len(last.roadmap.blocked)


def test_a_robot_that_leaves_a_blocked_place_slowly_is_not_shut_in():
    blocked = drive(BAFFLES, PARAMETERS, steps=int(20.0 / PERIOD), speed=0.01)[-1].roadmap.blocked
    offset = blocked - BAFFLES.start[:2]
    assert len(blocked) >= 1
    assert (offset @ offset.T > 0.0).all()  # the way back from each is open


def test_where_the_robot_came_along_it_blocks_nothing():
    world = World("corridor", (0, 0, 0), (3.0, 0), bounds=(-1.0, -0.6, 4.0, 0.6))
    there = dataclasses.replace(drive(world, PARAMETERS, steps=300)[-1].with_new_goal(), began_with_map=False)
    back = dataclasses.replace(world, start=(3.0, 0, 0), goal=(0.0, 0.0))
    tries = iter(range(10**6))
    states = drive(
        back, PARAMETERS, 400, refused=lambda at: at[0] < 1.8 and next(tries) < int(5.0 / PERIOD), begin=there
    )
    assert next(tries) > int(5.0 / PERIOD) and len(states) < 400
    assert not len(states[-1].roadmap.blocked) and states[-1].status is PlannerStatus.APPROACHING
    aside = dataclasses.replace(back, bounds=(-1.0, -0.6, 4.0, 2.0), goal=(2.0, 1.6))
    elsewhere = drive(aside, PARAMETERS, 400, refused=lambda at: at[1] > 0.2, begin=there)
    assert any(len(state.roadmap.blocked) for state in elsewhere)


def test_a_passage_that_cannot_be_driven_is_left_for_another():
    wall = [[(2, low), (2.1, low), (2.1, high), (2, high)] for low, high in ((-2, -0.4), (0.4, 1.2), (2.0, 3.0))]
    world = World("doors", (0, 0, 0), (4, 0), polygons=wall, bounds=(-1, -2, 5, 3))
    states = drive(world, PARAMETERS, 900, refused=lambda place: 1.9 < place[0] < 2.2 and place[1] < 1.0)
    assert len(states) < 900 and states[-1].status is PlannerStatus.APPROACHING
    assert 1 <= len(states[-1].roadmap.blocked) <= 3
    open_door = drive(world, PARAMETERS, 900)
    assert len(open_door) < 150 and not len(open_door[-1].roadmap.blocked)


def test_a_passage_that_was_given_up_is_tried_again_where_nothing_else_can_help():
    wall = [[(2, low), (2.1, low), (2.1, high), (2, high)] for low, high in ((-4, -0.4), (0.4, 4))]
    posts = [(x, y, 0.2) for x in (-3.0, -1.5, 0.5) for y in (-3.0, -1.8, 1.8, 3.0)]
    world = World("door", (0, 0, 0), (4, 0), cylinders=posts, polygons=wall, bounds=(-4, -4, 5, 4))
    tries = iter(range(10**6))
    states = drive(world, PARAMETERS, 900, refused=lambda place: place[0] > 1.9 and next(tries) < int(5.0 / PERIOD))
    again = next(k for k, state in enumerate(states) if state.rounds)
    assert len(states[again - 1].roadmap.blocked)
    assert len(states[again - 1].roadmap.frontiers) > 10  # there is more to explore, all on this side
    assert states[again].roadmap.margin == PARAMETERS.margin and not len(states[again].roadmap.blocked)
    assert len(states) < 900 and states[-1].status is PlannerStatus.APPROACHING


def test_a_robot_with_reason_to_stand_gives_nothing_up():
    unseen = drive(BAFFLES, PARAMETERS, steps=200, speed=0.0, silent=True)[-1]
    assert len(unseen.roadmap) == 1 and not len(unseen.roadmap.retired) and not len(unseen.roadmap.blocked)
    world = World("corridor", (0, 0, 0), (1.0, 0), bounds=(-1.0, -0.6, 2.0, 0.6))
    arrived = drive(world, PARAMETERS, steps=400, stop=False)[-1]
    assert len(arrived.roadmap) == 1 + int(1.0 / PARAMETERS.node_spacing) and not len(arrived.roadmap.blocked)


def test_nodes_are_added_every_node_spacing():
    world = World("corridor", (0, 0, 0), (4.0, 0), bounds=(-1.0, -0.6, 5.0, 0.6))
    states = drive(world, PARAMETERS, steps=200)
    centers = states[-1].roadmap.stack.center
    assert len(centers) == 1 + int(4.0 / PARAMETERS.node_spacing)
    assert (np.hypot(*np.diff(centers, axis=0).T) > PARAMETERS.node_spacing).all()


def test_with_a_map_from_an_earlier_goal_nodes_are_added_only_where_something_is_new():
    world = World("corridor", (0, 0, 0), (6.0, 0), bounds=(-1.0, -0.6, 20.0, 0.6))
    there = drive(world, PARAMETERS, steps=300)[-1].with_new_goal()
    assert there.began_with_map and there.status is PlannerStatus.WAITING and there.target is None
    back = dataclasses.replace(world, start=(6.0, 0, 0), goal=(0.0, 0.0))
    again = drive(back, PARAMETERS, steps=300, begin=there)
    assert again[-1].status is PlannerStatus.APPROACHING and len(again[-1].roadmap) == len(there.roadmap)
    unmapped = drive(back, PARAMETERS, steps=300, begin=dataclasses.replace(there, began_with_map=False))
    assert len(unmapped[-1].roadmap) > len(there.roadmap) + 5
    onward = dataclasses.replace(world, start=(0.0, 0, 0), goal=(18.0, 0.0))
    beyond = drive(onward, PARAMETERS, steps=700, begin=again[-1].with_new_goal())[-1]
    assert len(beyond.roadmap) > len(there.roadmap) + 5
    assert (beyond.roadmap.stack.center[len(there.roadmap) :, 0] > 5.0).all()


def test_on_the_first_way_no_map_is_known_yet():
    assert not PlannerState.initial(PARAMETERS, RADIUS).with_new_goal().began_with_map


def test_in_a_place_narrower_than_the_margin_an_earlier_node_is_enough():
    half = RADIUS + 0.5 * PARAMETERS.margin
    world = World("slot", (0, 0, 0), (0.5, 0), bounds=(-1.0, -half, 2.0, half))
    there = drive(world, PARAMETERS, steps=1)[-1].with_new_goal()
    there = dataclasses.replace(there, node_position=np.array((3.0, 0.0)))
    place = np.array((0.02, 0.01))
    scan = cast(world, np.array((*place, 0.0)))
    region = scan_region(scan, np.array((*place, 0.0)), RADIUS, PARAMETERS)
    assert not there.roadmap.regions[0].contains(place)
    assert not node_is_due(there, region, place, PARAMETERS)


def test_a_robot_that_stood_until_it_got_a_new_goal_has_not_stalled():
    given_up = drive(VAULT, dataclasses.replace(PARAMETERS, margin_shrinking=False), steps=3000)[-1]
    scan, pose = given_up.roadmap.scans[-1]
    later = dataclasses.replace(scan, time=scan.time + 60.0)
    seen = Observation(given_up.roadmap.regions[-1], later, pose)
    state = plan_step(given_up.with_new_goal(), seen, pose[:2], np.array((-0.5, 1.0)), later.time, PARAMETERS, RADIUS)
    assert state.status is PlannerStatus.APPROACHING and len(state.roadmap) == len(given_up.roadmap)


def test_a_new_goal_is_looked_for_with_the_whole_margin_again():
    parameters = dataclasses.replace(PARAMETERS, margin_rounds=1)
    given_up = drive(VAULT, parameters, steps=4000)[-1]
    assert given_up.rounds == 1 and given_up.roadmap.margin < parameters.margin
    position = given_up.roadmap.stack.center[-1]
    elsewhere = dataclasses.replace(VAULT, start=(*position, 0.0), goal=(-0.5, 1.0))
    states = drive(elsewhere, parameters, steps=400, begin=given_up.with_new_goal())
    assert states[-1].status is PlannerStatus.APPROACHING and len(states) < 400
    assert {(state.rounds, state.roadmap.margin) for state in states} == {(0, parameters.margin)}
    assert all(region.margin == parameters.margin for region in states[-1].roadmap.regions)


def test_what_a_new_scan_contradicts_makes_a_node_where_nothing_else_is_new():
    parameters = dataclasses.replace(PARAMETERS, contradiction=0.2)
    world = World("corridor", (0, 0, 0), (2.0, 0), bounds=(-1.0, -0.6, 4.0, 0.6))
    there = dataclasses.replace(drive(world, parameters, steps=1)[-1], began_with_map=True)
    place = np.array((1.0, 0.0))
    for walls, nodes in ((world.bounds, 1), ((-1.0, -0.6, 3.0, 0.6), 2)):
        scan = cast(dataclasses.replace(world, bounds=walls), np.array((*place, 0.0)))
        region = scan_region(scan, np.array((*place, 0.0)), RADIUS, parameters)
        seen = Observation(region, scan, np.array((*place, 0.0)))
        assert not node_is_due(there, region, place, parameters)
        after = plan_step(there, seen, place, np.array(world.goal), 1.0, parameters, RADIUS)
        assert len(after.roadmap) == nodes and after.node_position.tolist() == place.tolist()
        assert bool(after.roadmap.regions[0].contains(np.array((3.5, 0.0)))) == (nodes == 1)


def test_guidance_hands_on_the_path_and_the_regions():
    last = drive(BAFFLES, PARAMETERS, steps=400)[-1]
    assert last.guidance.path is last.path
    assert last.guidance.regions is last.roadmap.stack
    assert len(PlannerState.initial(PARAMETERS, RADIUS).guidance.path) == 0


def test_the_robot_turns_to_the_way_on_as_soon_as_the_latest_scan_shows_it():
    bare, states = (drive(BAFFLES, parameters, steps=700) for parameters in (FRONTIER_FIRST, PARAMETERS))
    assert not any(state.anticipated for state in bare)
    early = [state for state in states if state.anticipated]
    assert len(early) >= 5 and len(states) < len(bare)
    for state in early:
        aim = state.guidance.path[0]
        assert state.status is PlannerStatus.EXPLORING and not state.guidance.arrives
        assert (state.next_on == aim).all(axis=1).any() and len(state.guidance.regions) == 1
        assert segment_covered(*state.guidance.regions.arrays, *state.guidance.regions.center[0], *aim, LINE_STEP)
    assert states[-1].anticipated is None and states[-1].with_new_goal().anticipated is None


def test_the_robot_does_not_turn_to_a_way_on_past_a_blocked_place():
    states = drive(BAFFLES, PARAMETERS, steps=700)
    k = next(k for k in range(1, len(states)) if states[k].anticipated and states[k].plans == states[k - 1].plans)
    before, after = states[k - 1 : k + 1]
    position, aim = after.guidance.regions.center[0], after.guidance.path[0]
    pose = np.array((*position, 0.0))
    scan = cast(BAFFLES, pose)
    seen = Observation(scan_region(scan, pose, RADIUS, PARAMETERS), scan, pose)
    goal, time = np.array(BAFFLES.goal), PERIOD * k
    np.testing.assert_array_equal(
        plan_step(before, seen, position, goal, time, PARAMETERS, RADIUS).guidance.path[0], aim
    )
    barred = dataclasses.replace(before, roadmap=dataclasses.replace(before.roadmap, blocked=aim[None]))
    later = plan_step(barred, seen, position, goal, time, PARAMETERS, RADIUS)
    assert later.plans == before.plans
    assert later.anticipated is None or distance_to(later.guidance.path[0], aim) > RADIUS


def test_a_gap_narrower_than_the_margin_is_passed_without_rebuilding_the_roadmap():
    half = RADIUS + 0.6 * PARAMETERS.margin
    walls = ([(2, -2), (2.1, -2), (2.1, -half), (2, -half)], [(2, half), (2.1, half), (2.1, 2), (2, 2)])
    world = World("gap", (0, 0, 0), (4, 0), polygons=walls, bounds=(-1, -2, 5, 2))
    states = drive(world, PARAMETERS, steps=700)
    assert len(states) < 700 and states[-1].rounds == 0 and states[-1].roadmap.margin == PARAMETERS.margin
    assert min(region.margin for region in states[-1].roadmap.regions) < PARAMETERS.margin


def test_a_robot_pushed_off_its_line_of_sight_gets_a_new_path():
    state = drive(BAFFLES, PARAMETERS, steps=30)[-1]
    regions = state.roadmap.stack.arrays

    def sees_its_way_point(place: np.ndarray, path: np.ndarray) -> bool:
        return segment_covered(*regions, *place, *path[0], LINE_STEP)

    grid = np.linspace(-1.5, 1.5, 31)
    places = (np.array((x, y)) for x in grid for y in grid if first_cover(*regions, x, y) >= 0)
    place = next(place for place in places if not sees_its_way_point(place, state.path))
    pose = np.array((*place, 0.0))
    scan = cast(BAFFLES, pose)
    seen = Observation(scan_region(scan, pose, RADIUS, PARAMETERS), scan, pose)
    moved = dataclasses.replace(state, node_position=place)
    after = plan_step(moved, seen, place, np.array(BAFFLES.goal), 1.0, PARAMETERS, RADIUS)
    assert after.plans == state.plans + 1 and len(after.roadmap) == len(state.roadmap)
    assert sees_its_way_point(place, after.path)


def test_a_target_that_was_driven_to_is_seen_or_given_up():
    for world in (BAFFLES, VAULT):
        states = drive(world, PARAMETERS, steps=1500)
        changes = [
            (before.target[1], after.roadmap)
            for before, after in zip(states, states[1:], strict=False)
            if before.target is not None
            and len(after.roadmap) > len(before.roadmap)
            and after.rounds == before.rounds  # then nothing stays given up
            and distance_to(after.roadmap.stack.center[-1], before.target[0]) < PARAMETERS.arrival_distance
        ]
        assert changes
        for probe, roadmap in changes:
            assert any(r.contains(probe) for r in roadmap.regions) or (roadmap.closed == probe).all(axis=1).any()


@pytest.mark.parametrize(("step", "robot"), [(plan_step, RADIUS), (fastest_step, RobotParameters(radius=RADIUS))])
def test_a_scan_with_another_number_of_beams_than_those_before_is_refused(step, robot):
    state, pose = PlannerState.initial(PARAMETERS, RADIUS), np.zeros(3)
    with pytest.raises(StarnavError, match="361 beams.*360 beams.*allowed: the same number"):
        for beams in (360, 360, 361):
            scan = cast(BAFFLES, pose, beams=beams)
            seen = Observation(scan_region(scan, pose, RADIUS, PARAMETERS), scan, pose)
            state = step(state, seen, pose[:2], np.array(BAFFLES.goal), 0.0, PARAMETERS, robot)
            pose = pose + (2.0 * PARAMETERS.node_spacing, 0.0, 0.0)
    assert len(state.roadmap) == 2


def distance_to(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.hypot(*(a - b)))


def waited(motion: np.ndarray | None) -> PlannerState:
    """The planner's state after its robot has not moved for longer than the progress watch allows."""
    position, goal = np.array(VAULT.start[:2]), np.array(VAULT.goal)
    pose = np.array(VAULT.start)
    scan = dataclasses.replace(cast(VAULT, pose), motion=motion)
    region = scan_region(scan, pose, RADIUS, PARAMETERS)
    state = PlannerState.initial(PARAMETERS, RADIUS)
    for k in range(int(2.0 * PARAMETERS.progress_timeout / PERIOD)):
        seen = Observation(region, dataclasses.replace(scan, time=PERIOD * k), pose)
        state = plan_step(state, seen, position, goal, PERIOD * k, PARAMETERS, RADIUS)
    return state


def test_a_robot_that_gives_way_is_not_stuck() -> None:
    behind = np.arange(360) < 20  # the wall behind it is 1 m away
    assert len(waited(None).roadmap.retired)
    assert len(waited(np.where(behind, MOVES, STAYS)).roadmap.retired) == 0


def test_only_what_stays_is_remembered_as_an_obstacle() -> None:
    state = waited(np.full(360, UNKNOWN))
    assert not state.roadmap.hits.tiles
    assert waited(None).roadmap.hits.tiles
