"""A room in which discs stand for a while, then walk, again and again, and never yield."""

import math
from dataclasses import dataclass

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.parameters import parameter
from drake_starnav.worlds.moving_obstacles import MovingObstacles, there_and_back
from drake_starnav.worlds.solvable import random_yaw
from drake_starnav.worlds.world import World

_TIMEOUT = 90.0  # s; several times what crossing takes, to allow for waiting
_WIDTH, _HEIGHT = 10.0, 6.0  # m, from start to goal along x, and along y
_RADII = (0.15, 0.3)  # m, of the moving obstacles
_INSET = 0.8  # m, of start and goal from the walls at both ends
_GAP = 0.1  # m, between a moving obstacle and the walls
_HEAD_START = 1.8  # m, least distance of a moving obstacle from the robot at the start
_WAITS, _WALKS = (0.5, 6.0), (0.5, 2.0)  # s, duration of a stand and of a walk
_DURATION = 60.0  # s, until it returns along the same path
_TRIES = 1000  # places drawn for one moving obstacle, and headings for one walk


@dataclass(frozen=True)
class StopAndGo:
    """A room crossed from left to right among discs that stand, then start at full speed and never yield."""

    moving_obstacles: int = parameter(8, "discs that move", low=0, high=1000)
    speed: tuple[float, float] = parameter(
        (0.5, 1.5), "of the slowest and the fastest; each disc walks at its speed", unit="m/s", low=0.01, high=5.0
    )

    def make(self, rng: np.random.Generator, robot_radius: float) -> World:
        """A bare room and its moving obstacles; they stand at first, avoid its walls, and pass through each other."""
        if robot_radius >= _INSET:
            raise StarnavError(
                f"StopAndGo: robot_radius {robot_radius:g} m does not fit at the start; allowed: below {_INSET:g} m"
            )
        start = np.array((_INSET, 0.5 * _HEIGHT))
        radii = rng.uniform(*_RADII, self.moving_obstacles)
        moving_obstacles = MovingObstacles(radii, tuple(self._draw_path(start, radius, rng) for radius in radii))
        return World(
            name="stop_and_go",
            start=(*start, random_yaw(rng)),
            goal=(_WIDTH - _INSET, 0.5 * _HEIGHT),
            bounds=(0.0, 0.0, _WIDTH, _HEIGHT),
            timeout=_TIMEOUT,
            moving_obstacles=moving_obstacles,
        )

    def _draw_path(self, start: np.ndarray, radius: float, rng: np.random.Generator) -> np.ndarray:
        low, high = np.full(2, radius + _GAP), np.array((_WIDTH, _HEIGHT)) - radius - _GAP
        for _ in range(_TRIES):
            place = rng.uniform(low, high)
            if math.dist(place, start) >= _HEAD_START:
                break
        speed, time = rng.uniform(*self.speed), 0.0
        points = [(time, *place)]
        while time < _DURATION:
            time += rng.uniform(*_WAITS)
            points.append((time, *place))
            place, duration = _walk(place, speed, low, high, rng)
            time += duration
            points.append((time, *place))
        return there_and_back(np.array(points))


def _walk(
    place: np.ndarray, speed: float, low: np.ndarray, high: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, float]:
    """End of a straight walk from a place inside the limits, and its duration, s."""
    for _ in range(_TRIES):
        heading, duration = rng.uniform(-math.pi, math.pi), rng.uniform(*_WALKS)
        end = place + speed * duration * np.array((math.cos(heading), math.sin(heading)))
        if ((low <= end) & (end <= high)).all():
            return end, duration
    raise StarnavError(f"StopAndGo: none of {_TRIES} walks at {speed:g} m/s stays in the room; allowed: slower discs")
