"""Compare rules for the segments of a star's boundary (the paper's Fig. 5).

Run: python scripts/experiments/ablate_segments.py --out FOLDER

Fits the free range of scans of every kind of world with adaptive segments, with the slope rule of the paper's authors
and with fixed numbers of segments, each two-sided (least squares) and one-sided (lowered until it lies inside the free
range).
"""

import argparse
import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from tqdm import tqdm

from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.paper.star_region import fit_boundary, range_profile
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.margins import derive_margins
from drake_starnav.scenario.schema import Scenario
from drake_starnav.surroundings.erosion import BEARINGS, free_range, smoothed_distances
from drake_starnav.surroundings.piecewise_cubic import PiecewiseCubic, fit_piecewise_cubic, fit_segments
from scripts.experiments.scan_sample import Measured, View, sample_text, sample_views, scan_experiment

FIXED = (4, 8, 16, 32, 64)
RADIUS = RobotParameters.radius
"""Of the robot, m."""
REPEATS = 7
"""Repetitions of each timed fit, methods in turn; the fastest counts, which excludes other load."""
STYLES = {"two-sided": ("#0072B2", "o", -0.15), "one-sided": ("#D55E00", "D", 0.15)}
"""Colour (for colour-blind readers: Okabe and Ito, 2008), marker, and offset within the row of the plot."""


@dataclass(frozen=True)
class Method:
    """One way to place segments, in one kind of fit, which is one-sided or two-sided."""

    side: str
    label: str
    fit: Callable[[np.ndarray], PiecewiseCubic]


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


def methods() -> list[Method]:
    """All rows of the table."""
    rows = []
    for one_sided in (False, True):
        side = "one-sided" if one_sided else "two-sided"
        rows.append(Method(side, "adaptive", partial(fit_piecewise_cubic, radius=RADIUS, one_sided=one_sided)))
        rows.append(Method(side, "slope (paper)", partial(fit_slopes, one_sided=one_sided)))
        rows += [Method(side, f"{n} fixed", partial(fit_equal, count=n, one_sided=one_sided)) for n in FIXED]
    return rows


def fit_equal(samples: np.ndarray, count: int, one_sided: bool) -> PiecewiseCubic:
    """Cubics over `count` segments of equal length."""
    return fit_segments(samples, np.linspace(0, len(samples), count + 1).astype(np.int64), np.inf, one_sided)


def fit_slopes(samples: np.ndarray, one_sided: bool = False) -> PiecewiseCubic:
    """Cubics that begin where the boundary jumps or its direction has changed."""
    return fit_boundary(samples, one_sided=one_sided)


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


def measured(rows: list[Method], views: Iterable[View], samples_of: Callable[[View], np.ndarray]) -> list[Deviation]:
    """Every method on the same samples, as `eroded` or `raw`, one `Deviation` a row."""
    results: list[list[tuple]] = [[] for _ in rows]
    for view in tqdm(views, unit="scan", disable=None, leave=False):
        samples = samples_of(view)
        fits = [row.fit(samples) for row in rows]
        seconds = fastest([partial(row.fit, samples) for row in rows])
        for result, fit, spent in zip(results, fits, seconds, strict=True):
            result.append((*deviation(fit.values, samples), len(fit.starts), spent))
    return [Deviation(*np.array(result).T) for result in results]


def eroded(view: View) -> np.ndarray:
    """The free range of the robot's centre, shape (M,), m, of which `star` makes its regions."""
    return free_range(
        view.scan, smoothed_distances(view.scan), RADIUS, derive_margins(Scenario("default", None))
    ).values


def raw(view: View) -> np.ndarray:
    """The ranges as measured, shape (M,), m, of which the paper makes them."""
    return range_profile(view.scan, view.scan.distances, RADIUS, samples=len(view.scan.ranges)).values


def fastest(calls: list[Callable[[], object]]) -> np.ndarray:
    """The shortest time of each call over interleaved repetitions, shape (n,), s."""
    seconds = np.full(len(calls), np.inf)
    for _ in range(REPEATS):
        for k, call in enumerate(calls):
            begin = time.perf_counter()
            call()
            seconds[k] = min(seconds[k], time.perf_counter() - begin)
    return seconds


def table(rows: list[Method], results: list[Deviation]) -> str:
    """Markdown: means over the scans; of the times the median."""
    lines = [
        "| fit | segments | cubics | mean error, mm | largest error, mm | area lost, % | area overclaimed, % "
        "| time, us |",
        "|---|---|--:|--:|--:|--:|--:|--:|",
    ]
    for row, result in zip(rows, results, strict=True):
        lines.append(
            f"| {row.side} | {row.label} | {result.segments.mean():.0f} | {1e3 * result.mean.mean():.1f} "
            f"| {1e3 * result.largest.mean():.0f} | {1e2 * result.lost.mean():.2f} | {1e2 * result.claimed.mean():.2f} "
            f"| {1e6 * np.median(result.seconds):.1f} |"
        )
    return "\n".join(lines)


def plot(rows: list[Method], results: list[Deviation], path: Path) -> None:
    """Medians with quartiles over the scans: one line for each way to place segments, one column for each measure."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    columns = [
        ("mean error (mm)", "log", lambda result: 1e3 * result.mean),
        ("largest error (mm)", "log", lambda result: 1e3 * result.largest),
        ("free area lost (%)", "log", lambda result: 1e2 * result.lost),
        ("time of one fit (µs)", "linear", lambda result: 1e6 * result.seconds),
    ]
    labels = list(dict.fromkeys(row.label for row in rows))
    figure, axes = pyplot.subplots(1, len(columns), figsize=(12.0, 3.9), sharey=True, layout="constrained")
    for axis, (title, scale, value) in zip(axes, columns, strict=True):
        for row, result in zip(rows, results, strict=True):
            color, marker, shift = STYLES[row.side]
            low, middle, high = np.percentile(value(result), (25, 50, 75))
            y = labels.index(row.label) + shift
            axis.plot((low, high), (y, y), color=color, linewidth=2.0, alpha=0.5, solid_capstyle="butt")
            axis.plot(middle, y, color=color, marker=marker, markersize=7.5, linestyle="", label=row.side)
        axis.set_xscale(scale)
        if scale == "linear":
            axis.set_xlim(left=0.0)
        axis.axhspan(-0.5, 0.5, color="0.5", alpha=0.12, linewidth=0.0)
        axis.set_title(title, fontsize=11)
        axis.grid(axis="x", alpha=0.3, linewidth=0.6)
        axis.tick_params(axis="y", length=0)
        axis.spines[["top", "right", "left"]].set_visible(False)
    axes[0].set_yticks(range(len(labels)), labels)
    axes[0].set_ylim(len(labels) - 0.5, -0.5)
    handles = dict(zip(*reversed(axes[0].get_legend_handles_labels()), strict=True))
    figure.legend(
        handles.values(),
        [f"{side} fit" for side in handles],
        title="median and quartiles over the scans",
        loc="outside lower center",
        ncols=2,
        frameon=False,
    )
    figure.savefig(path, dpi=150)
    pyplot.close(figure)


def measure_segments(options: argparse.Namespace) -> Measured:
    """The table, and what draws its plot."""
    lidar, radius = LidarParameters(), RobotParameters().radius
    rows = methods()
    results = measured(rows, sample_views(options.scans, options.seed, lidar, radius), eroded)
    text = (
        f"{sample_text(options)}; {lidar.beams} beams, noise {lidar.noise:g} m; the free range has "
        f"{BEARINGS} bearings. Means over the scans; of the times the median.\n\n"
        f"{table(rows, results)}"
    )
    return text, lambda path: plot(rows, results, path)


def main() -> int:
    """Print the table and write it with its plot; returns the exit code."""
    return scan_experiment("ablate_segments.py", __doc__, measure_segments)


if __name__ == "__main__":
    sys.exit(main())
