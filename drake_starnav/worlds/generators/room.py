"""A room with a dead end between start and goal, as in the paper's real experiment, and some clutter."""

import math
from dataclasses import dataclass

import numpy as np

from drake_starnav.worlds.outlines import WALL, make_rectangle, make_trap, place
from drake_starnav.worlds.solvable import Drawn, draw_random_yaw
from drake_starnav.worlds.world import World

_WIDTH, _HEIGHT = 6.0, 8.0  # m, along x and, from start to goal, along y


@dataclass(frozen=True)
class Room(Drawn):
    """A room crossed from bottom to top; a U-shaped dead end in the middle opens towards the start."""

    def draw(self, rng: np.random.Generator) -> World:
        trap_middle = rng.uniform((_WIDTH / 3.0, 0.525 * _HEIGHT), (_WIDTH / 1.5, 0.7 * _HEIGHT))
        dead_end = make_trap(rng.uniform(1.6, 3.0), rng.uniform(1.0, 2.2), WALL, arms=2)
        polygons = [place(dead_end, trap_middle, rng.uniform(-0.4, 0.4) - math.pi / 2.0)]
        cylinders = []
        for _ in range(rng.integers(3, 7, endpoint=True)):
            position = rng.uniform(0.5, (_WIDTH - 0.5, _HEIGHT - 0.5))
            if rng.random() < 0.5:
                cylinders.append((*position, rng.uniform(0.1, 0.3)))
            else:
                half_x, half_y = rng.uniform(0.1, 0.3, 2)
                box = make_rectangle(-half_x, -half_y, half_x, half_y)
                polygons.append(place(box, position, rng.uniform(0.0, math.pi)))
        start_x, goal_x = rng.uniform(0.5, _WIDTH - 0.5, 2)
        return World(
            name="room",
            start=(start_x, rng.uniform(0.5, 1.2), draw_random_yaw(rng)),
            goal=(goal_x, _HEIGHT - rng.uniform(0.5, 1.2)),
            cylinders=np.array(cylinders),
            polygons=tuple(polygons),
            bounds=(0.0, 0.0, _WIDTH, _HEIGHT),
        )
