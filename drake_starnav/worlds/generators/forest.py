"""Cylinders in a wide field, as in the paper's forest, at random places."""

from dataclasses import dataclass

import numpy as np

from drake_starnav.parameters import parameter
from drake_starnav.worlds.solvable import Drawn, draw_random_yaw
from drake_starnav.worlds.world import World

_CLEARING = 2.2  # m, no trees in the strips at both ends, where start and goal lie


@dataclass(frozen=True)
class Forest(Drawn):
    """A random forest: trees of one radius with a least gap, start on the left, goal on the right."""

    width: float = parameter(20.0, "length of the field, from start to goal", unit="m", low=6.0, high=200.0)
    height: float = parameter(12.0, "breadth of the field", unit="m", low=3.0, high=200.0)
    radius: float = parameter(0.5, "radius of the trees", unit="m", low=0.01, high=5.0)
    trees: tuple[int, int] = parameter((40, 74), "fewest and most trees, if that many find room", low=0, high=10000)
    gap: tuple[float, float] = parameter(
        (0.6, 0.9), "limits of the least gap between trees; each forest draws its own", unit="m", low=0.0
    )

    def draw(self, rng: np.random.Generator) -> World:
        tree_spacing = 2.0 * self.radius + rng.uniform(*self.gap)
        wanted_count = int(rng.integers(*self.trees, endpoint=True))
        # a dense forest is full after this many places were tried
        free_places = rng.uniform((_CLEARING, 0.0), (self.width - _CLEARING, self.height), (4000, 2))
        tree_places = np.empty((0, 2))
        while len(tree_places) < wanted_count and len(free_places):
            tree_places = np.vstack((tree_places, free_places[:1]))
            free_places = free_places[np.hypot(*(free_places - free_places[0]).T) >= tree_spacing]
        start_y, goal_y = rng.uniform(0.8, self.height - 0.8, 2)
        return World(
            name="forest",
            start=(rng.uniform(0.4, 1.2), start_y, draw_random_yaw(rng)),
            goal=(self.width - rng.uniform(0.4, 1.2), goal_y),
            cylinders=np.column_stack((tree_places, np.full(len(tree_places), self.radius))),
            bounds=(-0.3, -0.6, self.width + 0.3, self.height + 0.6),
        )
