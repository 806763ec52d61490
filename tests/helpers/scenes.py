"""Small worlds with discs in known motion, their scans, and a robot without a plant that drives among them."""

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.worlds.world import World
from tests.helpers.scans import cast

PERIOD = 0.05
"""Between two scans, s."""


@dataclass(frozen=True)
class Scene:
    """What stands, and discs that move: at(t) gives their centres (n, 2), m; and how many beams a scan of it has."""

    standing: World
    radii: tuple[float, ...]
    at: Callable[[float], np.ndarray]
    beams: int = 360

    def scan(
        self, time: float, pose: np.ndarray, rng: np.random.Generator | None = None, noise: float = 0.01
    ) -> LaserScan:
        """What a lidar at `pose` measures, with noise (m) if there is a generator."""
        discs = [(*place, radius) for place, radius in zip(self.at(time), self.radii, strict=True)]
        world = dataclasses.replace(self.standing, cylinders=[*map(tuple, self.standing.cylinders), *discs])
        seen = cast(world, pose, beams=self.beams)
        ranges = seen.ranges
        if rng is not None:
            hit = np.isfinite(ranges)
            noisy = np.clip(ranges + noise * rng.standard_normal(len(ranges)), 0.0, seen.range_max - 1e-6)
            ranges = np.where(hit, noisy, ranges)
        return dataclasses.replace(seen, ranges=ranges, time=time)


def hall(*columns: tuple[float, float, float], half: float = 4.0) -> World:
    """An empty square room about the origin with columns (x, y, radius)."""
    return World("hall", (0, 0, 0), (0, 0), cylinders=list(columns), polygons=(), bounds=(-half, -half, half, half))


def straight(position: tuple[float, float], velocity: tuple[float, float]) -> Callable[[float], np.ndarray]:
    """One disc that never turns."""
    return lambda t: np.array(((position[0] + velocity[0] * t, position[1] + velocity[1] * t),))


def moved(pose: np.ndarray, twist: np.ndarray, time: float) -> np.ndarray:
    """The pose of a differential drive after a time with a twist."""
    turn = twist[1] * time
    middle = pose[2] + 0.5 * turn
    chord = twist[0] * time * np.sinc(turn / (2.0 * math.pi))
    return pose + np.array((chord * math.cos(middle), chord * math.sin(middle), turn))
