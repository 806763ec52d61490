"""Ways that fail: where they are closed, what shows that they are too narrow, and when they are opened again."""

import dataclasses

import numpy as np
import pytest

from drake_starnav.geometry.footprint import Footprint
from drake_starnav.lidar.laser_scan import DYNAMIC, STATIC, UNKNOWN
from drake_starnav.manoeuvres.manoeuvre import plan_with_manoeuvres
from drake_starnav.planning import PlannerInput, PlannerParameters, PlannerState, PlannerStatus, plan_step, planner
from drake_starnav.planning.closures import LEAST_CLOSURE_DISTANCE, close_path, reopen_closures
from drake_starnav.planning.roadmap import CLOSURE_RADIUS, ClosedPlaces
from drake_starnav.planning.state import ManoeuvreState
from drake_starnav.surroundings import Observation
from drake_starnav.surroundings.star_region import make_scan_region
from drake_starnav.worlds.world import World
from tests.helpers.path_follower import BAFFLES, PERIOD, VAULT, drive
from tests.helpers.scans import MARGINS, RADIUS, cast, planner_input
from tests.manoeuvres.test_manoeuvre import DOOR, SHAPE, SHAPES, body

PARAMETERS = PlannerParameters()


def failed(state: PlannerState) -> np.ndarray:
    """Where ways failed, shape (k, 2), W, m."""
    return state.roadmap.closures.failed_places


@pytest.mark.parametrize(("averted", "turning"), [(1.0, 0.0), (2.0, 0.0), (np.pi - 0.1, 0.0), (1.0, 0.8), (2.0, -0.8)])
def test_a_robot_closes_its_way_unless_it_still_turns_to_it(averted: float, turning: float) -> None:
    """It may stand off its way for good: beside a wall, or with its back to it, as a holonomic one drives."""
    last = drive(BAFFLES, PARAMETERS, int(4.2 / PERIOD) + 1, speed=0.0, averted=averted, turning=turning)[-1]
    assert len(failed(last)) == (turning == 0.0)


def test_a_way_is_closed_at_its_narrowest_place_ahead():
    """In the middle of a door that lies ahead, or just ahead of the robot where there is room."""
    pose = np.zeros(3)
    for half, expected in ((0.3, (0.6, 0.0)), (1.5, (LEAST_CLOSURE_DISTANCE * RADIUS, 0.0))):
        walls = [[(0.55, low), (0.65, low), (0.65, high), (0.55, high)] for low, high in ((-2, -half), (half, 2))]
        world = World("door", (0, 0, 0), (3, 0), polygons=walls, bounds=(-1, -2, 5, 2))
        now = planner_input(cast(world, pose), pose, world.goal)
        state = plan_step(PlannerState.initial(PARAMETERS, RADIUS), now)
        after = close_path(state, np.array(((1.5, 0.0),)), now)
        np.testing.assert_allclose(failed(after), [expected], atol=0.06)
        assert not len(after.route.path) and len(after.roadmap) >= 1
        around = ring(failed(after)[0], 0.95 * CLOSURE_RADIUS * RADIUS)
        assert not after.roadmap.union.contains(around).any()
        assert not after.roadmap.closures.open_part(now.observation.region).contains(around).any()
        again = reopen_closures(after, now)
        assert again.is_retrying and not len(failed(again))
        assert again.roadmap.union.contains(failed(after)).all()


def test_of_many_exits_that_are_closed_in_one_update_none_is_the_next(monkeypatch):
    """As if the robot stood at each exit that it chooses, and hits hid what is behind it."""
    pillars = [(1.5 * np.cos(turn), 1.5 * np.sin(turn), 0.1) for turn in np.linspace(0.0, 2.0 * np.pi, 12)]
    pillars_world = World("pillars", (0, 0, 0), (9, 0), cylinders=pillars)
    now = planner_input(cast(pillars_world, np.zeros(3)), np.zeros(3), pillars_world.goal)
    state = plan_step(PlannerState.initial(PARAMETERS, RADIUS), now)
    closed_ways = []
    monkeypatch.setattr(planner, "is_at_unseen_exit", lambda *_: True)
    monkeypatch.setattr(planner, "is_probe_occluded", lambda *_: True)
    monkeypatch.setattr(planner, "close_path", lambda s, way, i: closed_ways.append(way) or close_path(s, way, i))
    monkeypatch.setattr(planner, "MOST_CLOSED", 2)
    state, route = planner.find_open_route(state, False, False, now)
    assert len(closed_ways) == len(failed(state)) == 2
    assert not any(np.array_equal(way[-len(route.beyond) :], route.beyond) for way in closed_ways)


def test_the_way_of_a_robot_that_is_no_disc_is_closed_whichever_way_it_faces():
    pose = np.array((0.0, 0.05, 2.0))
    now = moment_of(DOOR, pose, SHAPE, (1.6, 0.0))
    first = plan_with_manoeuvres(PlannerState.initial(PARAMETERS, SHAPE.radius), now)
    assert not len(failed(first)) and not first.is_retrying
    np.testing.assert_allclose(failed(close_path(first, first.guidance.path, now)), [(0.55, 0.0)], atol=0.12)
    shuttling, later = dataclasses.replace(first, manoeuvre=ManoeuvreState(has_given_up=True)), now._replace(time=0.1)
    given_up, others = plan_with_manoeuvres(shuttling, later), plan_with_manoeuvres(first, later)
    assert given_up.is_retrying and not others.is_retrying  # it was the only way
    assert not given_up.manoeuvre.has_given_up


@pytest.mark.parametrize("shape", ["T", "L", "rectangle"])
def test_a_gap_in_which_a_polygon_has_failed_is_closed_from_side_to_side(shape):
    """Wherever its narrowest disc would pass; where the robot stands in the gap's mouth, what is not at its axis."""
    robot = SHAPES[shape]
    half, pose = robot.radius - 0.02, np.array((0.2, 0.0, 0.4))
    for x in (0.2, 0.9):
        world, pose[0] = wall_with_door(half), x
        now = moment_of(world, pose, robot, world.goal)
        after = close_path(plan_step(PlannerState.initial(PARAMETERS, robot.cover_radius), now), now.goal[None], now)
        sides = np.linspace(-half + robot.cover_radius, half - robot.cover_radius, 20)
        away = np.hypot(failed(after)[:, :1] - 1.0, failed(after)[:, 1:] - sides).min(axis=0)
        assert (
            (away < CLOSURE_RADIUS * robot.cover_radius) | (np.hypot(x - 1.0, sides) < 2.0 * robot.cover_radius)
        ).all()
        assert (np.hypot(*(failed(after) - pose[:2]).T) > CLOSURE_RADIUS * robot.cover_radius).all()


def test_a_closure_into_which_the_robot_has_come_does_not_shut_it_in():
    """It is opened; the others stay, and the plan is not in doubt."""
    start = np.array(BAFFLES.start)
    now = planner_input(cast(BAFFLES, start), start, BAFFLES.goal)
    first = plan_step(PlannerState.initial(PARAMETERS, RADIUS), now)
    other = np.array((0.0, 1.2))
    closures = np.array(((0.1, 0.0), other)) + start[:2]
    roadmap = dataclasses.replace(first.roadmap, closures=ClosedPlaces(closures))
    after = plan_step(
        dataclasses.replace(first, roadmap=roadmap, route=first.route._replace(path=first.route.path[:0])),
        now._replace(time=0.1),
    )
    assert len(after.route.path) and not after.is_retrying
    np.testing.assert_array_equal(failed(after), closures[1:])
    assert not after.roadmap.union.contains(ring(closures[1], 0.95 * CLOSURE_RADIUS * RADIUS)).any()


def test_a_passage_that_cannot_be_driven_is_left_for_another():
    wall = [[(2, low), (2.1, low), (2.1, high), (2, high)] for low, high in ((-2, -0.4), (0.4, 1.2), (2.0, 3.0))]
    world = World("doors", (0, 0, 0), (4, 0), polygons=wall, bounds=(-1, -2, 5, 3))
    states = drive(world, PARAMETERS, 900, refused=lambda place: 1.9 < place[0] < 2.2 and place[1] < 1.0)
    assert len(states) < 900 and states[-1].status is PlannerStatus.APPROACHING
    assert 1 <= len(failed(states[-1])) <= 3
    open_door = drive(world, PARAMETERS, 900)
    assert len(open_door) < 150 and not len(failed(open_door[-1]))


def test_a_passage_that_was_closed_is_tried_again_where_nothing_else_can_help():
    wall = [[(2, low), (2.1, low), (2.1, high), (2, high)] for low, high in ((-4, -0.4), (0.4, 4))]
    posts = [(x, y, 0.2) for x in (-3.0, -1.5, 0.5) for y in (-3.0, -1.8, 1.8, 3.0)]
    world = World("door", (0, 0, 0), (4, 0), cylinders=posts, polygons=wall, bounds=(-4, -4, 5, 4))
    tries = iter(range(10**6))
    states = drive(world, PARAMETERS, 900, refused=lambda place: place[0] > 1.9 and next(tries) < int(5.0 / PERIOD))
    again = next(k for k, state in enumerate(states) if state.is_retrying)
    assert not len(failed(states[again])) and states[again].status is not PlannerStatus.UNREACHABLE
    assert len(states) < 900 and states[-1].status is PlannerStatus.APPROACHING


def test_a_passage_that_scans_show_open_is_never_given_up():
    wall = [[(2, low), (2.1, low), (2.1, high), (2, high)] for low, high in ((-2, -0.4), (0.4, 2))]
    world = World("door", (0, 0, 0), (4, 0), polygons=wall, bounds=(-2, -2, 5, 2))
    states = drive(world, PARAMETERS, 800, refused=lambda place: place[0] > 1.9)
    last = states[-1]
    assert len(states) == 800 and last.is_retrying and last.status is not PlannerStatus.UNREACHABLE


def ring(place: np.ndarray, radius: float) -> np.ndarray:
    angle = np.linspace(0.0, 2.0 * np.pi, 60)
    return place + radius * np.column_stack((np.cos(angle), np.sin(angle)))


def wall_with_door(half: float) -> World:
    walls = ([(1, -2), (1.1, -2), (1.1, -half), (1, -half)], [(1, half), (1.1, half), (1.1, 2), (1, 2)])
    return World("door", (0, 0, 0), (3, 0), polygons=walls, bounds=(-1, -2, 5, 2))


def poles(half: float) -> World:
    places = np.arange(-3.5, 4.0) * 2.0 * (half + 0.04)
    return World("poles", (0, 0, 0), (3, 0), cylinders=[(1.0, y, 0.04) for y in places], bounds=(-1, -2, 5, 2))


def channel(half: float) -> World:
    walls = [[(1, side * half), (3, side * half), (3, side * 2), (1, side * 2)] for side in (-1, 1)]
    return World("channel", (0, 0, 0), (4, 0), polygons=walls, bounds=(-1, -2, 5, 2))


@pytest.mark.parametrize("make", [wall_with_door, poles, channel])
def test_noise_closes_no_gap_that_the_robot_just_fits_through(make):
    """At an exit in the gap, many a scan does not see the way beyond."""
    for seed in range(3):
        rng = np.random.default_rng(seed)
        world = dataclasses.replace(make(RADIUS + MARGINS.least), start=(0.0, rng.uniform(-0.5, 0.5), 0.0))
        states = drive(world, PARAMETERS, 300, noise=(0.01, rng))
        assert len(states) < 130 and not any(len(failed(state)) or state.is_retrying for state in states)


def moment_of(world: World, pose: np.ndarray, robot: Footprint, goal: tuple[float, float]) -> PlannerInput:
    """What the planner of a robot that is no disc receives at a pose."""
    scan, radius = cast(world, pose, beams=720), robot.cover_radius
    seen = Observation(make_scan_region(scan, pose, radius, MARGINS), scan, pose)
    own = {"observation": seen, "cover_radius": radius, "manoeuvre_context": body(world, pose, robot)}
    return planner_input(scan, pose, goal, **own)


def test_a_robot_with_reason_to_stand_gives_nothing_up():
    pause, first = 2.5 * PARAMETERS.progress_timeout, drive(BAFFLES, PARAMETERS, steps=1, speed=0.0)[-1]
    pose = np.array((*BAFFLES.start[:2], np.arctan2(*first.route.path[0][::-1])))
    for interval, given_up in ((pause, False), (0.0, True)):  # without scans, or with scans that change nothing
        scan = dataclasses.replace(cast(BAFFLES, pose), time=pause)
        after = plan_step(first, planner_input(scan, pose, BAFFLES.goal, interval=interval))
        assert bool(len(failed(after))) == given_up
    world = World("corridor", (0, 0, 0), (1.0, 0), bounds=(-1.0, -0.6, 2.0, 0.6))
    arrived = drive(world, PARAMETERS, steps=400, stop=False)[-1]
    assert len(arrived.roadmap) == 1 + int(1.0 / PARAMETERS.spacing(RADIUS)) and not len(failed(arrived))


def waited(motion: np.ndarray | None) -> PlannerState:
    """The planner's state after its robot has not moved for longer than the progress watch allows."""
    scan = dataclasses.replace(cast(VAULT, np.array(VAULT.start)), motion=motion)
    state = PlannerState.initial(PARAMETERS, RADIUS)
    for k in range(int(2.0 * PARAMETERS.progress_timeout / PERIOD)):
        now = planner_input(dataclasses.replace(scan, time=PERIOD * k), VAULT.start, VAULT.goal)
        state = plan_step(state, now)
    return state


def test_a_robot_that_gives_way_is_not_stuck() -> None:
    behind = np.arange(360) < 20  # the wall behind it is 1 m away
    assert len(failed(waited(None)))
    assert not len(failed(waited(np.where(behind, DYNAMIC, STATIC))))


def test_only_what_stays_is_remembered_as_an_obstacle() -> None:
    state = waited(np.full(360, UNKNOWN))
    assert not state.roadmap.grid.tiles
    assert waited(None).roadmap.grid.tiles
