"""Compare rules for the segments of a star's boundary (Fig. 5): python scripts/experiments/ablate_segments.py

Fits cubics to raw scans of the authors' lidar in worlds of every kind, by least squares: over adaptive segments, over
those of the slope rule of the paper's authors, and over fixed numbers of segments.
"""

import argparse
import math
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from tqdm import tqdm

from drake_starnav.cli.options import REACHED, CommandParser, check_numbers, run_command
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.paper.star_region import fit_boundary, make_range_profile
from drake_starnav.robot import RobotParameters
from drake_starnav.surroundings.piecewise_cubic import PiecewiseCubic, fit_piecewise_cubic, fit_segments
from drake_starnav.worlds import Forest, Maze, PaperForest, Room, World, compute_clearance, make_world
from drake_starnav.worlds.view import scan_from, visible_shapes

FIXED = (4, 8, 16, 32, 64)
RADIUS = RobotParameters.radius
"""Of the robot, m."""
REPEATS = 7
"""Repetitions of each timed fit, methods in turn; the fastest counts, which excludes other load."""
LIDAR = LidarParameters(beams=360, range_min=0.12, range_max=3.5, noise=0.01)
"""The authors'."""
KINDS = (Forest(), Maze(), Room(), PaperForest())


def random_free_pose(world: World, rng: np.random.Generator) -> np.ndarray:
    """A random pose (x, y, yaw) in W, m and rad, at which the robot touches nothing."""
    x0, y0, x1, y1 = world.extent
    while True:
        pose = rng.uniform((x0, y0, -np.pi), (x1, y1, np.pi))
        if compute_clearance(world, pose[None, :2])[0] > RADIUS:
            return pose


def random_scans(count: int, seed: int) -> Iterator[LaserScan]:
    """Scans from random free poses, each of a world of its own, the kinds of world in turn."""
    for k in range(count):
        world = make_world(KINDS[k % len(KINDS)], seed + k // len(KINDS), RADIUS)
        pose = random_free_pose(world, np.random.default_rng([seed, k]))
        yield scan_from(visible_shapes(world), pose, LIDAR, seed, k)


@dataclass(frozen=True)
class Deviation:
    """How a fit deviates from the free range; of many fits, each attribute has shape (scans,).

    Attributes:
        mean, largest: of the absolute difference over all bearings, m.
        lost: area of the free range outside the star, as a share of the free range's area.
        claimed: area of the star outside the free range, as a share of the same.
        segments: number of cubics.
        seconds: time of the fit, s.
    """

    mean: np.ndarray
    largest: np.ndarray
    lost: np.ndarray
    claimed: np.ndarray
    segments: np.ndarray
    seconds: np.ndarray


def methods() -> dict[str, Callable[[np.ndarray], PiecewiseCubic]]:
    """All rows of the table, by label: what fits the cubics."""
    adaptive = partial(fit_piecewise_cubic, radius=RADIUS, one_sided=False)
    fixed = {f"{n} fixed": partial(fit_equal, count=n, one_sided=False) for n in FIXED}
    return {"adaptive": adaptive, "slope (paper)": fit_boundary, **fixed}


def fit_equal(samples: np.ndarray, count: int, one_sided: bool) -> PiecewiseCubic:
    """Cubics over `count` segments of equal length."""
    return fit_segments(samples, np.linspace(0, len(samples), count + 1).astype(np.int64), np.inf, one_sided)


def deviation(values: np.ndarray, samples: np.ndarray) -> tuple[float, float, float, float]:
    """Mean and largest absolute deviation, m, and the shares of area lost and wrongly claimed.

    Args:
        values: shape (M,), the fitted boundary, m.
        samples: shape (M,), the free range, m.
    """
    error = np.abs(values - samples)
    area = max(float((samples**2).sum()), 1e-12)
    beyond = values**2 - samples**2
    return (
        float(error.mean()),
        float(error.max()),
        float(np.maximum(-beyond, 0.0).sum()) / area,
        float(np.maximum(beyond, 0.0).sum()) / area,
    )


def measured(scans: Iterable[LaserScan]) -> dict[str, Deviation]:
    """Every method on the ranges as measured, by its label."""
    fitters = methods()
    results: dict[str, list[tuple]] = {label: [] for label in fitters}
    for scan in tqdm(scans, unit="scan", disable=None, leave=False):
        samples = make_range_profile(scan, scan.distances, RADIUS, samples=len(scan.ranges)).values
        seconds = fastest([partial(fit, samples) for fit in fitters.values()])
        for (label, make), spent in zip(fitters.items(), seconds, strict=True):
            fit = make(samples)
            results[label].append((*deviation(fit.values, samples), len(fit.starts), spent))
    return {label: Deviation(*np.array(rows).T) for label, rows in results.items()}


def fastest(calls: list[Callable[[], object]]) -> np.ndarray:
    """The shortest time of each call over interleaved repetitions, shape (n,), s."""
    seconds = np.full(len(calls), np.inf)
    for _ in range(REPEATS):
        for k, call in enumerate(calls):
            begin = time.perf_counter()
            call()
            seconds[k] = min(seconds[k], time.perf_counter() - begin)
    return seconds


def segments_table(scans: int, seed: int) -> str:
    """The Markdown table of so many scans of the authors' lidar: means over them; of the times the median."""
    lines = [
        "| segments | cubics | mean error, mm | largest error, mm | area lost, % | area overclaimed, % | time, us |",
        "|---|--:|--:|--:|--:|--:|--:|",
    ]
    for label, result in measured(random_scans(scans, seed)).items():
        lines.append(
            f"| {label} | {result.segments.mean():.0f} | {1e3 * result.mean.mean():.1f} "
            f"| {1e3 * result.largest.mean():.0f} | {1e2 * result.lost.mean():.2f} | {1e2 * result.claimed.mean():.2f} "
            f"| {1e6 * np.median(result.seconds):.1f} |"
        )
    return "\n".join(lines)


def main() -> int:
    """Print the table; returns the exit code."""
    parser = CommandParser(prog="ablate_segments.py", description=__doc__)
    parser.add_argument("--scans", type=int, default=100, help="number of scans (default: 100)")
    parser.add_argument("--seed", type=int, default=0, help="of worlds and poses (default: 0)")

    def work(options: argparse.Namespace) -> int:
        check_numbers(options, scans=(1, math.inf))
        print(segments_table(options.scans, options.seed))
        return REACHED

    return run_command(parser, None, work)


if __name__ == "__main__":
    sys.exit(main())
