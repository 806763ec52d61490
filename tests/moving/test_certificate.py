"""The theorem of the certificate in time: whatever moves no faster than declared never touches a robot that moves."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_starnav.geometry.footprint import disc, find_top_speed, footprint
from drake_starnav.geometry.trajectory import STANDING
from drake_starnav.moving.certificate import (
    ESCAPE,
    MOVING_MARGIN,
    STANDING_SPEED,
    MovingCertificate,
    find_reachable_discs,
)
from drake_starnav.moving.kalman_tracks import SETTLED_AFTER, Tracks
from drake_starnav.moving.parameters import DynamicObstacleParameters
from drake_starnav.moving.prediction import OCCLUSION_SPACING, add_radius
from drake_starnav.moving.tracker import TrackedObstacles
from drake_starnav.robot import BASES, Limits, RobotParameters
from drake_starnav.robot.base import convert_to_twist
from drake_starnav.robot.motion import Actuation, Motion, Pose, advance_pose, convert_to_velocity, roll_out
from drake_starnav.safety.shield import make_braking_twist
from drake_starnav.worlds.moving_obstacles import MovingObstacles, compute_moving_obstacle_clearance
from tests.helpers.motions import limited_twist
from tests.helpers.scans import RADIUS, seeds
from tests.helpers.scenes import moved

ROBOT = RobotParameters()
LIMITS = ROBOT.limits
OBSTACLES = DynamicObstacleParameters(max_speed=0.8, caution=1.0)
MARGIN = 0.01
MARGIN_M, ESCAPE_M = MOVING_MARGIN * RADIUS, ESCAPE * RADIUS
PERIOD, SCANS, STEP = 0.02, 3, 0.005
"""Of the commands, s; commands from one scan to the next; of the simulation, s."""


def rim(centers: np.ndarray, radius: float) -> np.ndarray:
    """Hits all around discs."""
    angle = np.linspace(0.0, 2.0 * math.pi, 60, endpoint=False)
    return (centers[:, None] + radius * np.column_stack((np.cos(angle), np.sin(angle)))).reshape(-1, 2)


def seen(centers: np.ndarray, radius: float, time: float = 0.0) -> Tracks:
    """Hits of which nothing else is known."""
    hits = rim(centers, radius)
    return Tracks(time=time, hits=add_radius(hits, 0.0), hit_track=np.full(len(hits), -1))


def stays_clear(pose, twist, desired, certificate: MovingCertificate, hold: float = PERIOD, delay: float = 0.0) -> bool:
    """Whether the certificate accepts what follows from a command."""
    return certificate.accepts(roll_out(pose, twist, desired, Actuation(LIMITS, disc(RADIUS), hold, delay)))


def test_a_motion_at_no_place_is_refused() -> None:
    ahead = find_reachable_discs(seen(np.array([(1.0, 0.0)]), 0.3), OBSTACLES)
    certificate, nowhere = MovingCertificate(ahead, MARGIN, 0.0), np.array((math.nan, 0.0, 0.0))
    assert not stays_clear(nowhere, np.array((0.5, 0.0)), np.array((0.5, 0.0)), certificate)


BODIES = {
    "disc": disc(RADIUS),
    "carrier": footprint(((-0.4, -0.25), (0.4, -0.25), (0.4, 0.25), (-0.4, 0.25))),
    "behind its axis": footprint(((-0.7, -0.2), (0.1, -0.2), (0.1, 0.2), (-0.7, 0.2))),
    "tee": footprint((((-0.3, -0.1), (0.2, -0.1), (0.2, 0.1), (-0.3, 0.1)), ((0.15, -0.4), (0.3, -0.4), (0.3, 0.4)))),
}


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("name", BODIES)
@settings(max_examples=25, deadline=None)
@given(seed=seeds, hunters=st.booleans())
def test_discs_within_the_declared_speed_never_touch_a_point_of_a_robot_that_moves(
    name: str, base: str, seed: int, hunters: bool
) -> None:
    """The driver likes to turn on the spot; whatever moves comes for the robot, or goes anywhere."""
    rng, shape, robot = np.random.default_rng(seed), BODIES[name], RobotParameters(base=base)
    margin, escape = [(MARGIN, 0.0), (MARGIN, 0.5 * MARGIN), (MARGIN_M, ESCAPE_M)][rng.integers(3)]
    acting = Actuation(robot.limits, shape, PERIOD, 0.0, robot.drive)
    pose, twist, desired = np.zeros(3), np.zeros(len(robot.drive.components)), None
    centers = rng.uniform(-2.0, 2.0, (4, 2))
    centers = centers[np.hypot(*centers.T) > shape.radius + 0.3]
    most = np.full(len(twist), robot.max_speed)
    most[-1] = robot.limits.max_yaw_rate
    for k in range(200):
        if k % SCANS == 0:
            rows, scan_time = find_reachable_discs(seen(centers, 0.2), OBSTACLES), k * PERIOD
        if k % 15 == 0:
            desired = robot.drive.saturate(rng.uniform(-most, most) * (rng.random(len(most)) < 0.7), robot.limits)
            headings = rng.uniform(-math.pi, math.pi, len(centers))
        certificate = MovingCertificate(rows, margin, k * PERIOD - scan_time, escape)
        accepts = certificate.accepts(roll_out(pose, twist, desired, acting))
        target = desired if accepts else make_braking_twist(twist, desired, robot.limits, shape.is_disc)
        for _ in range(round(PERIOD / STEP)):
            now, moves = advance_pose(
                Pose(*pose), convert_to_velocity(twist), convert_to_velocity(target), STEP, robot.limits
            )
            pose, twist = np.array(now), convert_to_twist(moves, robot.drive)
            aim = np.arctan2(*(pose[:2] - centers).T[::-1]) if hunters else headings
            centers = centers + STEP * OBSTACLES.max_speed * np.column_stack((np.cos(aim), np.sin(aim)))
            if np.hypot(*(centers - pose[:2]).T).min(initial=math.inf) > 0.2 + shape.radius:
                continue
            discs = MovingObstacles([0.2] * len(centers), tuple(np.array([(0, *c), (1, *c)]) for c in centers))
            if compute_moving_obstacle_clearance(discs, pose[None], np.zeros(1), shape)[0] < 0.0:
                assert find_top_speed(*robot.drive.body_rates(twist), shape.lever) <= STANDING_SPEED
                return  # it was struck while it stood


@settings(max_examples=40, deadline=None)
@given(seed=seeds, deceleration=st.floats(0.5, 10.0))
def test_obstacles_that_brake_in_time_never_meet_a_robot_that_leaves_them_room(seed: int, deceleration: float) -> None:
    """They hurry towards it, and brake when they are no farther away than they need; it may be driving or standing."""
    rng = np.random.default_rng(seed)
    obstacles = DynamicObstacleParameters(max_speed=0.8, caution=1.0, deceleration=deceleration)
    pose, twist, desired = np.zeros(3), np.zeros(2), np.zeros(2)
    centers = rng.uniform(-3.0, 3.0, (4, 2))
    centers = centers[np.hypot(*centers.T) > RADIUS + 0.3 + obstacles.stopping_distance]
    speeds = np.full(len(centers), obstacles.max_speed)
    for k in range(300):
        if k % SCANS == 0:
            rows, scan_time = find_reachable_discs(seen(centers, 0.2), obstacles), k * PERIOD
        if k % 15 == 0:  # a reckless driver
            desired = rng.uniform((-0.8, -2.0), (0.8, 2.0))
        certificate = MovingCertificate(rows, MARGIN, k * PERIOD - scan_time)
        target = desired if stays_clear(pose, twist, desired, certificate) else np.zeros(2)
        before, twist = twist, limited_twist(twist, target, ROBOT, PERIOD)
        for i in range(round(PERIOD / STEP)):
            share = (i + 0.5) * STEP / PERIOD
            pose = moved(pose, before + share * (twist - before), STEP)
            to_robot = pose[:2] - centers
            gaps = np.hypot(*to_robot.T) - 0.2 - RADIUS
            assert (gaps > 0.0).all()
            brakes = gaps - STEP * obstacles.max_speed <= speeds**2 / (2.0 * deceleration)
            speeds = np.where(brakes, np.maximum(speeds - deceleration * STEP, 0.0), speeds)
            centers = centers + STEP * speeds[:, None] * to_robot / np.hypot(*to_robot.T)[:, None]


def test_the_room_to_brake_is_that_of_the_fastest_obstacle() -> None:
    tracks, still = seen(np.array([[1.0, 0.0]]), 0.2), np.zeros(2)
    obstacles = DynamicObstacleParameters(max_speed=0.8, deceleration=2.0)
    without = find_reachable_discs(tracks, DynamicObstacleParameters(max_speed=0.8))
    discs = find_reachable_discs(tracks, obstacles)
    assert obstacles.stopping_distance == pytest.approx(0.16)
    np.testing.assert_allclose(discs - without, [[0.0, 0.0, 0.0, 0.0, 0.0, 0.16]] * len(discs))
    creep, room = np.array((0.05, 0.0)), 0.8 - RADIUS
    assert stays_clear(np.zeros(3), still, creep, MovingCertificate(without, room - 0.1, 0.0))
    assert not stays_clear(np.zeros(3), still, creep, MovingCertificate(discs, room - 0.1, 0.0))


def room(places: np.ndarray, times: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Distance of the robot at each place and time to what may be nearest by then, shape (n,), m; exact."""
    centers = rows[:, :2] + times[:, None, None] * rows[:, 2:4]
    add_radius = rows[:, 5] + times[:, None] * rows[:, 4]
    return (np.hypot(*np.moveaxis(centers - places[:, None], -1, 0)) - add_radius).min(axis=1)


@settings(max_examples=400)
@given(seeds, st.sampled_from([0.0, ESCAPE_M]))
def test_a_robot_that_moves_is_far_enough_from_all_that_may_have_come_near_until_it_has_stopped(seed, escape) -> None:
    """Any motion: what is not far enough may be so only within `escape`, and no nearer than standing would be."""
    rng = np.random.default_rng(seed)
    count = rng.integers(3, 10)
    samples = np.zeros((count, 6))
    samples[:, :2] = rng.uniform(-2.0, 2.0, 2) + np.cumsum(
        rng.choice([0.003, 0.2]) * rng.standard_normal((count, 2)), 0
    )
    samples[:, 3] = rng.choice([0.0, 0.004, -0.004, 0.006, 0.5, -0.5], count)
    samples[:, 5] = np.concatenate(([0.0], np.cumsum(rng.uniform(0.0, 0.2, count - 1))))
    motion = Motion(samples, 0, int(rng.integers(1, count)), True, disc(RADIUS))
    rows = np.hstack((samples[0, :2] + rng.uniform(-1.0, 1.0, (3, 2)), rng.uniform(-0.5, 0.5, (3, 4))))
    rows[:, 4:] = rng.uniform(0.0, 0.3, (3, 2))
    age = rng.uniform(0.0, 0.3)
    speed, times = np.abs(motion.twist[:, 0]), age + motion.time
    distance = (
        rng.choice(room(motion.position, times, rows)) + rng.uniform(-1.5, 1.5) * ESCAPE_M
    )  # close to what counts
    left, stood = (room(p, times, rows) - distance for p in (motion.position, motion.position[:1].repeat(count, 0)))
    stops = np.flatnonzero((np.arange(count) >= motion.braking) & (speed < STANDING_SPEED))
    last = stops[0] if len(stops) else count - 1
    moves = np.maximum(speed[1:], speed[:-1]) >= STANDING_SPEED
    clear = (left >= 0.0) | ((left >= -escape) & (left >= stood))
    expected = (clear[1:] | ~moves)[:last].all()
    assert MovingCertificate(rows, distance - RADIUS, age, escape).accepts(motion) == expected


@settings(max_examples=150)
@given(seeds)
def test_what_is_not_near_could_not_have_come_near(seed) -> None:
    """Fast obstacles, late commands and old scans: leaving out what is far changes no decision."""
    rng = np.random.default_rng(seed)
    limits = Limits(rng.uniform(0.1, 1.5), 2.0, rng.uniform(0.2, 8.0), rng.uniform(0.5, 8.0), 4.0)
    acting = Actuation(limits, disc(RADIUS), *rng.uniform(0.0, 0.3, 2) + (0.01, 0.0))
    age, obstacles = rng.choice([0.0, 0.2]), DynamicObstacleParameters(max_speed=rng.uniform(0.2, 3.0), caution=1.0)
    place, yaw = rng.uniform(-3.0, 3.0, 2), rng.uniform(-4.0, 4.0)
    ahead = np.array((math.cos(yaw), math.sin(yaw)))
    straight = np.array((limits.max_speed, 0.0))
    driven = roll_out(np.array((*place, yaw)), straight, straight, acting)
    needed = room(
        driven.position, age + driven.time, np.array([(*(place + 9.0 * ahead), 0.0, 0.0, obstacles.max_speed, 0.0)])
    )
    for spare in (-1e-3, 1e-3):  # a hit ahead that just comes too near, or just does not
        hit = place + (9.0 - needed.min() + RADIUS + MARGIN_M + spare) * ahead
        tracks = Tracks(time=0.0, hits=add_radius(hit[None], 0.0), hit_track=np.array([-1]))
        everything = MovingCertificate(find_reachable_discs(tracks, obstacles), MARGIN_M, age, ESCAPE_M)
        near_by = MovingCertificate.near(TrackedObstacles(tracks, age, obstacles), place, acting)
        assert near_by.accepts(driven) == everything.accepts(driven)
        assert near_by.age == age


def test_what_cannot_come_near_at_full_speed_while_the_robot_stops_is_left_out() -> None:
    """Both at 0.8 m/s, for 0.2 + 0.1 + 0.3 s, and the 0.8 s that braking takes."""
    acting = Actuation(LIMITS, disc(RADIUS), 0.3, 0.1)
    farthest = RADIUS + MARGIN_M + (0.8 + 0.8) * (0.2 + 0.1 + 0.3 + 0.8)
    hits = np.array([(1.0, 2.0 + farthest - 1e-6), (1.0, 2.0 - farthest - 1e-6)])
    tracked = TrackedObstacles(Tracks(time=0.0, hits=add_radius(hits, 0.0), hit_track=np.full(2, -1)), 0.2, OBSTACLES)
    np.testing.assert_array_equal(MovingCertificate.near(tracked, np.array((1.0, 2.0)), acting).discs[:, :2], hits[:1])


@pytest.mark.parametrize(("gap", "accepted"), [(MARGIN_M - 0.5 * 0.02, True), (MARGIN_M - 1.5 * 0.02, False)])
def test_no_robot_makes_way_that_is_nearer_than_a_centimetre(gap: float, accepted: bool) -> None:
    still = np.array([(RADIUS + gap, 0.0, 0.0, 0.0, 0.0, 0.0)])
    tracked = Tracks(time=0.0, hits=add_radius(still[:, :2], 0.0), hit_track=np.array([-1]))
    slow = DynamicObstacleParameters(max_speed=1e-3, caution=1.0)
    commands = Actuation(LIMITS, disc(RADIUS), PERIOD, 0.0)
    certificate = MovingCertificate.near(TrackedObstacles(tracked, 0.0, slow), np.zeros(2), commands)
    assert stays_clear(np.zeros(3), np.zeros(2), np.array((-0.1, 0.0)), certificate) == accepted


@pytest.mark.parametrize("caution", [1.0, 0.25, 0.0])
def test_tracks_are_trusted_as_far_as_caution_leaves_and_they_are_known_for_long(caution: float) -> None:
    """A hit of no track, one in view, one out of sight, which is where it was predicted, and one that is still new."""
    tracks = Tracks(
        time=1.0,
        position=np.array([(1.0, 0.0), (4.0, 0.0), (7.0, 0.0), (9.0, 0.0)]),
        velocity=np.array([(0.5, 0.1), (0.0, 0.5), (0.5, 0.0), (0.5, 0.0)]),
        radius=np.array([0.2, 0.3, 0.4, 0.4]),
        scan_count=np.array([20, 20, SETTLED_AFTER - 1, SETTLED_AFTER - 1]),
        last_seen=np.array([0.5, 1.0, 1.0, 0.5]),
        moving_share=np.ones(4),
        recent_top_speed=np.full(4, 0.5),
        hits=np.array([(2.0, 2.0, 0.0), (3.8, 0.0, 0.0), (6.8, 0.0, 0.0)]),
        hit_track=np.array([-1, 1, 2]),
    )
    assert tracks.is_confirmed.all()
    rows = find_reachable_discs(tracks, DynamicObstacleParameters(max_speed=0.8, caution=caution))
    trusted, cautious = 1.0 - caution, 0.8 * caution
    expected = [
        (2.0, 2.0, 0.0, 0.0, 0.8, 0.0),
        (6.8, 0.0, 0.0, 0.0, 0.8, 0.0),
        (3.8, 0.0, 0.0, 0.5 * trusted, cautious, 0.0),
        (1.0, 0.0, 0.5 * trusted, 0.1 * trusted, cautious, 0.2),
    ]
    np.testing.assert_allclose(rows, expected)
    edges = np.hypot(*rows[:, :2].T) - rows[:, 5]
    for reach in (0.75, 0.85, 3.0, 9.0):
        near = find_reachable_discs(
            tracks, DynamicObstacleParameters(max_speed=0.8, caution=caution), np.zeros(2), reach
        )
        np.testing.assert_array_equal(near, rows[edges < reach])


def test_what_stands_may_start_and_what_is_hidden_may_come_out() -> None:
    tracks = Tracks(
        time=0.0, possible_starters=np.array([(1.0, 0.0, 0.0)]), occlusion_discs=np.array([(3.0, 1.0, 0.075)])
    )
    stands, hides = find_reachable_discs(tracks, OBSTACLES)
    np.testing.assert_allclose(stands, (1.0, 0.0, 0.0, 0.0, 0.8, 0.0))
    np.testing.assert_allclose(hides, (3.0, 1.0, 0.0, 0.0, 0.8, 0.5 * OCCLUSION_SPACING))


@pytest.mark.parametrize("gap", [0.0151, 0.025, 0.034])
@pytest.mark.parametrize(("way", "accepted"), [((-0.1, 0.0), True), ((0.1, 0.0), False), ((-0.8, 0.0), True)])
def test_a_robot_may_make_way_to_what_creeps_near_to_it(gap: float, way: tuple[float, float], accepted: bool) -> None:
    """Away from it, where the full margin is used up, but not towards it."""
    slow = DynamicObstacleParameters(max_speed=0.05, caution=1.0)
    rows = find_reachable_discs(seen(np.array([[RADIUS + gap + 0.3, 0.0]]), 0.3), slow)
    certificate = MovingCertificate(rows, MARGIN_M, 0.05, ESCAPE_M)
    assert stays_clear(np.zeros(3), np.zeros(2), np.array(way), certificate) == accepted


def test_a_robot_that_creeps_does_not_count_as_standing() -> None:
    """Its body does not follow a command exactly, and may be faster than a monitor takes for standing."""
    near_by = find_reachable_discs(seen(np.array([(RADIUS + 0.2 + MARGIN + 0.001, 0.0)]), 0.2), OBSTACLES)
    creeping = np.array((0.6 * STANDING, 0.0))
    keeps = MovingCertificate(near_by, MARGIN, 0.0)
    assert not stays_clear(np.zeros(3), creeping, creeping, keeps)
    assert stays_clear(np.zeros(3), np.zeros(2), np.zeros(2), keeps)
