"""Robots that make no progress: what is given up, what counts as blocked, and what is tried again."""

import dataclasses

import numpy as np
import pytest

from drake_starnav.lidar.laser_scan import DYNAMIC, STATIC, UNKNOWN
from drake_starnav.planning import PlannerInput, PlannerParameters, PlannerState, PlannerStatus, plan_step
from drake_starnav.planning.cost_field import BLACKLIST_RADIUS
from drake_starnav.planning.manoeuvre import Manoeuvring
from drake_starnav.planning.recovery import AVERAGED_SCANS, stall_point_ahead, too_narrow
from drake_starnav.regions import Observation
from drake_starnav.regions.star_region import scan_region
from drake_starnav.worlds.world import World
from tests.helpers.path_follower import BAFFLES, PERIOD, VAULT, drive
from tests.helpers.scans import MARGINS, RADIUS, cast, noisy
from tests.planning.test_manoeuvre import DOOR, SHAPE, body

PARAMETERS = PlannerParameters()


def test_a_robot_that_makes_no_progress_gives_up_its_target():
    states = drive(BAFFLES, PARAMETERS, steps=int(4.2 / PERIOD) + 1, speed=0.0)
    first, last = states[0], states[-1]
    assert not len(first.roadmap.blacklisted_targets) and len(last.roadmap.blacklisted_targets) == 1
    np.testing.assert_allclose(last.roadmap.blacklisted_targets[0, :2], first.target[0])
    assert len(last.roadmap) == 2 and np.hypot(*(last.target[0] - first.target[0])) > BLACKLIST_RADIUS


def test_where_it_cannot_go_on_no_region_leads_any_more():
    last = drive(BAFFLES, PARAMETERS, steps=int(4.2 / PERIOD) + 1, speed=0.0)[-1]
    (place,) = last.roadmap.stall_points
    assert RADIUS + MARGINS.preferred < np.hypot(*(place - BAFFLES.start[:2])) < RADIUS + 0.1
    ring = RADIUS * np.array([(np.cos(a), np.sin(a)) for a in np.linspace(0.0, 2.0 * np.pi, 60)])
    for region in last.roadmap.regions:
        assert not region.contains(place + ring).any()
        assert region.contains(BAFFLES.start[:2])


def test_a_robot_that_only_turns_blocks_nothing():
    last = drive(BAFFLES, PARAMETERS, steps=int(4.2 / PERIOD) + 1, speed=0.0, averted=1.0)[-1]
    assert len(last.roadmap.blacklisted_targets) == 1 and not len(last.roadmap.stall_points)


def test_a_robot_that_leaves_a_blocked_place_slowly_is_not_shut_in():
    stall_points = drive(BAFFLES, PARAMETERS, steps=int(20.0 / PERIOD), speed=0.01)[-1].roadmap.stall_points
    offset = stall_points - BAFFLES.start[:2]
    assert len(stall_points) >= 1
    assert (offset @ offset.T > 0.0).all()  # the way back from each is open


def test_a_passage_that_no_manoeuvre_gets_through_is_closed_whichever_way_the_robot_faces():
    pose = np.array((0.0, 0.05, 2.0))
    scan = cast(DOOR, pose, beams=720)
    seen = Observation(scan_region(scan, pose, SHAPE.narrow, MARGINS), scan, pose)
    now = PlannerInput(
        seen, pose[:2], np.array((1.6, 0.0)), 0.0, PARAMETERS, MARGINS, SHAPE.narrow, body=body(DOOR, pose)
    )
    first = plan_step(PlannerState.initial(PARAMETERS, SHAPE.radius), now)
    place = stall_point_ahead(first.roadmap, first.guidance.path, now)
    np.testing.assert_allclose(place, (0.55, 0.0), atol=0.08)
    assert stall_point_ahead(first.roadmap, first.guidance.path, now._replace(body=None)) is None
    shuttling, later = dataclasses.replace(first, manoeuvring=Manoeuvring(gives_up=True)), now._replace(time=0.1)
    given_up, others = plan_step(shuttling, later), plan_step(first, later)
    assert given_up.doubting and not others.doubting  # it was the only way
    assert not given_up.manoeuvring.gives_up


def test_where_the_robot_came_along_it_blocks_nothing():
    world = World("corridor", (0, 0, 0), (3.0, 0), bounds=(-1.0, -0.6, 4.0, 0.6))
    there = dataclasses.replace(drive(world, PARAMETERS, steps=300)[-1].with_new_goal(), began_with_map=False)
    back = dataclasses.replace(world, start=(3.0, 0, 0), goal=(0.0, 0.0))
    tries = iter(range(10**6))
    states = drive(
        back, PARAMETERS, 400, refused=lambda at: at[0] < 1.8 and next(tries) < int(5.0 / PERIOD), begin=there
    )
    assert next(tries) > int(5.0 / PERIOD) and len(states) < 400
    assert not len(states[-1].roadmap.stall_points) and states[-1].status is PlannerStatus.APPROACHING
    aside = dataclasses.replace(back, bounds=(-1.0, -0.6, 4.0, 2.0), goal=(2.0, 1.6))
    elsewhere = drive(aside, PARAMETERS, 400, refused=lambda at: at[1] > 0.2, begin=there)
    assert any(len(state.roadmap.stall_points) for state in elsewhere)


def test_a_passage_that_cannot_be_driven_is_left_for_another():
    wall = [[(2, low), (2.1, low), (2.1, high), (2, high)] for low, high in ((-2, -0.4), (0.4, 1.2), (2.0, 3.0))]
    world = World("doors", (0, 0, 0), (4, 0), polygons=wall, bounds=(-1, -2, 5, 3))
    states = drive(world, PARAMETERS, 900, refused=lambda place: 1.9 < place[0] < 2.2 and place[1] < 1.0)
    assert len(states) < 900 and states[-1].status is PlannerStatus.APPROACHING
    assert 1 <= len(states[-1].roadmap.stall_points) <= 3
    open_door = drive(world, PARAMETERS, 900)
    assert len(open_door) < 150 and not len(open_door[-1].roadmap.stall_points)


def test_a_passage_that_was_given_up_is_tried_again_where_nothing_else_can_help():
    wall = [[(2, low), (2.1, low), (2.1, high), (2, high)] for low, high in ((-4, -0.4), (0.4, 4))]
    posts = [(x, y, 0.2) for x in (-3.0, -1.5, 0.5) for y in (-3.0, -1.8, 1.8, 3.0)]
    world = World("door", (0, 0, 0), (4, 0), cylinders=posts, polygons=wall, bounds=(-4, -4, 5, 4))
    tries = iter(range(10**6))
    states = drive(world, PARAMETERS, 900, refused=lambda place: place[0] > 1.9 and next(tries) < int(5.0 / PERIOD))
    again = next(k for k, state in enumerate(states) if state.doubting)
    assert len(states[again - 1].roadmap.stall_points)
    assert len(states[again - 1].roadmap.frontiers) > 10  # there is more to explore, all on this side
    assert not len(states[again].roadmap.stall_points)
    assert len(states) < 900 and states[-1].status is PlannerStatus.APPROACHING


def test_a_passage_that_scans_show_open_is_never_given_up():
    wall = [[(2, low), (2.1, low), (2.1, high), (2, high)] for low, high in ((-2, -0.4), (0.4, 2))]
    world = World("door", (0, 0, 0), (4, 0), polygons=wall, bounds=(-2, -2, 5, 2))
    states = drive(world, PARAMETERS, 1200, refused=lambda place: place[0] > 1.9)
    last = states[-1]
    assert len(states) == 1200 and last.doubting and last.status is not PlannerStatus.UNREACHABLE
    rebuilt = [
        k for k in range(1, 1200) if len(states[k].roadmap.stall_points) < len(states[k - 1].roadmap.stall_points)
    ]
    assert len(rebuilt) >= 2
    for k in rebuilt:
        assert states[k].roadmap.nodes[-1].scan.time == PERIOD * k, "the latest scan is part of the rebuilt roadmap"
        assert not len(states[k].roadmap.blacklisted_targets) and not len(states[k].roadmap.blacklisted_probes)


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
@pytest.mark.parametrize("half", [0.97 * RADIUS, RADIUS + MARGINS.least])
def test_many_noisy_scans_tell_whether_the_robot_fits(make, half):
    """A robot that sways in front of a gap, straight ahead or a little aside, and then turns back."""
    path, beyond = np.array(((0.8, 0.0),)), np.column_stack((np.arange(0.85, 2.0, 0.1), np.zeros(12)))
    state = dataclasses.replace(
        PlannerState.initial(PARAMETERS, RADIUS),
        path=path,
        target=np.array((path[0], beyond[0])),
        optimistic_path=beyond,
        doubting=True,
    )
    for seed in range(5):
        rng = np.random.default_rng(seed)
        x, y = rng.uniform(0.55, 0.7), rng.uniform(-0.1, 0.1)
        looks = []
        for k in range(AVERAGED_SCANS):
            now = moment_at(make(half), np.array((x, y, 0.3 * np.sin(0.1 * k))), rng)
            looks.append(now.observation)
            assert not len(too_narrow(dataclasses.replace(state, recent=tuple(looks[:-1])), now))  # too few
        seen = dataclasses.replace(state, recent=tuple(looks))
        points = too_narrow(seen, now)
        assert bool(len(points)) == (half < RADIUS)
        assert not len(points) or abs(points[-1, 1]) < 0.05
        back = dataclasses.replace(seen, path=np.array(((-0.4, 0.0),)), optimistic_path=beyond[:0])
        for other in (back, dataclasses.replace(seen, doubting=False), dataclasses.replace(seen, target=None)):
            assert not len(too_narrow(other, now))


@pytest.mark.parametrize(("x", "sway"), [(0.88, 0.05), (0.945, 0.05), (0.945, 0.3)])
def test_noise_does_not_close_the_doorway_in_which_the_robot_stands(x, sway):
    """Few of the scans have a hit where a beam passes close to an edge, and no neighbour smooths it."""
    rng, beyond = np.random.default_rng(1), np.column_stack((np.arange(1.1, 2.0, 0.1), np.zeros(9)))
    state = dataclasses.replace(
        PlannerState.initial(PARAMETERS, RADIUS),
        path=beyond[:1],
        target=beyond[:2],
        optimistic_path=beyond,
        doubting=True,
    )
    door = wall_with_door(RADIUS + MARGINS.least)
    for k in range(300):
        now = moment_at(door, np.array((x, 0.0, sway * np.sin(0.1 * k))), rng)
        state = dataclasses.replace(state, recent=(*state.recent, now.observation)[-AVERAGED_SCANS:])
        assert not len(too_narrow(state, now))


def moment_at(world: World, pose: np.ndarray, rng: np.random.Generator) -> PlannerInput:
    """What the planner receives at a pose, with noisy ranges."""
    scan = noisy(cast(world, pose), 0.01, rng)
    seen = Observation(scan_region(scan, pose, RADIUS, MARGINS), scan, pose)
    return PlannerInput(seen, pose[:2], np.array(world.goal), 0.0, PARAMETERS, MARGINS, RADIUS)


def test_a_robot_with_reason_to_stand_gives_nothing_up():
    pause, pose = 2.5 * PARAMETERS.progress_timeout, np.array(BAFFLES.start)
    first = drive(BAFFLES, PARAMETERS, steps=1, speed=0.0)[-1]
    for interval, given_up in ((pause, False), (0.0, True)):  # without scans, or with scans that change nothing
        scan = dataclasses.replace(cast(BAFFLES, pose), time=pause)
        seen = Observation(scan_region(scan, pose, RADIUS, MARGINS), scan, pose)
        now = PlannerInput(
            seen, pose[:2], np.array(BAFFLES.goal), pause, PARAMETERS, MARGINS, RADIUS, interval=interval
        )
        after = plan_step(first, now).roadmap
        assert bool(len(after.blacklisted_targets) or len(after.stall_points)) == given_up
    world = World("corridor", (0, 0, 0), (1.0, 0), bounds=(-1.0, -0.6, 2.0, 0.6))
    arrived = drive(world, PARAMETERS, steps=400, stop=False)[-1]
    assert len(arrived.roadmap) == 1 + int(1.0 / PARAMETERS.node_spacing) and not len(arrived.roadmap.stall_points)


def waited(motion: np.ndarray | None) -> PlannerState:
    """The planner's state after its robot has not moved for longer than the progress watch allows."""
    position, goal = np.array(VAULT.start[:2]), np.array(VAULT.goal)
    pose = np.array(VAULT.start)
    scan = dataclasses.replace(cast(VAULT, pose), motion=motion)
    region = scan_region(scan, pose, RADIUS, MARGINS)
    state = PlannerState.initial(PARAMETERS, RADIUS)
    for k in range(int(2.0 * PARAMETERS.progress_timeout / PERIOD)):
        seen = Observation(region, dataclasses.replace(scan, time=PERIOD * k), pose)
        state = plan_step(state, PlannerInput(seen, position, goal, PERIOD * k, PARAMETERS, MARGINS, RADIUS))
    return state


def test_a_robot_that_gives_way_is_not_stuck() -> None:
    behind = np.arange(360) < 20  # the wall behind it is 1 m away
    assert len(waited(None).roadmap.blacklisted_targets)
    assert len(waited(np.where(behind, DYNAMIC, STATIC)).roadmap.blacklisted_targets) == 0


def test_only_what_stays_is_remembered_as_an_obstacle() -> None:
    state = waited(np.full(360, UNKNOWN))
    assert not state.roadmap.hits.tiles
    assert waited(None).roadmap.hits.tiles
