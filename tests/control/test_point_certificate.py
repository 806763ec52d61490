"""The theorem of the certificate against points, and what it lets through that the safety star does not."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_starnav.control.heading_controller import limited_twist
from drake_starnav.control.parameters import ControllerParameters
from drake_starnav.control.point_certificate import (
    ESCAPE_CLEARANCE,
    ESCAPE_GAIN,
    ESCAPE_SLACK,
    KnownHits,
    clear_twist,
    keeps_clear,
    needed_distances,
)
from drake_starnav.regions.erosion import smoothed_distances
from drake_starnav.regions.parameters import StarParameters
from drake_starnav.regions.safe_region import SafetyStar, ScanMemory, safety_star
from drake_starnav.robot import RobotParameters
from drake_starnav.worlds.world import World
from tests.helpers.motions import certified, least_clearance, motion
from tests.helpers.scans import RADIUS, cast, distance, free_point, scattered, seeds

ROBOT = RobotParameters()
LIMITS = ROBOT.limits
SPEEDS, ACCELERATIONS = np.array(LIMITS[:2]), np.array(LIMITS[2:])
PARAMETERS = ControllerParameters(certified_by="points", safety_margin=0.005, margin_per_speed=0.02)
PERIOD = 1.0 / PARAMETERS.rate
REACH, STARS = 2.0, StarParameters()
NOWHERE = np.zeros(2)


def sensed(world: World, pose: np.ndarray, memory: ScanMemory, reach: float = REACH) -> tuple[SafetyStar, ScanMemory]:
    scan = cast(world, pose, beams=720)
    memory = memory.remembered(scan, pose, reach, 7, 0.15)
    return safety_star(memory, scan, smoothed_distances(scan, STARS), pose, RADIUS, reach, STARS), memory


def hits_only(points: list[tuple[float, float]]) -> SafetyStar:
    hits = np.array(points, dtype=float).reshape(-1, 2)
    return SafetyStar(np.zeros(2), 0.0, np.full(8, REACH), hits, hits, np.zeros(len(hits)), seen=True)


def simulated(pose: np.ndarray, twist: np.ndarray, target: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
    """Poses every millisecond of a robot that ramps continuously to the target twist, and its last twist."""
    poses, step = [], 1e-3
    for _ in range(round(time / step)):
        after = twist + np.clip(target - twist, -step * ACCELERATIONS, step * ACCELERATIONS)
        v, omega = 0.5 * (twist + after)
        middle = pose[2] + 0.5 * omega * step
        pose = pose + step * np.array((v * math.cos(middle), v * math.sin(middle), omega))
        twist = after
        poses.append(pose)
    return np.array(poses), twist


@settings(max_examples=60)
@given(seeds)
def test_an_accepted_command_and_full_braking_keep_their_distance(seed):
    rng = np.random.default_rng(seed)
    world = scattered(rng, discs=14, walls=8)
    pose = np.array((*free_point(rng, world, RADIUS + 0.005), rng.uniform(-4.0, 4.0)))
    star, _ = sensed(world, pose, ScanMemory())
    twist, wanted = (rng.uniform((0.0, -LIMITS.max_yaw_rate), SPEEDS) for _ in range(2))
    heading = rng.uniform(-4.0, 4.0)
    direction = np.array((math.cos(heading), math.sin(heading)))
    *tried, accepted = clear_twist(pose, twist, wanted, direction, star, PARAMETERS, ROBOT)
    if not accepted:
        return
    held, at_end = simulated(pose, twist, np.array(tried), PERIOD)
    braked, standing = simulated(held[-1], at_end, np.zeros(2), 1.0)
    np.testing.assert_allclose(standing, 0.0, atol=1e-9)
    path = np.vstack((pose, held, braked))[:, :2]
    assert np.hypot(*np.moveaxis(path[::3, None] - star.hits, -1, 0)).min() >= RADIUS


@settings(max_examples=60)
@given(seeds, st.sampled_from([PERIOD, 0.1, 0.3]), st.sampled_from([0.0, 0.02]))
def test_the_least_clearance_is_that_of_the_braking_path(seed, hold, delay):
    rng = np.random.default_rng(seed)
    hits, gaps = rng.uniform(-1.5, 1.5, (60, 2)), rng.uniform(0.0, 0.07, 60)
    needed = needed_distances(gaps, RADIUS)
    pose, twist = np.array((0.0, 0.0, rng.uniform(-4.0, 4.0))), rng.uniform(-SPEEDS, SPEEDS)
    desired = rng.uniform(-SPEEDS, SPEEDS)
    away = least_clearance(motion(pose, twist, desired, hold, LIMITS, delay), hits, needed)
    known = KnownHits(hits, needed, np.zeros(2), np.inf)
    kept, missed = -1.0, 3.0
    while missed - kept > 1e-13:
        middle = 0.5 * (kept + missed)
        if keeps_clear(*pose, *twist, *desired, hold, delay, LIMITS, known, middle):
            kept = middle
        else:
            missed = middle
    assert kept == pytest.approx(away, abs=1e-12)


def recklessly_driven(
    seed: int, robot: RobotParameters = ROBOT, every: int = 2, reach: float = REACH
) -> tuple[float, float]:
    """10 s of random commands through the certificate: least distance to an obstacle, and the way driven, m.

    Args:
        seed: of the world and the commands.
        robot: its limits.
        every: so many periods lie between two scans.
        reach: hits within it are known, m.
    """
    rng = np.random.default_rng(seed)
    world = scattered(rng, discs=14, walls=8)
    pose, memory, twist = np.array((0.0, 0.0, rng.uniform(-4.0, 4.0))), ScanMemory(), np.zeros(2)
    least, driven, heading = np.inf, 0.0, 0.0
    for k in range(500):
        if k % every == 0:
            star, memory = sensed(world, pose, memory, reach)
        if rng.random() < 0.03:
            heading = rng.uniform(-4.0, 4.0)
        error = (heading - pose[2] + math.pi) % (2.0 * math.pi) - math.pi
        wanted = np.array((robot.max_speed * max(math.cos(error), 0.0), np.clip(4.0 * error, -2.0, 2.0)))
        direction = np.array((math.cos(heading), math.sin(heading)))
        v, omega, _ = clear_twist(pose, twist, wanted, direction, star, PARAMETERS, robot)
        commanded = limited_twist(twist, np.array((v, omega)), robot, PERIOD)
        poses, twist = simulated(pose, twist, commanded, PERIOD)
        driven += float(np.hypot(*np.diff(poses[:, :2], axis=0).T).sum())
        pose = poses[-1]
        least = min(least, distance(world, poses[:, :2]).min())
    return least, driven


@pytest.mark.parametrize("seed", range(8))
def test_a_reckless_driver_never_touches_anything(seed):
    least, driven = recklessly_driven(seed)
    assert least >= RADIUS
    assert driven > 0.5


@pytest.mark.parametrize("seed", range(8))
def test_a_fast_reckless_driver_with_rare_and_short_scans_never_touches_anything(seed):
    least, driven = recklessly_driven(seed, RobotParameters(max_speed=1.5), every=40, reach=1.2)
    assert least >= RADIUS
    assert driven > 0.5


def test_what_lies_beyond_the_hits_that_are_known_certifies_no_motion():
    post = World("post", (0, 0, 0), (3, 0), cylinders=[(2.5, 0.0, 0.1)])
    star, _ = sensed(post, np.zeros(3), ScanMemory())
    assert star.reach == REACH
    ahead, pose = np.array((0.8, 0.0)), np.array((1.3, 0.0, 0.0))  # it brakes within 0.32 m
    assert clear_twist(pose, ahead, ahead, np.array((1.0, 0.0)), star, PARAMETERS, ROBOT)[2]
    pose = np.array((1.45, 0.0, 0.0))
    assert not clear_twist(pose, ahead, ahead, np.array((1.0, 0.0)), star, PARAMETERS, ROBOT)[2]


def test_a_winding_gap_that_the_star_refuses():
    """Most of a turn about a pillar keeps its distance, but leaves the sight of where the scan was taken."""
    world = World("pillar", (0, 0, 0), (1, 1), cylinders=[(0.0, 0.5, 0.05)])
    pose, arc = np.zeros(3), np.array((0.5, 1.0))
    star, _ = sensed(world, pose, ScanMemory())
    needed = needed_distances(star.half_gaps, RADIUS)
    assert least_clearance(motion(pose, arc, arc, 2.5, LIMITS), star.hits, needed) > 0.15
    assert not certified(pose, arc, arc, 2.5, LIMITS, star)


def test_the_desired_twist_passes_where_nothing_is_near():
    star = hits_only([(9.0, 9.0)])
    assert clear_twist(np.zeros(3), NOWHERE, np.array((0.8, 1.0)), np.array((1.0, 0.0)), star, PARAMETERS, ROBOT) == (
        0.8,
        1.0,
        True,
    )


def test_nothing_seen_certifies_nothing():
    result = clear_twist(
        np.zeros(3), NOWHERE, np.array((0.8, 0.0)), np.array((1.0, 0.0)), SafetyStar.none(), PARAMETERS, ROBOT
    )
    assert result == (0.0, 0.0, False)


def test_between_two_hits_of_a_surface_the_disc_stays_off_their_chord():
    away = needed_distances(np.array([0.0, 0.07]), RADIUS)
    np.testing.assert_allclose(away, [RADIUS, math.hypot(RADIUS, 0.07)])


@pytest.mark.parametrize(("delay", "way"), [(0.5, 0.4 + 0.4 + 0.32), (0.0, 0.4 + 0.32)])
def test_what_lies_at_the_end_of_a_long_way_counts(delay, way):
    """The delay, half a second of driving on, and braking, to a post ahead."""
    parameters, ahead = dataclasses.replace(PARAMETERS, rate=2.0, delay=delay), np.array((0.8, 0.0))
    speeds = [
        clear_twist(np.zeros(3), ahead, ahead, np.array((1.0, 0.0)), hits_only([(x, 0.0)]), parameters, ROBOT)[0]
        for x in (RADIUS + way - 0.07, RADIUS + way + 0.08)
    ]
    assert speeds[0] < speeds[1] == 0.8


@pytest.mark.parametrize(("clearance", "speed"), [(0.0215, 0.8), (0.0155, 0.48), (0.0095, 0.2)])
def test_along_a_wall_the_margin_grows_with_the_speed(clearance, speed):
    wall = [(x, -RADIUS - clearance) for x in np.linspace(-2.0, 2.0, 801)]
    ahead = np.array((0.8, 0.0))
    v, omega, _ = clear_twist(np.zeros(3), NOWHERE, ahead, np.array((1.0, 0.0)), hits_only(wall), PARAMETERS, ROBOT)
    assert (v, omega) == (pytest.approx(speed), 0.0)


@pytest.mark.parametrize(
    ("clearance", "wanted", "per_speed", "speed"), [(0.0081, 0.8, 0.02, 0.12), (0.00502, 0.05, 0.0, 0.05)]
)
def test_off_a_turn_into_a_wall_the_lattice_is_as_careful(clearance, wanted, per_speed, speed):
    """It drives straight on, no faster than was wanted."""
    parameters = dataclasses.replace(PARAMETERS, rate=4.0, margin_per_speed=per_speed)
    wall = [(x, -RADIUS - clearance) for x in np.linspace(-2.0, 2.0, 801)]
    v, omega, accepted = clear_twist(
        np.zeros(3), NOWHERE, np.array((wanted, -2.0)), np.array((1.0, 0.0)), hits_only(wall), parameters, ROBOT
    )
    assert (v, omega, accepted) == (pytest.approx(speed), 0.0, True)


@settings(max_examples=150)
@given(seeds, st.sampled_from([0.0, 0.1]))
def test_who_is_within_the_margin_gains_clearance_and_never_loses_the_last_of_it(seed, delay):
    rng = np.random.default_rng(seed)
    angle, away = rng.uniform(-math.pi, math.pi, 4), RADIUS + rng.uniform(0.0025, 0.012, 4)
    away[0] = RADIUS + rng.uniform(0.0025, 0.0045)
    star = hits_only(list(zip(away * np.cos(angle), away * np.sin(angle), strict=True)))
    parameters, twist = dataclasses.replace(PARAMETERS, rate=10.0, delay=delay), np.array((rng.uniform(-0.04, 0.04), 0))
    *tried, accepted = clear_twist(
        np.zeros(3), twist, np.array((0.8, 0.0)), np.array((1.0, 0.0)), star, parameters, ROBOT
    )
    if accepted:
        needed = needed_distances(star.half_gaps, RADIUS)
        path = motion(np.zeros(3), twist, np.array(tried), 0.1, LIMITS, delay)
        now = least_clearance(path[:1], star.hits, needed)
        assert least_clearance(path, star.hits, needed) >= max(now - ESCAPE_SLACK, ESCAPE_CLEARANCE) - 1e-12
        assert delay or least_clearance(path[-1:], star.hits, needed) >= now + ESCAPE_GAIN - 1e-12


def test_a_blocked_robot_turns_to_where_it_can_go():
    """A wall ahead, the guiding vector along it: the lattice turns the robot, the straight line being refused."""
    wall = [(RADIUS + 0.0055, y) for y in np.linspace(-1.0, 1.0, 101)]
    v, omega, accepted = clear_twist(
        np.zeros(3), NOWHERE, np.array((0.8, 0.0)), np.array((0.0, 1.0)), hits_only(wall), PARAMETERS, ROBOT
    )
    assert accepted and v <= 0.3 and omega > 0.0


def test_a_robot_inside_its_margin_backs_off():
    wall = [(RADIUS + 0.003, y) for y in np.linspace(-1.0, 1.0, 101)]
    v, _, accepted = clear_twist(
        np.zeros(3), NOWHERE, np.array((0.8, 0.0)), np.array((1.0, 0.0)), hits_only(wall), PARAMETERS, ROBOT
    )
    assert accepted and v < 0.0


def test_a_robot_that_drives_brakes_before_it_looks_for_a_way_out():
    """A wall behind it, within its margin."""
    wall, ahead = [(-RADIUS - 0.003, y) for y in np.linspace(-1.0, 1.0, 101)], np.array((1.0, 0.0))
    for speed, escapes in ((0.0, True), (0.1, False)):
        twist = np.array((speed, 0.0))
        result = clear_twist(np.zeros(3), twist, np.array((0.8, 0.0)), ahead, hits_only(wall), PARAMETERS, ROBOT)
        assert (result[0] > 0.0, result[2]) == (escapes, escapes)


def test_a_robot_that_has_nowhere_to_go_looks_for_no_way_round():
    wall = [(RADIUS + 0.0055, y) for y in np.linspace(-1.0, 1.0, 101)]
    wanted = np.array((0.8, 0.0))
    result = clear_twist(np.zeros(3), NOWHERE, wanted, NOWHERE, hits_only(wall), PARAMETERS, ROBOT)
    assert result == (0.0, 0.0, False)


def test_hemmed_in_on_all_sides_it_stands():
    ring = [((RADIUS + 0.003) * math.cos(a), (RADIUS + 0.003) * math.sin(a)) for a in np.linspace(0.0, 6.28, 200)]
    v, _, accepted = clear_twist(
        np.zeros(3), NOWHERE, np.array((0.8, 0.0)), np.array((1.0, 0.0)), hits_only(ring), PARAMETERS, ROBOT
    )
    assert (v, accepted) == (0.0, False)


@pytest.mark.parametrize(("rate", "max_speed"), [(50.0, 0.8), (2.0, 0.8), (4.0, 2.0)])
def test_a_move_out_of_a_pocket_is_certified_for_as_long_as_it_is_held(rate, max_speed):
    """4 mm from a wall behind and 34 mm from one ahead."""
    parameters, robot = dataclasses.replace(PARAMETERS, rate=rate), RobotParameters(max_speed=max_speed)
    walls = [(x, y) for x in (-RADIUS - 0.004, RADIUS + 0.034) for y in np.linspace(-1.0, 1.0, 101)]
    star = hits_only(walls)
    *tried, accepted = clear_twist(
        np.zeros(3), NOWHERE, np.array((0.8, 0.0)), np.array((1.0, 0.0)), star, parameters, robot
    )
    assert accepted == (tried[0] > 0.0)
    needed = needed_distances(star.half_gaps, RADIUS)
    path = motion(np.zeros(3), NOWHERE, np.array(tried), 1.0 / rate, robot.limits)
    assert least_clearance(path, star.hits, needed) > 0.0
    assert accepted or rate < 10.0


@pytest.mark.parametrize(("acceleration", "turns"), [(1.0, True), (0.05, False)])
def test_a_robot_turns_where_nothing_is_certified_only_if_it_stops_at_once(acceleration, turns):
    robot = RobotParameters(max_acceleration=acceleration)
    star = hits_only([(RADIUS + 0.003, 0.0), (-RADIUS - 0.003, 0.0)])
    v, omega, accepted = clear_twist(
        np.zeros(3), np.array((0.049, 0.0)), np.array((0.8, 2.0)), np.array((0.0, 1.0)), star, PARAMETERS, robot
    )
    assert (v, accepted, omega != 0.0) == (0.0, False, turns)
