"""Draw the figures of docs/method.md from a drive through a shipped scenario.

Run: python scripts/maintenance/draw_method.py
"""

import argparse
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_starnav.cli.options import exit_code
from drake_starnav.control import guiding_vector
from drake_starnav.errors import StarnavError
from drake_starnav.navigation import add_navigation
from drake_starnav.planning import PlannerState
from drake_starnav.planning.frontiers import gaps_of
from drake_starnav.planning.roadmap import StarRoadmap, extended
from drake_starnav.scenario.margins import derive_margins
from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.scenario.schema import Scenario
from drake_starnav.surroundings import Observation
from drake_starnav.surroundings.erosion import smoothed_distances
from drake_starnav.surroundings.star_region import StarRegion
from drake_starnav.visualization.world_figure import draw_world
from drake_starnav.worlds import World, clearance

BLUE, ORANGE, GREEN, PURPLE = "#0072B2", "#D55E00", "#009E73", "#CC79A7"
"""Distinguishable for colour-blind readers (Okabe and Ito, 2008); markers and line styles differ as well."""
FOLDER = Path(__file__).parents[2] / "docs" / "images" / "method"
GRID = 40
"""Vectors of the guiding field along the longer side of its picture."""


@dataclass(frozen=True)
class PlannerInput:
    """The state at one time of a drive.

    Attributes:
        scenario: its parameters.
        world: in which the robot drives.
        seen: the latest scan.
        state: of the planner.
        pose: (x, y, yaw) of the robot in W, m and rad.
        trail: shape (n, 2), its previous positions, W, m.
    """

    scenario: Scenario
    world: World
    seen: Observation
    state: PlannerState
    pose: np.ndarray
    trail: np.ndarray

    @property
    def region(self) -> StarRegion:
        """That of the scan."""
        assert self.seen.region is not None
        return self.seen.region


def drive(scenario: Scenario, seed: int, seconds: float) -> PlannerInput:
    """Drive for some seconds and look."""
    builder = DiagramBuilder()
    navigation = add_navigation(builder, scenario, seed=seed)
    simulator = Simulator(builder.Build())

    def value(system: Any, port: str) -> Any:
        return system.GetOutputPort(port).Eval(system.GetMyContextFromRoot(simulator.get_context()))

    trail = []
    for time in np.arange(0.1, seconds + 1e-9, 0.1):
        simulator.AdvanceTo(time)
        trail.append(value(navigation.station, "localization.pose")[:2])
    pose = value(navigation.station, "localization.pose")
    seen, state = value(navigation.perception, "observation"), value(navigation.planner, "planner_state")
    return PlannerInput(scenario, navigation.world, seen, state, np.array(pose), np.array(trail))


def draw_erosion(axis: Any, moment: PlannerInput) -> None:
    """The scan, the discs it may not come near, and the free range of the robot's centre."""
    from matplotlib.collections import PatchCollection
    from matplotlib.patches import Circle

    region = moment.region
    hits = _hits(moment)
    radius = moment.scenario.robot.radius + derive_margins(moment.scenario).preferred
    discs = PatchCollection([Circle(tuple(hit), radius) for hit in hits], facecolor=ORANGE, alpha=0.06, linewidth=0.0)
    axis.add_collection(discs)
    axis.plot(*hits.T, ".", color=ORANGE, markersize=4.0, label="hit, with its disc")
    axis.plot(*_around(region.center, region.bearing_0, region.free_range).T, color=BLUE, label="free range")
    _robot(axis, moment)


def draw_cubics(axis: Any, moment: PlannerInput) -> None:
    """The boundary over the bearing: the free range, and the cubics that lie inside it."""
    region = moment.region
    bearings = np.degrees(np.arange(len(region.free_range)) * 2.0 * np.pi / len(region.free_range))
    axis.fill_between(bearings, region.free_range, color=BLUE, alpha=0.15, linewidth=0.0, label="free range")
    starts = [*region.boundary.starts, len(bearings)]
    for k, (first, end) in enumerate(zip(starts[:-1], starts[1:], strict=True)):
        color, label = (ORANGE, GREEN)[k % 2], f"{len(starts) - 1} cubics, none above it" if k == 0 else None
        axis.plot(bearings[first:end], region.boundary.values[first:end], color=color, linewidth=1.8, label=label)
    axis.set_xlabel("bearing in degrees")
    axis.set_ylabel("distance in m")
    axis.set_xlim(0.0, 360.0)
    axis.set_ylim(bottom=0.0)


def draw_frontiers(axis: Any, moment: PlannerInput) -> None:
    """The star-shaped region of the scan, and where unknown space may be entered."""
    region = moment.region
    axis.fill(*region.outline().T, facecolor=BLUE, alpha=0.2, edgecolor=BLUE, label="star-shaped region")
    radius = moment.scenario.robot.radius
    alone = StarRoadmap.empty(moment.scenario.planner, radius)
    alone = extended(alone, moment.seen, derive_margins(moment.scenario), radius)
    for k, gap in enumerate(gaps_of(alone, radius, 0)):
        axis.plot(*gap.line.T, color=PURPLE, linewidth=3.0, label=None if k else "gap, a frontier")
        middle = len(gap.line) // 2
        axis.plot(*gap.line[middle], "o", color=PURPLE, markersize=5.0, label=None if k else "frontier point")
        axis.plot(*gap.probe[middle], "x", color=PURPLE, markersize=5.0, label=None if k else "its probe")
    _robot(axis, moment)


def draw_roadmap(axis: Any, moment: PlannerInput) -> None:
    """All regions, the graph of their centres, open frontiers, and the path to the short-term goal."""
    from matplotlib.collections import LineCollection

    roadmap = moment.state.roadmap
    for region in roadmap.regions:
        axis.fill(*region.outline().T, facecolor=BLUE, alpha=0.08, linewidth=0.0)
    centers = roadmap.union.center
    axis.add_collection(LineCollection(centers[roadmap.edges], color=BLUE, linewidth=0.8, zorder=2))
    axis.plot(*centers.T, "o", color=BLUE, markersize=5.0, label="node, with its region", zorder=3)
    frontiers = moment.state.frontiers(moment.scenario.robot.radius)
    axis.add_collection(LineCollection(frontiers, color=PURPLE, linewidth=2.5, label="frontier", zorder=3))
    axis.plot(*moment.trail.T, color="0.3", linewidth=1.0, linestyle=":", label="driven")
    path = np.vstack((moment.pose[:2], moment.state.path))
    axis.plot(*path.T, color=GREEN, linewidth=2.2, label="path", zorder=4)
    axis.plot(*path[1], "D", color=GREEN, markersize=7.0, label="short-term goal", zorder=5, linestyle="none")
    axis.plot(*moment.world.goal, "*", color=ORANGE, markersize=14.0, label="goal", zorder=5, linestyle="none")
    _robot(axis, moment)


def draw_field(axis: Any, moment: PlannerInput) -> None:
    """The guiding vector at many places: bent along the boundary of the regions, towards the short-term goal."""
    robot, union, path = moment.scenario.robot, moment.state.roadmap.union, moment.state.path
    x0, y0, x1, y1 = moment.world.extent
    step = max(x1 - x0, y1 - y0) / GRID
    places = np.stack(np.meshgrid(np.arange(x0, x1, step), np.arange(y0, y1, step)), axis=-1).reshape(-1, 2)
    inside = np.any([region.contains(places) for region in moment.state.roadmap.regions], axis=0)
    places = places[inside & (clearance(moment.world, places) > robot.radius)]
    vectors = np.array([guiding_vector(*p, path[:1], union, robot.radius)[:2] for p in places])
    for region in moment.state.roadmap.regions:
        axis.fill(*region.outline().T, facecolor=BLUE, alpha=0.06, linewidth=0.0)
    axis.quiver(*places.T, *vectors.T, angles="xy", scale=1.25 / step, scale_units="xy", width=0.003, color="0.25")
    axis.plot(*path[0], "D", color=GREEN, markersize=8.0, label="short-term goal", linestyle="none")
    _robot(axis, moment)


FIGURES: dict[str, tuple[Callable[[Any, PlannerInput], None], bool]] = {
    "erosion": (draw_erosion, True),
    "cubics": (draw_cubics, False),
    "frontiers": (draw_frontiers, True),
    "roadmap": (draw_roadmap, True),
    "field": (draw_field, True),
}
"""For each figure, its drawing function and whether it is a map of the world."""


def write_figures(moment: PlannerInput, folder: Path) -> list[Path]:
    """Draw all figures as PNG files; returns their paths."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    folder.mkdir(parents=True, exist_ok=True)
    x0, y0, x1, y1 = moment.world.extent
    height = 5.0 * (y1 - y0) / (x1 - x0)
    files = []
    for name, (draw, is_map) in FIGURES.items():
        figure, axis = pyplot.subplots(figsize=(5.2, height + 0.7) if is_map else (6.4, 3.2), layout="constrained")
        if is_map:
            draw_world(axis, moment.world)
            axis.set_aspect("equal")
            axis.set_xlim(x0 - 0.1, x1 + 0.1)
            axis.set_ylim(y0 - 0.1, y1 + 0.1)
            axis.set_axis_off()
        draw(axis, moment)
        figure.legend(loc="outside lower center", ncols=3, frameon=False, fontsize=9)
        files.append(folder / f"{name}.png")
        figure.savefig(files[-1], dpi=110)
        pyplot.close(figure)
    return files


def _hits(moment: PlannerInput) -> np.ndarray:
    scan, pose = moment.seen.scan, moment.seen.pose
    distance = smoothed_distances(scan, derive_margins(moment.scenario).smoothing_slack)
    points = _around(pose[:2], float(pose[2]) + scan.angle_min, distance)
    return points[distance < scan.range_max]


def _around(center: np.ndarray, bearing_0: float, distance: np.ndarray) -> np.ndarray:
    theta = bearing_0 + 2.0 * np.pi / len(distance) * np.arange(len(distance))
    return center + distance[:, None] * np.column_stack((np.cos(theta), np.sin(theta)))


def _robot(axis: Any, moment: PlannerInput) -> None:
    from matplotlib.patches import Circle

    x, y, yaw = moment.pose
    radius = moment.scenario.robot.radius
    axis.add_patch(Circle((x, y), radius, facecolor="white", edgecolor="black", linewidth=1.2, zorder=6))
    axis.plot((x, x + radius * np.cos(yaw)), (y, y + radius * np.sin(yaw)), color="black", linewidth=1.2, zorder=7)


def main() -> int:
    """Draw the figures; see `--help`. Returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenario", nargs="?", default="room", help="a shipped scenario or a YAML file (default: room)")
    parser.add_argument("--seed", type=int, default=7, help="of world and noise (default: 7)")
    parser.add_argument("--time", type=float, default=5.0, help="when to look, s (default: 5)")
    parser.add_argument("--out", type=Path, default=FOLDER, metavar="FOLDER", help="default: docs/images/method")
    options = parser.parse_args()
    return exit_code("draw_method.py", lambda: draw(options))


def draw(options: argparse.Namespace) -> int:
    """Drive and write the figures; returns the exit code."""
    if not 0.1 <= options.time <= 1000.0:
        raise StarnavError(f"--time is {options.time:g}; allowed: 0.1 <= x <= 1000 s")
    moment = drive(load_scenario(options.scenario), options.seed, options.time)
    if not len(moment.state.path):
        raise StarnavError(f"--time is {options.time:g} s, when there is no path; allowed: a time before arrival")
    for file in write_figures(moment, options.out):
        print(f"wrote {file}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
