"""What stands may start: a reckless driver with both the scans and the certificate in time is never touched by it."""

import math

import numpy as np
import pytest
from hypothesis import given, settings

from drake_starnav.moving.certificate import MOVING_MARGIN, STANDING_SPEED, MovingCertificate, find_reachable_discs
from drake_starnav.moving.parameters import DynamicObstacleParameters
from drake_starnav.moving.tracker import TrackerState, track
from drake_starnav.robot import RobotParameters
from drake_starnav.robot.motion import roll_out
from drake_starnav.worlds.clearance import compute_clearance
from drake_starnav.worlds.world import World
from tests.helpers.motions import actuation, limited_twist
from tests.helpers.scans import seeds
from tests.helpers.scenes import PERIOD, Scene, moved

pytestmark = pytest.mark.slow

ROBOT = RobotParameters()
TICKS, STEPS = 2, 5
"""Commands from scan to scan, and steps of the simulation from command to command."""
HALF = 3.0
WALL = np.array([(-2.0, 0.9), (-0.4, 0.9), (-0.4, 1.02), (-2.0, 1.02)])


def room() -> World:
    return World(
        "room", (0, 0, 0), (0, 0), cylinders=[(1.9, -1.2, 0.35)], polygons=(WALL,), bounds=(-HALF, -HALF, HALF, HALF)
    )


def standing_places(rng: np.random.Generator, radii: np.ndarray) -> np.ndarray:
    """Anywhere, or against a wall, in a corner, at the end of a partition, or beside a column or another disc."""
    places: list[np.ndarray] = []
    while len(places) < len(radii):
        r = radii[len(places)] + rng.choice((0.0, 0.02, 0.1))
        kind = rng.integers(6)
        place = rng.uniform(-HALF + r, HALF - r, 2)
        if kind == 1:
            place[0] = HALF - r
        elif kind == 2:
            place[:] = HALF - r, -HALF + r
        elif kind == 3:
            place[:] = -0.4 + r, rng.uniform(0.9, 1.02)
        elif kind == 4:
            angle = rng.uniform(-math.pi, math.pi)
            place = np.array((1.9, -1.2)) + (0.35 + r) * np.array((math.cos(angle), math.sin(angle)))
        elif kind == 5 and places:
            angle = rng.uniform(-math.pi, math.pi)
            reach = radii[len(places) - 1] + r
            place = places[-1] + reach * np.array((math.cos(angle), math.sin(angle)))
        free = compute_clearance(room(), place[None])[0] >= radii[len(places)] - 1e-9
        if free and math.hypot(*place) > ROBOT.radius + r + 0.3:
            places.append(place)
    return np.array(places)


def struck_while_driving(seed: int, caution: float, duration: float = 8.0) -> bool:
    """Whether discs that stand, and then hunt a reckless driver at the declared speed, catch it driving.

    Each starts when the robot drives, and is near; some stand for longer than it takes to be sure that they stand.
    """
    rng = np.random.default_rng(seed)
    obstacles = DynamicObstacleParameters(max_speed=rng.uniform(0.5, 1.5), caution=caution)
    radii = rng.uniform(0.15, 0.6, 4)
    centers, reach, waits = standing_places(rng, radii), rng.uniform(0.1, 1.2, 4), rng.choice((0.0, 2.5), 4)
    started = np.zeros(4, bool)
    pose, twist, desired, known = np.array((0.0, 0.0, rng.uniform(-3.0, 3.0))), np.zeros(2), np.zeros(2), TrackerState()
    tick = PERIOD / TICKS
    for k in range(round(duration / tick)):
        time = k * tick
        if k % TICKS == 0:
            scene = Scene(room(), tuple(radii), lambda _, now=centers: now)
            known = track(known, scene.scan(time, pose, rng), pose, obstacles)
            rows = find_reachable_discs(known.tracks, obstacles)
        if k % 20 == 0:
            desired = np.array((rng.choice((0.8, 0.8, -0.8)), rng.choice((0.0, rng.uniform(-2.0, 2.0)))))
        ahead = moved(pose, desired, 0.8)[:2]
        safe = compute_clearance(room(), ahead[None])[0] > ROBOT.radius + 0.1  # what stands is another certificate's
        age = time - known.tracks.time
        keeps = MovingCertificate(rows, (1.0 + MOVING_MARGIN) * ROBOT.radius, age)
        certified = safe and keeps.accepts(roll_out(pose, twist, desired, actuation(ROBOT, tick)))
        gaps = np.hypot(*(pose[:2] - centers).T) - radii - ROBOT.radius
        started |= (gaps < reach) & (abs(twist[0]) > 0.1) & (time > waits)
        before, twist = twist, limited_twist(twist, desired if certified else np.zeros(2), ROBOT, tick)
        for i in range(STEPS):
            share = (i + 0.5) / STEPS
            now = before + share * (twist - before)
            pose = moved(pose, now, tick / STEPS)
            away = pose[:2] - centers
            way = obstacles.max_speed * tick / STEPS * away / np.hypot(*away.T)[:, None]
            there = centers + np.where(started[:, None], way, 0.0)
            passes = compute_clearance(room(), there) >= radii - 1e-9  # nothing walks through walls
            centers = np.where(passes[:, None], there, centers)
            if (np.hypot(*(pose[:2] - centers).T) - radii).min() < ROBOT.radius:
                return bool(abs(now[0]) > STANDING_SPEED)
    return False


@settings(max_examples=15)
@given(seed=seeds)
def test_what_stood_wherever_it_was_never_touches_a_robot_that_drives(seed: int) -> None:
    assert not struck_while_driving(seed, caution=1.0)


def test_the_hunters_do_catch_a_driver_who_trusts_what_stands() -> None:
    assert any(struck_while_driving(seed, caution=0.0) for seed in range(10))
