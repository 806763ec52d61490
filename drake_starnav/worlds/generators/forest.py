"""Cylinders in a wide field, as in the paper's forest, at random places."""

from dataclasses import dataclass

import numpy as np

from drake_starnav.parameters import parameter
from drake_starnav.worlds.solvable import Drawn, random_yaw
from drake_starnav.worlds.world import World

_CLEARING = 2.2  # m, no trees in the strips at both ends, where start and goal lie
_TREES = np.array(
    [
        (-1.70186, 2.39497),
        (0.265649, -0.515862),
        (-1.66085, 0.914274),
        (0.574884, 2.1123),
        (-1.58538, -0.744632),
        (1.06212, 3.00715),
        (1.09001, 0.754745),
        (2.78983, 2.44672),
        (2.72924, 1.05454),
        (2.01592, -0.540701),
        (3.60735, -0.432026),
    ]
)


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
        spacing = 2.0 * self.radius + rng.uniform(*self.gap)
        wanted = int(rng.integers(*self.trees, endpoint=True))
        # a dense forest is full after this many places were tried
        places = rng.uniform((_CLEARING, 0.0), (self.width - _CLEARING, self.height), (4000, 2))
        trees = np.empty((0, 2))
        while len(trees) < wanted and len(places):
            trees = np.vstack((trees, places[:1]))
            places = places[np.hypot(*(places - places[0]).T) >= spacing]
        start_y, goal_y = rng.uniform(0.8, self.height - 0.8, 2)
        return World(
            name="forest",
            start=(rng.uniform(0.4, 1.2), start_y, random_yaw(rng)),
            goal=(self.width - rng.uniform(0.4, 1.2), goal_y),
            cylinders=np.column_stack((trees, np.full(len(trees), self.radius))),
            bounds=(-0.3, -0.6, self.width + 0.3, self.height + 0.6),
        )


@dataclass(frozen=True)
class PaperForest(Drawn):
    """The authors' Gazebo forest; only start and goal are random, in the paper's ranges.

    Source: arXiv 2403.11484, simulated experiments.
    """

    def draw(self, rng: np.random.Generator) -> World:
        start_y, goal_y = rng.uniform(-1.35, 3.2, 2)
        return World(
            name="paper_forest",
            start=(rng.uniform(-3.6, -2.7), start_y, random_yaw(rng)),
            goal=(rng.uniform(4.5, 4.8), goal_y),
            cylinders=np.column_stack((_TREES, np.full(len(_TREES), 0.5))),
            bounds=(-4.01, -1.69, 5.02, 3.51),
        )
