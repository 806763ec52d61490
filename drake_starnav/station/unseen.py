"""What a robot may hit of a world and its lidars do not see, as these look from their own heights."""

import warnings

import numpy as np
from pydrake.geometry import GeometryId, HalfSpace, SceneGraph, SceneGraphInspector, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant

from drake_starnav.station.model_world import FLOOR_TOLERANCE, fixed_geometries, shape_vertices
from drake_starnav.station.robot_interface import RobotInterface
from drake_starnav.worlds.clearance import clearance
from drake_starnav.worlds.footprints import convex_footprint, sphere_footprint
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
        beyond = _beyond_sight(inspector, geometry, X_WG, robot)
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


def _beyond_sight(
    inspector: SceneGraphInspector, geometry: GeometryId, X_WG: RigidTransform, robot: RobotInterface
) -> float:
    """How far a convex solid reaches beyond what lidars see of it, m; of what they do not see, all counts."""
    looks = [(height - UNSEEN, height) for height in robot.heights]
    if isinstance(ball := inspector.GetShape(geometry), Sphere):
        discs = [
            sphere_footprint(X_WG.translation(), ball.radius(), *part)
            for part in ((FLOOR_TOLERANCE, robot.top), *looks)
        ]
        radius, *seen = [0.0 if disc is None else disc[2] for disc in discs]
        return max(0.0, radius - max(seen)) if any(seen) else 2.0 * radius
    vertices = shape_vertices(inspector, geometry, X_WG)
    struck = convex_footprint(vertices, FLOOR_TOLERANCE, robot.top)
    if struck is None:
        return 0.0
    polygons = tuple(shadow for part in looks if (shadow := convex_footprint(vertices, *part)) is not None)
    if not polygons:
        return float(np.ptp(struck, axis=0).max())
    section = World("section", (0.0, 0.0, 0.0), (0.0, 0.0), polygons=polygons)
    return max(0.0, float(clearance(section, struck).max()))
