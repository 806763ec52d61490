"""Mazes of two families: a lattice of cells with loops, and an open floor with doors and traps."""

import math
from dataclasses import dataclass

import numpy as np

from drake_starnav.parameters import parameter
from drake_starnav.worlds.outlines import make_rectangle, make_trap, place
from drake_starnav.worlds.solvable import Drawn, draw_random_yaw
from drake_starnav.worlds.world import World

_TIMEOUT = 400.0  # s; without a map, a robot may see most of the maze before it finds the goal
_WALL = 0.12  # m, thickness of the open family's walls


@dataclass(frozen=True)
class Maze(Drawn):
    """A square maze crossed from one side to the other."""

    size: float = parameter(12.0, "side of the square", unit="m", low=4.0, high=200.0)
    family: str = parameter(
        "any",
        "cells: corridors on a lattice, with loops; open: walls with a door, U- and L-shaped traps, cylinders and "
        "spheres; any: one of the two by chance",
        choices=("any", "cells", "open"),
    )
    cells: tuple[int, int] = parameter((9, 11), "cells: fewest and most cells along a side", low=2, high=200)
    traps: tuple[int, int] = parameter(
        (6, 12), "open: fewest and most free-standing walls, L and U shapes", low=0, high=2000
    )

    def draw(self, rng: np.random.Generator) -> World:
        family = ("cells", "open")[rng.integers(2)] if self.family == "any" else self.family
        return self._draw_cells(rng) if family == "cells" else self._draw_open(rng)

    def _draw_cells(self, rng: np.random.Generator) -> World:
        cell_count = int(rng.integers(*self.cells, endpoint=True))
        cell_size = self.size / cell_count
        half_wall = rng.uniform(0.1, 0.15) / 2.0
        right_walls, upper_walls = _draw_spanning_tree_walls(cell_count, rng)
        # a perfect maze has one way only: open some more walls to make loops
        opened_share = rng.uniform(0.1, 0.35)
        right_walls &= rng.random(right_walls.shape) > opened_share
        upper_walls &= rng.random(upper_walls.shape) > opened_share
        polygons = []
        for i, j in np.argwhere(right_walls):
            x, y = (i + 1) * cell_size, j * cell_size
            polygons.append(make_rectangle(x - half_wall, y - half_wall, x + half_wall, y + cell_size + half_wall))
        for i, j in np.argwhere(upper_walls):
            x, y = i * cell_size, (j + 1) * cell_size
            polygons.append(make_rectangle(x - half_wall, y - half_wall, x + cell_size + half_wall, y + half_wall))
        start, goal = (rng.integers(cell_count, size=2) + 0.5) * cell_size
        end_points = np.array([(0.5 * cell_size, start), ((cell_count - 0.5) * cell_size, goal)])
        if rng.random() < 0.5:
            end_points = end_points[:, ::-1]
        return World(
            name="maze",
            start=(*end_points[0], draw_random_yaw(rng)),
            goal=tuple(end_points[1]),
            polygons=tuple(polygons),
            bounds=(0.0, 0.0, self.size, self.size),
            timeout=_TIMEOUT,
        )

    def _draw_open(self, rng: np.random.Generator) -> World:
        size, half = self.size, _WALL / 2.0
        polygons = []
        wall_places = np.arange(3.0, size - 2.5)
        for x in rng.choice(wall_places, size=min(len(wall_places), int(rng.integers(1, 4))), replace=False):
            door = rng.uniform(0.9, 1.2)
            y = rng.uniform(0.3, size - 0.3 - door)
            polygons += [make_rectangle(x - half, 0.0, x + half, y), make_rectangle(x - half, y + door, x + half, size)]
        for _ in range(rng.integers(*self.traps, endpoint=True)):
            arm_count = int(rng.choice(3, p=(0.2, 0.3, 0.5)))
            trap_shape = make_trap(rng.uniform(1.0, 2.6), rng.uniform(0.8, 2.2), _WALL, arm_count)
            quarter_turns = rng.integers(4) * math.pi / 2.0
            trap_angle = rng.uniform(0.0, 2.0 * math.pi) if rng.random() < 0.5 else quarter_turns
            polygons.append(place(trap_shape, rng.uniform(1.0, size - 1.0, 2), trap_angle))
        cylinders: list[tuple[float, ...]] = []
        spheres: list[tuple[float, ...]] = []
        for _ in range(rng.integers(3, 9)):
            disc = (*rng.uniform(0.8, size - 0.8, 2), rng.uniform(0.15, 0.4))
            is_sphere = disc[2] >= 0.2 and rng.random() < 0.5  # the lidar passes over the widest part of smaller ones
            (spheres if is_sphere else cylinders).append(disc)
        start_y, goal_y = rng.uniform(0.4, size - 0.4, 2)
        return World(
            name="maze",
            start=(rng.uniform(0.4, 1.4), start_y, draw_random_yaw(rng)),
            goal=(size - rng.uniform(0.4, 1.4), goal_y),
            cylinders=np.array(cylinders),
            spheres=np.array(spheres),
            polygons=tuple(polygons),
            bounds=(0.0, 0.0, size, size),
            timeout=_TIMEOUT,
        )


def _draw_spanning_tree_walls(n: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Walls of a perfect maze on n x n cells, carved by a random depth-first walk: whether one stands between cells (i,
    j) and (i + 1, j), shape (n - 1, n), and between (i, j) and (i, j + 1), shape (n, n - 1)."""
    right_walls, upper_walls = np.ones((n - 1, n), bool), np.ones((n, n - 1), bool)
    is_seen = np.zeros((n, n), bool)
    cell_trail = [(int(rng.integers(n)), int(rng.integers(n)))]
    is_seen[cell_trail[0]] = True
    while cell_trail:
        i, j = cell_trail[-1]
        neighbours = [(i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)]
        unseen_neighbours = [(a, b) for a, b in neighbours if 0 <= a < n and 0 <= b < n and not is_seen[a, b]]
        if not unseen_neighbours:
            cell_trail.pop()
            continue
        a, b = unseen_neighbours[rng.integers(len(unseen_neighbours))]
        if a != i:
            right_walls[min(a, i), j] = False
        else:
            upper_walls[i, min(b, j)] = False
        is_seen[a, b] = True
        cell_trail.append((a, b))
    return right_walls, upper_walls
