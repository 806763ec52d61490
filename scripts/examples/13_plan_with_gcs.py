"""Explore with our planner, plan the way home with Drake's `GcsTrajectoryOptimization`, and drive it.

`convex_cover` turns the star-shaped regions of the roadmap into convex sets, free of collisions as the regions are.
The trajectory through them is driven by our controller, with its certificate, around whatever it sees on the way.

Run: python scripts/examples/13_plan_with_gcs.py [--html FILE] [--png FILE]
"""

import argparse
import dataclasses
import logging
import tempfile
from importlib import import_module
from pathlib import Path

import numpy as np
import shapely
from pydrake.geometry.optimization import GraphOfConvexSetsOptions, HPolyhedron, Iris, IrisOptions, Point, VPolytope
from pydrake.planning import GcsTrajectoryOptimization
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, System
from pydrake.systems.primitives import LogVectorOutput

from drake_starnav import (
    ArrivalMonitor,
    CollisionMonitor,
    Parts,
    Recorder,
    Scenario,
    World,
    add_navigation,
    load_scenario,
    make_world,
)
from drake_starnav.plotting import Motion, draw_goal, draw_robot, save_figure, world_axes
from drake_starnav.station import simulated
from drake_starnav.surroundings import StarRegion

follow = import_module("04_fixed_path")  # the example beside this one

BLUE, ORANGE, GREY = "#0072B2", "#D55E00", "#999999"
SEED, SETS = 7, 2
"""Of the room; convex sets of each region, as regions overlap and edges cost time."""
TOLERANCE = 0.004
"""The outline that is given to IRIS lies inside the region by this share of its reach, or a little more."""
LEAST_LEFT = 0.01
"""A region counts as covered once no more than this share of its area is left."""


def convex_cover(region: StarRegion, count: int) -> list[HPolyhedron]:
    """Up to `count` convex sets inside a region, each grown by IRIS from the deepest point that is not covered yet."""
    free = simplified(region)
    if free.is_empty:
        return []
    ring = shapely.get_coordinates(free.exterior)
    edges = [VPolytope(np.column_stack(ends)) for ends in zip(ring, ring[1:], strict=False)]
    x0, y0, x1, y1 = free.bounds
    box, options = HPolyhedron.MakeBox((x0, y0), (x1, y1)), IrisOptions()
    options.require_sample_point_is_contained = True
    center = shapely.Point(region.center)
    seed, left, covered = center if free.contains(center) else free.representative_point(), free, shapely.Polygon()
    sets: list[HPolyhedron] = []
    while len(sets) < count and left.area > LEAST_LEFT * free.area:
        grown = Iris(edges, np.array(seed.coords[0]), box, options)
        area = shapely.MultiPoint(VPolytope(grown).vertices().T).convex_hull
        if not sets or area.intersection(covered).area > 0.0:  # each other one overlaps an earlier one
            sets.append(grown)
            covered = covered.union(area)
        left = left.difference(area)
        seed = shapely.Point(shapely.maximum_inscribed_circle(left).coords[0])
    return sets


def simplified(region: StarRegion) -> shapely.Polygon:
    """A polygon of few edges inside a region; empty where it has no area."""
    values, tolerance = region.boundary.values, TOLERANCE * region.reach
    bearing = region.bearing_0 + 2.0 * np.pi / len(values) * np.arange(len(values))
    rays, reach = np.column_stack((np.cos(bearing), np.sin(bearing))), np.minimum(values, np.roll(values, -1))[:, None]
    corners = region.center + np.hstack((reach * rays, reach * np.roll(rays, -1, axis=0))).reshape(-1, 2)
    inner = shapely.Polygon(corners).buffer(0.0).buffer(-tolerance).simplify(tolerance)
    return max(shapely.get_parts(inner), key=shapely.area, default=shapely.Polygon())


def explored(scenario: Scenario, world: World) -> tuple[list[StarRegion], np.ndarray]:
    """Regions of the roadmap once the goal is reached, the latest scan's last, and the pose (x, y, yaw) there."""
    builder = DiagramBuilder()
    navigation = add_navigation(builder, scenario, Parts(world))
    ArrivalMonitor.AddToBuilder(builder, navigation, tolerance=0.1)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(60.0)

    def value(system: System, port: str):
        return system.GetOutputPort(port).Eval(system.GetMyContextFromRoot(simulator.get_context()))

    pose = navigation.localization("pose")
    here = pose.Eval(pose.get_system().GetMyContextFromRoot(simulator.get_context()))
    latest = value(navigation.perception, "observation").region
    return [*value(navigation.planner, "planner_state").roadmap.regions, latest], here


def planned(regions: list[StarRegion], max_speed: float) -> tuple[np.ndarray, int]:
    """A path through the regions from the centre of the last to the first's, shape (n, 2), m, and the count of sets."""
    sets = [convex for region in regions for convex in convex_cover(region, SETS)]
    gcs = GcsTrajectoryOptimization(2)
    free = gcs.AddRegions(sets, order=3)
    start, home = (gcs.AddRegions([Point(region.center)], order=0) for region in (regions[-1], regions[0]))
    gcs.AddEdges(start, free), gcs.AddEdges(free, home)
    gcs.AddPathLengthCost()
    gcs.AddVelocityBounds([-max_speed, -max_speed], [max_speed, max_speed])
    options = GraphOfConvexSetsOptions()
    options.convex_relaxation, options.max_rounded_paths = True, 20
    trajectory, result = gcs.SolvePath(start, home, options)
    assert result.is_success()
    return trajectory.vector_values(np.linspace(trajectory.start_time(), trajectory.end_time(), 60)).T, len(sets)


def main(html: Path, png: Path | None) -> None:
    """Explore, plan, drive home, and say how it came out."""
    logging.getLogger("drake").setLevel(logging.WARNING)  # Meshcat would name its port
    scenario = load_scenario("room")
    world = make_world(scenario.world, seed=SEED, robot=scenario.robot.radius)
    regions, pose = explored(scenario, world)
    path, sets = planned(regions, scenario.robot.max_speed)
    length = np.hypot(*np.diff(path, axis=0).T).sum()
    print(f"{len(regions)} regions in {sets} convex sets; planned a way home of {length:.2f} m")

    back = dataclasses.replace(world, start=tuple(pose), goal=tuple(path[-1]))
    builder = DiagramBuilder()
    navigation = add_navigation(builder, scenario, Parts(back, planner=follow.FixedPath(follow.resampled(path))))
    ArrivalMonitor.AddToBuilder(builder, navigation, tolerance=0.1)
    CollisionMonitor.AddToBuilder(builder, simulated(navigation.station))
    log = LogVectorOutput(navigation.localization("pose"), builder, 0.05)
    recorder = Recorder.AddToBuilder(builder, navigation, html, scenario)
    simulator = Simulator(builder.Build())
    status = simulator.AdvanceTo(90.0)
    record = log.FindLog(simulator.get_context())
    trail = record.data()
    strayed = np.hypot(*(trail[:2, :, None] - path.T[:, None, :])).min(axis=1).max()
    outcome = f"home: {status.message() or 'out of time'} at {simulator.get_context().get_time():.2f} s"
    print(f"{outcome}, off the trajectory by at most {strayed:.2f} m")
    recorder.finish((outcome,), Motion(record.sample_times(), trail.T))
    if png is not None:
        figure, axis = world_axes(back, "Home on a trajectory through the explored regions")
        for region in regions:
            axis.plot(*region.outline(180).T, color=GREY, linewidth=0.5)
        axis.plot(*path.T, "--", color=ORANGE, label="planned by GCS")
        axis.plot(*trail[:2], color=BLUE, label="driven")
        draw_robot(axis, trail[:, -1], scenario.robot.radius, BLUE)
        draw_goal(axis, back.goal)
        save_figure(figure, png)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--html", type=Path, metavar="FILE", help="keep the recording")
    parser.add_argument("--png", type=Path, metavar="FILE", help="also draw what happened")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        main(options.html or Path(folder) / "home.html", options.png)
