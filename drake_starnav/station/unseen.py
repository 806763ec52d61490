"""What a robot may hit of a world and its lidars do not see, as these look from their own heights."""

import warnings

import numpy as np
from pydrake.geometry import HalfSpace, SceneGraph
from pydrake.multibody.plant import MultibodyPlant

from drake_starnav.station.model_world import FLOOR_TOLERANCE, fixed_geometries, shape_vertices
from drake_starnav.station.robot_interface import RobotInterface
from drake_starnav.worlds.clearance import clearance
from drake_starnav.worlds.footprints import convex_footprint
from drake_starnav.worlds.world import World

UNSEEN = 0.01
"""A warning names what reaches farther than this beyond what a lidar sees of it, m."""
MOST_NAMES = 3
"""The warning names at most this many."""


def warn_of_unseen(plant: MultibodyPlant, scene_graph: SceneGraph, world: World, robot: RobotInterface) -> None:
    """Name what stands in a finalized plant and reaches farther, up to the robot's top, than its lidars see.

    Upright obstacles of a generated world are as high as every robot and need not be looked at.
    """
    if world.model is None and not len(world.spheres):
        return
    inspector, hidden = scene_graph.model_inspector(), {}
    for geometry, X_WG in fixed_geometries(plant, inspector):
        if geometry in robot.floor or isinstance(inspector.GetShape(geometry), HalfSpace):
            continue
        beyond = _beyond_sight(shape_vertices(inspector, geometry, X_WG), robot)
        if beyond > UNSEEN:
            hidden[inspector.GetName(geometry)] = beyond
    if not hidden:
        return
    widest = sorted(hidden, key=hidden.__getitem__, reverse=True)
    names = ", ".join(f"{name} (by {1e3 * hidden[name]:.0f} mm)" for name in widest[:MOST_NAMES])
    more = f" and {len(hidden) - MOST_NAMES} more" if len(hidden) > MOST_NAMES else ""
    heights = " and ".join(f"{height:.3g}" for height in sorted(set(robot.heights)))
    warnings.warn(
        f"world {world.name}: the robot, {robot.top:.3g} m high, may hit what its lidar at a height of {heights} m "
        f"does not see: {names}{more}",
        stacklevel=3,
    )


def _beyond_sight(vertices: np.ndarray, robot: RobotInterface) -> float:
    """How far a convex solid (n, 3) reaches beyond what lidars see of it, m; of what they do not see, all counts."""
    struck = convex_footprint(vertices, FLOOR_TOLERANCE, robot.top)
    if struck is None:
        return 0.0
    seen = [convex_footprint(vertices, height - UNSEEN, height) for height in robot.heights]
    polygons = tuple(polygon for polygon in seen if polygon is not None)
    if not polygons:
        return float(np.ptp(struck, axis=0).max())
    section = World("section", (0.0, 0.0, 0.0), (0.0, 0.0), polygons=polygons)
    return max(0.0, float(clearance(section, struck).max()))
