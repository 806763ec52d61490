"""A room or a hall in which discs wander and never yield."""

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.parameters import parameter
from drake_starnav.worlds.clearance import clearance
from drake_starnav.worlds.generators.wandering import wander
from drake_starnav.worlds.moving_obstacles import MovingObstacles, moving_obstacle_clearance
from drake_starnav.worlds.outlines import place, rectangle
from drake_starnav.worlds.solvable import Drawn, random_yaw
from drake_starnav.worlds.world import World

_TIMEOUT = 90.0  # s; after that the moving obstacles return the way they came
_HEIGHT = 12.0  # m, extent along y
_RADII = (0.2, 0.3)  # m, of the moving obstacles
_COLUMNS, _COLUMN_RADII = (3, 6), (0.15, 0.4)  # least and greatest number, and radii, m
_WALLS, _WALL_LENGTHS, _WALL_THICKNESS = (1, 3), (1.5, 3.0), 0.12  # m
_ROOM = 0.05  # m, least distance of a moving obstacle from static ones at first
_HEAD_START = 1.8  # m, least distance of a moving obstacle from the robot at the start
_LONGEST_WAIT = 10.0  # s, for which a moving obstacle may occupy the goal
_SAMPLING = 0.1  # s, of the check for that
_TRIES = 1000  # paths drawn for one moving obstacle


@dataclass(frozen=True)
class Crowd(Drawn):
    """A room with columns and walls, crossed from left to right among discs that move and never yield."""

    width: float = parameter(12.0, "extent along x, from start to goal", unit="m", low=8.0, high=100.0)
    moving_obstacles: tuple[int, int] = parameter((10, 20), "fewest and most discs that move", low=0, high=1000)
    speed: tuple[float, float] = parameter(
        (0.3, 0.8), "of the slowest and the fastest; each disc keeps its speed", unit="m/s", low=0.01, high=5.0
    )

    def make(self, rng: np.random.Generator, robot_radius: float) -> World:
        """A room that the robot could cross if nothing moved, and its moving obstacles.

        Half of them go straight until an obstacle blocks them, the others wander. None touches a static obstacle, is
        near the robot at the start, or stays on the goal for long; they pass through each other.
        """
        world = super().make(rng, robot_radius)
        count = int(rng.integers(*self.moving_obstacles, endpoint=True))
        radii = rng.uniform(*_RADII, count)
        paths = tuple(self._draw_path(world, radius, robot_radius, rng) for radius in radii)
        return dataclasses.replace(world, moving_obstacles=MovingObstacles(radii, paths))

    def draw(self, rng: np.random.Generator) -> World:
        count = rng.integers(*_COLUMNS, endpoint=True)
        places = rng.uniform((2.0, 1.0), (self.width - 2.0, _HEIGHT - 1.0), (count, 2))
        walls = []
        for _ in range(rng.integers(*_WALLS, endpoint=True)):
            middle = rng.uniform((3.0, 2.0), (self.width - 3.0, _HEIGHT - 2.0))
            half, thick = 0.5 * rng.uniform(*_WALL_LENGTHS), 0.5 * _WALL_THICKNESS
            walls.append(place(rectangle(-half, -thick, half, thick), middle, rng.uniform(0.0, math.pi)))
        start_y, goal_y = rng.uniform(0.8, _HEIGHT - 0.8, 2)
        return World(
            name="crowd",
            start=(rng.uniform(0.6, 1.4), start_y, random_yaw(rng)),
            goal=(self.width - rng.uniform(0.6, 1.4), goal_y),
            cylinders=np.column_stack((places, rng.uniform(*_COLUMN_RADII, len(places)))),
            polygons=tuple(walls),
            bounds=(0.0, 0.0, self.width, _HEIGHT),
            timeout=_TIMEOUT,
        )

    def _draw_path(self, world: World, radius: float, robot_radius: float, rng: np.random.Generator) -> np.ndarray:
        speed, winding = rng.uniform(*self.speed), rng.random() < 0.5
        for _ in range(_TRIES):
            position = rng.uniform(radius, (self.width - radius, _HEIGHT - radius))
            room = clearance(world, position[None])[0] - radius
            if room < _ROOM or math.dist(position, world.start[:2]) < _HEAD_START:
                continue
            path = wander(world, position, radius, speed, winding, rng)
            if path is not None and _longest_stay(path, radius + robot_radius, world.goal) <= _LONGEST_WAIT:
                return path
        raise StarnavError(
            f"Crowd: none of {_TRIES} paths for a disc of radius {radius:.2f} m was free; allowed: a larger room"
        )


def _longest_stay(path: np.ndarray, distance: float, place: tuple[float, float]) -> float:
    """Longest time for which a moving obstacle is continuously nearer to a place than a distance (m), s."""
    times = np.arange(0.0, 2.0 * path[-1, 0], _SAMPLING)  # two periods, as it may stay where its path closes
    near = (
        moving_obstacle_clearance(
            MovingObstacles(np.array([distance]), (path,)), np.tile(place, (len(times), 1)), times
        )
        < 0.0
    )
    changes = np.flatnonzero(np.diff(np.concatenate(([False], near, [False]))))
    return float(np.diff(changes)[::2].max(initial=0)) * _SAMPLING
