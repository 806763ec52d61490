"""The path of a disc that wanders between obstacles and turns where it meets one."""

import math

import numpy as np

from drake_starnav.worlds.clearance import clearance
from drake_starnav.worlds.moving_obstacles import there_and_back
from drake_starnav.worlds.world import World

_DURATION = 90.0  # s, until it returns along the same path
_STRAIGHT, _WINDING = 2.0, 0.2  # s, a leg's duration: collision checks and changes of heading are per leg
_TURN_RATE, _TURN_TIMES = 0.6, (1.0, 3.0)  # rad/s at most to either side, kept for so long, s
_SPACING = 0.01  # m, between the places of a leg that are checked
_SCATTER = 0.15  # rad, to either side of the mirrored heading
_HEADINGS = 50  # tried where the mirrored one is blocked
_SLOPE = 1e-4  # m, over which the clearance is differentiated


def wander(
    world: World, position: np.ndarray, radius: float, speed: float, winding: bool, rng: np.random.Generator
) -> np.ndarray | None:
    """A closed path, there and back, on which a disc touches no static obstacle; None if it was caught in a corner.

    Args:
        position: where the disc is at first, free, shape (2,), W, m.
        radius, speed: of the disc, m and m/s.
        winding: whether its path is curved; otherwise it is straight between the turns at obstacles.

    Returns:
        Way points as of `MovingObstacles`, shape (k, 3): time, x, y, s and m.
    """
    least = radius + 0.5 * _SPACING  # at the checked places, so that none between them is nearer than the radius
    heading, time, turn_rate, next_turn = rng.uniform(-math.pi, math.pi), 0.0, 0.0, 0.0
    points = [(time, *position)]
    while time < _DURATION:
        if winding and time >= next_turn:
            turn_rate, next_turn = rng.uniform(-_TURN_RATE, _TURN_RATE), time + rng.uniform(*_TURN_TIMES)
        leg = _WINDING if winding else _STRAIGHT
        heading += turn_rate * leg
        steps = _free_steps(world, position, heading, least, math.ceil(speed * leg / _SPACING))
        if steps > 0:
            position = position + steps * _SPACING * _direction(heading)
            time += steps * _SPACING / speed
            points.append((time, *position))
        if steps * _SPACING < speed * leg:
            turned = _turned(world, position, heading, least, rng)
            if turned is None:
                return None
            heading = turned
    return there_and_back(np.array(points))


def _direction(heading: float) -> np.ndarray:
    return np.array([math.cos(heading), math.sin(heading)])


def _free_steps(world: World, position: np.ndarray, heading: float, least: float, steps: int) -> int:
    """How many of the steps in a direction keep the least clearance."""
    places = position + _SPACING * np.arange(1, steps + 1)[:, None] * _direction(heading)
    blocked = np.flatnonzero(clearance(world, places) < least)
    return int(blocked[0]) if len(blocked) else steps


def _turned(world: World, position: np.ndarray, heading: float, least: float, rng: np.random.Generator) -> float | None:
    """A free heading: roughly mirrored at the nearest obstacle, else any; None if none was found."""
    offsets = _SLOPE * np.array([(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)])
    right, left, up, down = clearance(world, position + offsets)
    normal = math.atan2(up - down, right - left)
    mirrored = 2.0 * normal + math.pi - heading + rng.uniform(-_SCATTER, _SCATTER)
    for candidate in (mirrored, *rng.uniform(-math.pi, math.pi, _HEADINGS)):
        if _free_steps(world, position, candidate, least, 1):
            return float(candidate)
    return None
