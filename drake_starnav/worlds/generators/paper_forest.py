"""The forest of the paper's simulations: eleven cylinders at fixed places."""

from dataclasses import dataclass

import numpy as np

from drake_starnav.worlds.solvable import Drawn, random_yaw
from drake_starnav.worlds.world import World

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
_RADIUS = 0.5  # m, of the cylinders
_BOUNDS = (-4.01, -1.69, 5.02, 3.51)


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
            cylinders=np.column_stack((_TREES, np.full(len(_TREES), _RADIUS))),
            bounds=_BOUNDS,
        )
