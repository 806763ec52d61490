"""Compare the free area in a star, an IRIS polytope and an ellipse (the paper's Fig. 1).

Run: python scripts/experiments/compare_regions.py --out FOLDER

All three are made from the same scan about the same point, for a point robot: the star of the ranges themselves, the
polytope by Drake's IRIS, and the largest ellipse inscribed in that polytope. The measure is the observed free area that
a region covers; a polytope also extends through gaps between hits and beyond the lidar's range, into unobserved space.
"""

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydrake.geometry.optimization import HPolyhedron, Hyperellipsoid, Iris, IrisOptions, Point, VPolytope
from tqdm import tqdm

from drake_starnav.lidar.laser_scan import USUAL_BODY
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.paper.star_region import range_profile
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.margins import derive_margins
from drake_starnav.scenario.schema import Scenario
from drake_starnav.surroundings import Margins, StarRegion
from drake_starnav.surroundings.bearing_hits import CONNECTED_CHORD
from drake_starnav.surroundings.erosion import smoothed_distances
from drake_starnav.surroundings.star_region import fit_region
from drake_starnav.visualization.world_figure import draw_world
from scripts.experiments.scan_sample import Measured, View, sample_text, sample_views, scan_experiment

EXAMPLES = 3
"""Number of scans in the picture, each of another kind of world."""
STAR, POLYTOPE, ELLIPSE = "#0072B2", "#D55E00", "#009E73"
"""Distinguishable for colour-blind readers (Okabe and Ito, 2008); line styles differ as well."""
OBSTACLES = (
    f"Obstacles given to IRIS: the scan's hits, neighbours less than {CONNECTED_CHORD * USUAL_BODY:g} m apart joined "
    "to line segments (VPolytope), lone hits as points; nothing where no beam returned. Domain: a box of the "
    "lidar's range; the sample point must stay contained."
)


@dataclass(frozen=True)
class Comparison:
    """Three regions about one place, in W.

    Attributes:
        view: the scan.
        star: of a point robot.
        polytope: by IRIS.
        ellipse: the largest one inscribed in the polytope.
        areas: seen free area covered by star, polytope, ellipse, as shares of all seen free area; shape (3,).
        unseen: share of the polytope's area that was not seen.
    """

    view: View
    star: StarRegion
    polytope: HPolyhedron
    ellipse: Hyperellipsoid
    areas: np.ndarray
    unseen: float


def iris_obstacles(points: np.ndarray) -> list[Point | VPolytope]:
    """Hits in the order of their bearings, shape (n, 2), W, m, as sets: segments where connected, else points."""
    following = np.roll(points, -1, axis=0)
    connected = np.hypot(*(following - points).T) < CONNECTED_CHORD * USUAL_BODY
    lone = ~(connected | np.roll(connected, 1))
    segments = [VPolytope(np.column_stack(ends)) for ends in zip(points[connected], following[connected], strict=True)]
    return [*segments, *(Point(point) for point in points[lone])]


def polytope_interval(A: np.ndarray, b: np.ndarray, origin: np.ndarray, rays: np.ndarray) -> np.ndarray:
    """Where rays leave the polytope A x <= b that contains their origin, shape (n,), m.

    Args:
        A: shape (m, 2).
        b: shape (m,).
        origin: shape (2,), m.
        rays: unit vectors, shape (n, 2).
    """
    rate = rays @ A.T
    with np.errstate(divide="ignore"):
        crossing = np.maximum(b - A @ origin, 0.0) / np.where(rate > 0.0, rate, 0.0)
    return np.where(rate > 0.0, crossing, np.inf).min(axis=1)


def ellipse_interval(A: np.ndarray, center: np.ndarray, origin: np.ndarray, rays: np.ndarray) -> np.ndarray:
    """Where rays enter and leave the ellipse |A (x - center)| <= 1, shape (n, 2), m; equal where they miss it.

    Args:
        A: shape (2, 2).
        center, origin: shape (2,), m.
        rays: unit vectors, shape (n, 2).
    """
    u, v = rays @ A.T, A @ (origin - center)
    squared, half, rest = (u * u).sum(axis=1), u @ v, v @ v - 1.0
    root = np.sqrt(np.maximum(half * half - squared * rest, 0.0))
    return np.maximum(np.column_stack((-half - root, -half + root)) / squared[:, None], 0.0)


def sector_area(leave: np.ndarray, enter: np.ndarray | float = 0.0) -> float:
    """Area between two distances at uniform bearings of a full turn, shape (n,), m; m^2."""
    return float((leave**2 - np.minimum(enter, leave) ** 2).sum() * np.pi / len(leave))


def compare(view: View, margins: Margins) -> Comparison:
    """The three regions of one scan and the areas they cover."""
    scan, pose = view.scan, view.pose
    distance = smoothed_distances(scan, margins.smoothing_slack)
    star = fit_region(range_profile(scan, distance, RobotParameters.radius), pose[:2], float(pose[2]) + scan.angle_min)
    half = np.full(2, scan.range_max)
    domain = HPolyhedron.MakeBox(pose[:2] - half, pose[:2] + half)
    options = IrisOptions()
    options.require_sample_point_is_contained = True
    points = scan.points_at(distance, scan.hits, pose)
    polytope = Iris(iris_obstacles(points), pose[:2], domain, options)
    ellipse = polytope.MaximumVolumeInscribedEllipsoid()
    seen = star.free_range
    bearing = star.bearing_0 + 2.0 * np.pi / len(seen) * np.arange(len(seen))
    rays = np.column_stack((np.cos(bearing), np.sin(bearing)))
    leave = polytope_interval(polytope.A(), polytope.b(), pose[:2], rays)
    span = ellipse_interval(ellipse.A(), ellipse.center(), pose[:2], rays)
    covered = (
        sector_area(np.minimum(star.boundary.values, seen)),
        sector_area(np.minimum(leave, seen)),
        sector_area(np.minimum(span[:, 1], seen), span[:, 0]),
    )
    unseen = 1.0 - covered[1] / sector_area(leave)
    return Comparison(view, star, polytope, ellipse, np.array(covered) / sector_area(seen), unseen)


def table(comparisons: list[Comparison]) -> str:
    """Markdown: the mean, the spread and the range over the scans."""
    star, polytope, ellipse = np.array([c.areas for c in comparisons]).T
    rows = [
        ("star / seen free area", star),
        ("IRIS polytope / seen free area", polytope),
        ("inscribed ellipse / seen free area", ellipse),
        ("star / IRIS polytope", star / polytope),
        ("star / inscribed ellipse", star / ellipse),
        ("unseen share of the IRIS polytope", np.array([c.unseen for c in comparisons])),
    ]
    lines = ["| ratio of areas | mean | standard deviation | median | least | greatest |", "|---|--:|--:|--:|--:|--:|"]
    for name, values in rows:
        numbers = (values.mean(), values.std(), np.median(values), values.min(), values.max())
        lines.append(f"| {name} | " + " | ".join(f"{number:.3f}" for number in numbers) + " |")
    return "\n".join(lines)


def filled(color: str, opacity: float) -> dict[str, object]:
    """An outline in a colour and a translucent face in the same."""
    from matplotlib.colors import to_rgba

    return {"edgecolor": color, "facecolor": to_rgba(color, opacity)}


def plot(comparisons: list[Comparison], path: Path) -> None:
    """The regions side by side, each in its world."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot
    from matplotlib.patches import Ellipse, Polygon

    figure, axes = pyplot.subplots(1, len(comparisons), figsize=(13.0, 5.1), layout="constrained", squeeze=False)
    for axis, shown in zip(axes[0], comparisons, strict=True):
        pose = shown.view.pose
        draw_world(axis, shown.view.world, "0.8")
        corners = VPolytope(shown.polytope).vertices().T
        around = np.argsort(np.arctan2(*(corners - corners.mean(axis=0)).T[::-1]))
        U, s, _ = np.linalg.svd(np.linalg.inv(shown.ellipse.A()))
        angle = np.degrees(np.arctan2(U[1, 0], U[0, 0]))
        outline = shown.star.outline()
        axis.add_patch(Polygon(outline, label="star", linewidth=1.4, zorder=2, **filled(STAR, 0.25)))
        axis.add_patch(
            Polygon(corners[around], label="IRIS polytope", linewidth=1.8, ls="--", zorder=3, **filled(POLYTOPE, 0.15))
        )
        axis.add_patch(
            Ellipse(
                shown.ellipse.center(), *(2.0 * s), angle=angle, label="its inscribed ellipse", linewidth=1.8, ls="-.",
                zorder=4, **filled(ELLIPSE, 0.15),
            )
        )  # fmt: skip
        axis.plot(*shown.view.scan.points(pose).T, ".", color="0.1", markersize=2.0, label="hits", zorder=5)
        axis.plot(*pose[:2], "+", color="0.1", markersize=10.0, markeredgewidth=2.0, label="lidar", zorder=5)
        low, high = (pick(np.vstack((outline, corners)), axis=0) for pick in (np.min, np.max))
        middle, half = 0.5 * (low + high), 0.53 * (high - low).max()
        axis.set_xlim(middle[0] - half, middle[0] + half)
        axis.set_ylim(middle[1] - half, middle[1] + half)
        axis.set_aspect("equal")
        axis.set_xticks([])
        axis.set_yticks([])
        star, polytope, ellipse = 100.0 * shown.areas
        axis.set_title(
            f"{shown.view.world.name}: star {star:.0f} %, polytope {polytope:.0f} %, ellipse {ellipse:.0f} %",
            fontsize=11,
        )
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=5, frameon=False)
    figure.savefig(path, dpi=150)
    pyplot.close(figure)


def measure_regions(options: argparse.Namespace) -> Measured:
    """The table, and what draws its picture."""
    lidar, radius = LidarParameters(), RobotParameters().radius
    margins = derive_margins(Scenario("default", None))
    views = sample_views(options.scans, options.seed, lidar, radius)
    comparisons = [compare(view, margins) for view in tqdm(views, unit="scan", disable=None, leave=False)]
    text = (
        f"{sample_text(options)}; {lidar.beams} beams, {lidar.range_max:g} m, noise {lidar.noise:g} m. "
        f"Star of the ranges themselves: all three regions are of a point robot.\n{OBSTACLES}\n"
        "Areas of polytope and ellipse count where they were seen (except in the last row).\n\n"
        f"{table(comparisons)}"
    )
    return text, lambda path: plot(comparisons[:EXAMPLES], path)


def main() -> int:
    """Print the table and write it with its picture; returns the exit code."""
    return scan_experiment("compare_regions.py", __doc__, measure_regions)


if __name__ == "__main__":
    sys.exit(main())
