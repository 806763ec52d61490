"""The planner in a closed loop with a robot that moves along the path exactly."""

import dataclasses
import functools
from itertools import count, islice

import numpy as np
import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.laser_scan import DYNAMIC, STATIC, UNKNOWN
from drake_starnav.planning import PlannerParameters, PlannerState, PlannerStatus, plan_step
from drake_starnav.planning.monitoring import check_plan
from drake_starnav.planning.planner import is_node_due
from drake_starnav.worlds.world import World
from tests.helpers.path_follower import BAFFLES, VAULT, drive
from tests.helpers.scans import MARGINS, RADIUS, cast, distance, in_view, planner_input

PARAMETERS = PlannerParameters()


@functools.cache
def given_up() -> PlannerState:
    """The state of a planner whose goal is walled in."""
    return drive(VAULT, PARAMETERS, steps=4000)[-1]


def test_the_goal_is_reached():
    states = drive(BAFFLES, PARAMETERS, steps=700)
    assert states[-1].status is PlannerStatus.APPROACHING and states[-1].route.exit is None
    np.testing.assert_array_equal(states[-1].route.path[-1], BAFFLES.goal)
    assert states[0].status is PlannerStatus.EXPLORING and states[0].route.exit is not None
    assert len(states) < 700 and states[-1].guidance.arrives


def test_an_enclosed_goal_is_unreachable_in_finite_steps_and_stays_so():
    last = given_up()
    assert last.status is PlannerStatus.UNREACHABLE
    assert not len(last.route.path) and not len(last.guidance.path)
    assert plan_step(last, planner_input(cast(VAULT), np.zeros(3), np.zeros(2), time=1e3)) is last


def test_a_robot_that_cannot_move_waits_for_what_is_around_it_to_leave():
    """A ring of posts 1 cm off the hull, which are then taken away."""
    posts = [(0.36 * np.cos(a), 0.36 * np.sin(a), 0.1) for a in 2.0 * np.pi * np.arange(16) / 16]
    ring, free = World("ring", (0, 0, 0), (2, 0), cylinders=posts), World("free", (0, 0, 0), (2, 0))
    state, place = PlannerState.initial(PARAMETERS, RADIUS), np.zeros(3)
    waited = int(20.0 * (PARAMETERS.progress_timeout + 2.0))
    for k in range(waited + 1):
        assert state.status is PlannerStatus.WAITING and not len(state.roadmap)
        scan = dataclasses.replace(cast(ring if k < waited else free), time=0.05 * k)
        state = plan_step(state, planner_input(scan, place, free.goal))
    assert state.status is PlannerStatus.APPROACHING


def test_a_way_is_not_given_up_while_what_bars_it_may_stand_aside():
    """The only door of a room is barred by something, part of which is not known to stand, and then by what stands."""
    walls = [(-1.5, -1.5, 0.9, -1.4), (-1.5, 1.4, 0.9, 1.5), (-1.5, -1.4, -1.4, 1.4)]
    walls += [(0.9, -1.5, 1.0, -0.5), (0.9, 0.5, 1.0, 1.5)]
    boxes = [np.array(((x, y), (u, y), (u, v), (x, v))) for x, y, u, v in walls]
    free = World("door", (0, 0, 0), (3, 0), polygons=boxes)
    barred = dataclasses.replace(free, cylinders=[(1.0, 0.0, 0.45)])

    def state_after(*states_of_door: tuple[World, int, int]) -> PlannerState:
        state, times = PlannerState.initial(PARAMETERS, RADIUS), count()
        for world, motion, scans in states_of_door:
            scan = cast(world)
            motions = np.where(np.abs(scan.bearings) < 0.1, motion, STATIC)  # the rest is taken for a wall
            scan = dataclasses.replace(scan, motion=motions)
            for time in islice(times, scans):
                now = planner_input(dataclasses.replace(scan, time=0.1 * time), np.zeros(3), free.goal)
                state = plan_step(state, now)
        return state

    for motion in (UNKNOWN, DYNAMIC):
        assert state_after((barred, motion, 200)).status is not PlannerStatus.UNREACHABLE
        known = (barred, STATIC, 3), (barred, motion, 200)
        assert state_after(*known).status is not PlannerStatus.UNREACHABLE
        assert len(state_after(*known, (free, STATIC, 1)).route.path)
    assert state_after((barred, STATIC, 200)).status is PlannerStatus.UNREACHABLE


@pytest.mark.parametrize("half", [1.7, 2.4, 3.0])
def test_a_robot_that_cannot_move_turns_to_the_only_way_that_its_lidar_has_not_seen(half):
    """It stands in a pocket, 3 cm off its walls, that is open where its lidar does not look."""
    free = RADIUS + 0.03
    walls = (
        [(-1.0, free), (1.0, free), (1.0, 1.0), (-1.0, 1.0)],
        [(-1.0, -1.0), (1.0, -1.0), (1.0, -free), (-1.0, -free)],
    )
    world = World(
        "pocket", (0, 0, 0), (-3, 0), polygons=(*walls, [(free, -free), (1.0, -free), (1.0, free), (free, free)])
    )
    state, yaw = PlannerState.initial(PARAMETERS, RADIUS), 0.0
    for k in range(60):
        pose = np.array((0.0, 0.0, yaw))
        scan = dataclasses.replace(cast(world, pose, angle_min=-half, angle_increment=half / 180), time=0.05 * k)
        state = plan_step(state, planner_input(scan, pose, world.goal))
        for x, y in state.guidance.path[:1].tolist():
            if np.hypot(x, y) > 0.01:
                yaw += np.clip(np.remainder(np.arctan2(y, x) - yaw + np.pi, 2.0 * np.pi) - np.pi, -0.1, 0.1)
    assert len(state.route.path) and np.cos(yaw) < -0.9


def fenced(gap: float) -> World:
    """A goal among poles with gaps of some width between their surfaces, m."""
    number, radius = 16, 0.02
    around = 0.5 * (gap + 2.0 * radius) / np.sin(np.pi / number)
    angle = np.linspace(0.0, 2.0 * np.pi, number, endpoint=False)
    poles = np.column_stack((4.2 + around * np.cos(angle), around * np.sin(angle), np.full(number, radius)))
    return World("fenced", (0.0, 0.0, 0.0), (4.2, 0.0), cylinders=poles, bounds=(-1.0, -3.0, 7.0, 3.0))


@pytest.mark.parametrize(
    ("gap", "noise"), [(0.46, 0.0), (2.0 * 0.97 * RADIUS, 0.01), (2.0 * (RADIUS + MARGINS.least), 0.01)]
)
def test_only_a_goal_behind_gaps_narrower_than_the_robot_is_given_up_and_that_soon(gap, noise):
    """The narrowest gap that it fits through and the widest that it does not differ by less than two deviations."""
    world, noisy = fenced(gap), (noise, np.random.default_rng(1))
    states = drive(world, PARAMETERS, 1500, refused=lambda at: distance(world, at[None])[0] < RADIUS, noise=noisy)
    assert (states[-1].status is PlannerStatus.UNREACHABLE) == (gap < 2.0 * RADIUS)
    assert noise or (len(states) < 900 and len(states[-1].roadmap) < 60)


def test_nodes_are_added_every_node_spacing():
    world = World("corridor", (0, 0, 0), (4.0, 0), bounds=(-1.0, -0.6, 5.0, 0.6))
    states = drive(world, PARAMETERS, steps=200)
    centers = states[-1].roadmap.union.center
    assert len(centers) == 1 + int(4.0 / PARAMETERS.spacing(RADIUS))
    assert (np.hypot(*np.diff(centers, axis=0).T) > PARAMETERS.spacing(RADIUS)).all()


def test_with_a_map_from_an_earlier_goal_nodes_are_added_only_where_something_is_new():
    world = World("corridor", (0, 0, 0), (6.0, 0), bounds=(-1.0, -0.6, 20.0, 0.6))
    there = drive(world, PARAMETERS, steps=300)[-1].with_new_goal()
    assert there.progress.began_with_map and there.status is PlannerStatus.WAITING and there.route.exit is None
    back = dataclasses.replace(world, start=(6.0, 0, 0), goal=(0.0, 0.0))
    again = drive(back, PARAMETERS, steps=300, begin=there)
    assert again[-1].status is PlannerStatus.APPROACHING and len(again[-1].roadmap) == len(there.roadmap)
    unmapped_begin = dataclasses.replace(there, progress=there.progress._replace(began_with_map=False))
    unmapped = drive(back, PARAMETERS, steps=300, begin=unmapped_begin)
    assert len(unmapped[-1].roadmap) > len(there.roadmap) + 5
    onward = dataclasses.replace(world, start=(0.0, 0, 0), goal=(18.0, 0.0))
    beyond = drive(onward, PARAMETERS, steps=700, begin=again[-1].with_new_goal())[-1]
    assert len(beyond.roadmap) > len(there.roadmap) + 5
    assert (beyond.roadmap.union.center[len(there.roadmap) :, 0] > 5.0).all()


def test_a_robot_that_stood_until_it_got_a_new_goal_has_not_stalled():
    before = given_up()
    node = before.roadmap.nodes[-1]
    later = dataclasses.replace(node.scan, time=node.scan.time + 60.0)
    state = plan_step(before.with_new_goal(), planner_input(later, node.pose, (-0.5, 1.0)))
    assert state.status is PlannerStatus.APPROACHING and len(state.roadmap) == len(before.roadmap)


@pytest.mark.parametrize("left", [1, 3])
def test_where_no_way_was_left_what_is_seen_now_counts(left):
    """The walls about the goal have been taken away, but for one that hides nothing from the robot."""
    before = given_up()
    position = before.roadmap.union.center[-1]
    opened = dataclasses.replace(VAULT, start=(*position, 0.0), polygons=VAULT.polygons[left : left + 1])
    states = drive(opened, PARAMETERS, steps=600, begin=before.with_new_goal())
    assert states[-1].status is PlannerStatus.APPROACHING and len(states) < 600


def test_what_a_new_scan_contradicts_makes_a_node_where_nothing_else_is_new():
    world = World("corridor", (0, 0, 0), (2.0, 0), bounds=(-1.0, -0.6, 4.0, 0.6))
    there = drive(world, PARAMETERS, steps=1)[-1]
    there = dataclasses.replace(there, progress=there.progress._replace(began_with_map=True))
    pose = np.array((1.0, 0.0, 0.0))
    for walls, nodes in ((world.bounds, 1), ((-1.0, -0.6, 3.0, 0.6), 2)):
        scan = cast(dataclasses.replace(world, bounds=walls), pose)
        now = planner_input(scan, pose, world.goal, time=1.0)
        region = now.observation.region
        assert not is_node_due(there, region, check_plan(there, region, now), is_spaced=True)
        after = plan_step(there, now)
        assert len(after.roadmap) == nodes and after.progress.node_position.tolist() == [1.0, 0.0]
        assert bool(after.roadmap.regions[0].contains(np.array((3.5, 0.0)))) == (nodes == 1)


def test_a_gap_narrower_than_the_margin_is_passed_without_rebuilding_the_roadmap():
    half = RADIUS + 0.6 * MARGINS.preferred
    assert MARGINS.least < half - RADIUS < MARGINS.preferred
    walls = ([(2, -2), (2.1, -2), (2.1, -half), (2, -half)], [(2, half), (2.1, half), (2.1, 2), (2, 2)])
    world = World("gap", (0, 0, 0), (4, 0), polygons=walls, bounds=(-1, -2, 5, 2))
    states = drive(world, PARAMETERS, steps=700)
    assert len(states) < 700 and not states[-1].is_retrying
    assert not len(states[-1].roadmap.closures.failed_places)
    margins = [region.margin for region in states[-1].roadmap.regions]
    assert MARGINS.least - 1e-9 < min(margins) < max(margins) == MARGINS.preferred


def test_a_robot_pushed_off_its_line_of_sight_gets_a_new_path():
    state = drive(BAFFLES, PARAMETERS, steps=30)[-1]
    regions = state.roadmap.union

    def sees_its_way_point(place: np.ndarray, path: np.ndarray) -> bool:
        return in_view(regions, place, path[0])

    grid = np.linspace(-1.5, 1.5, 31)
    places = (np.array((x, y)) for x in grid for y in grid if regions.contains(np.array([(x, y)]))[0])
    place = next(place for place in places if not sees_its_way_point(place, state.route.path))
    pose = np.array((*place, 0.0))
    moved = dataclasses.replace(state, progress=state.progress._replace(node_position=place))
    after = plan_step(moved, planner_input(cast(BAFFLES, pose), pose, BAFFLES.goal, time=1.0))
    assert after.progress.plan_count == state.progress.plan_count + 1 and len(after.roadmap) == len(state.roadmap)
    assert sees_its_way_point(place, after.route.path)


def test_a_scan_with_another_number_of_beams_than_those_before_is_refused():
    state, pose = PlannerState.initial(PARAMETERS, RADIUS), np.zeros(3)
    with pytest.raises(StarnavError, match="361 beams.*360 beams.*allowed: the same number"):
        for beams in (360, 360, 361):
            state = plan_step(state, planner_input(cast(BAFFLES, pose, beams=beams), pose, BAFFLES.goal))
            pose = pose + (0.0, 2.0 * PARAMETERS.spacing(RADIUS), 0.0)
    assert len(state.roadmap) == 2
