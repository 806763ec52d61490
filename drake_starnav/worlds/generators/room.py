"""A room with a dead end between start and goal, as in the paper's real experiment, and some clutter."""

import math
from dataclasses import dataclass

import numpy as np

from drake_starnav.parameters import parameter
from drake_starnav.worlds.outlines import place, rectangle, trap
from drake_starnav.worlds.solvable import check_order, first_solvable, random_yaw
from drake_starnav.worlds.world import World

_WALL = 0.1  # m, thickness of the dead end's walls


@dataclass(frozen=True)
class Room:
    """A room crossed from bottom to top; a U-shaped dead end in the middle opens towards the start."""

    width: float = parameter(6.0, "extent along x", unit="m", low=5.0, high=50.0)
    height: float = parameter(8.0, "extent along y, from start to goal", unit="m", low=7.0, high=50.0)
    min_clutter: int = parameter(3, "fewest cylinders and boxes beside the dead end", low=0, high=1000)
    max_clutter: int = parameter(7, "most cylinders and boxes beside the dead end", low=0, high=1000)
    timeout: float = parameter(180.0, "time a trial may take", unit="s", above=0.0)

    def make(self, rng: np.random.Generator, robot_radius: float) -> World:
        """A room that the robot can cross; see `first_solvable`."""
        check_order(self, "min_clutter", "max_clutter")
        return first_solvable(self, self._draw, rng, robot_radius)

    def _draw(self, rng: np.random.Generator) -> World:
        middle = rng.uniform((self.width / 3.0, 0.525 * self.height), (self.width / 1.5, 0.7 * self.height))
        dead_end = trap(rng.uniform(1.6, 3.0), rng.uniform(1.0, 2.2), _WALL, arms=2)
        polygons = [place(dead_end, middle, rng.uniform(-0.4, 0.4) - math.pi / 2.0)]
        cylinders = []
        for _ in range(rng.integers(self.min_clutter, self.max_clutter + 1)):
            position = rng.uniform(0.5, (self.width - 0.5, self.height - 0.5))
            if rng.random() < 0.5:
                cylinders.append((*position, rng.uniform(0.1, 0.3)))
            else:
                half_x, half_y = rng.uniform(0.1, 0.3, 2)
                box = rectangle(-half_x, -half_y, half_x, half_y)
                polygons.append(place(box, position, rng.uniform(0.0, math.pi)))
        start_x, goal_x = rng.uniform(0.5, self.width - 0.5, 2)
        return World(
            name="room",
            start=(start_x, rng.uniform(0.5, 1.2), random_yaw(rng)),
            goal=(goal_x, self.height - rng.uniform(0.5, 1.2)),
            cylinders=np.array(cylinders),
            polygons=tuple(polygons),
            bounds=(0.0, 0.0, self.width, self.height),
            timeout=self.timeout,
        )
