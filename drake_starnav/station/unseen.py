"""What a robot may hit of a world and its lidars do not see, as these look from their own heights."""

import warnings
from collections.abc import Sequence

import numpy as np
import shapely
from pydrake.geometry import GeometryId, HalfSpace, SceneGraph, SceneGraphInspector, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, ModelInstanceIndex

from drake_starnav.station.model_world import FLOOR_TOLERANCE, find_placed_geometries, find_shadows
from drake_starnav.station.robot_interface import RobotInterface, find_joined_bodies
from drake_starnav.worlds.footprints import make_sphere_footprint
from drake_starnav.worlds.world import World

UNSEEN = 0.01
"""A warning names what reaches farther than this beyond what a lidar sees of it, m."""
GRAZED_HEIGHT = 0.001
"""What begins or ends so near to the height of a lidar is not seen, m."""
MOST_NAMES = 3
"""The warning names at most this many."""


def warn_of_unseen(
    plant: MultibodyPlant,
    scene_graph: SceneGraph,
    world: World,
    robots: Sequence[RobotInterface],
    *,
    own_plant: bool = False,
) -> None:
    """Name what stands in a finalized plant and reaches farther, up to a robot's top, than its lidars see.

    What joints hold counts where it is at first. Upright obstacles of a generated world are as high as every robot and
    need not be looked at, but in a plant of the user's (`own_plant`).
    """
    if not own_plant and world.model is None and not len(world.spheres):
        return
    inspector = scene_graph.model_inspector()
    robot_models = {robot.model for robot in robots}
    if own_plant:  # its other robots are among what moves
        instances = map(ModelInstanceIndex, range(plant.num_model_instances()))
        robot_models |= {model for model in instances if plant.HasBodyNamed("base_link", model)}
    own_bodies = {index for model in robot_models for index in find_joined_bodies(plant, model)}
    bodies = [plant.get_body(index) for index in map(BodyIndex, range(plant.num_bodies())) if index not in own_bodies]
    standing = [
        (geometry, X_WG)
        for hollow in (False, True)
        for geometry, X_WG in find_placed_geometries(plant, inspector, bodies, hollow=hollow)
        if geometry not in robots[0].floor and not isinstance(inspector.GetShape(geometry), HalfSpace)
    ]
    for robot in robots:
        beyond_sight = {inspector.GetName(each): _beyond_sight(inspector, each, X_WG, robot) for each, X_WG in standing}
        _warn_of_shadows(world, robot, {name: by for name, by in beyond_sight.items() if by > UNSEEN})


def _warn_of_shadows(world: World, robot: RobotInterface, hidden_shadows: dict[str, float]) -> None:
    if not hidden_shadows:
        return
    widest_first = sorted(hidden_shadows, key=hidden_shadows.__getitem__, reverse=True)
    named_shapes = ", ".join(f"{name} (by {1e3 * hidden_shadows[name]:.0f} mm)" for name in widest_first[:MOST_NAMES])
    more_text = f" and {len(hidden_shadows) - MOST_NAMES} more" if len(hidden_shadows) > MOST_NAMES else ""
    heights = " and ".join(f"{height:.3g}" for height in sorted(set(robot.heights)))
    warnings.warn(
        f"world {world.name}: the robot, {robot.top:.3g} m high, may hit what its lidar at a height of {heights} m "
        f"does not see: {named_shapes}{more_text}",
        stacklevel=4,
    )


def _beyond_sight(
    inspector: SceneGraphInspector, geometry: GeometryId, X_WG: RigidTransform, robot: RobotInterface
) -> float:
    """How far a shape reaches beyond what lidars see of it, m; of what they do not see, all counts."""
    struck_area, greatest_distance = _find_shadow(inspector, geometry, X_WG, FLOOR_TOLERANCE, robot.top), 0.0
    for lift in () if struck_area.is_empty else (-GRAZED_HEIGHT, GRAZED_HEIGHT):
        seen_cuts = [_find_shadow(inspector, geometry, X_WG, height + lift, height + lift) for height in robot.heights]
        seen_area = shapely.union_all(seen_cuts)
        if seen_area.is_empty:
            return float(np.ptp(shapely.get_coordinates(struck_area), axis=0).max())
        if not seen_area.buffer(UNSEEN).contains(struck_area):
            greatest_distance = max(greatest_distance, shapely.hausdorff_distance(struck_area, seen_area, 0.1))
    return greatest_distance


def _find_shadow(
    inspector: SceneGraphInspector, geometry: GeometryId, X_WG: RigidTransform, low: float, high: float
) -> shapely.Geometry:
    """What a shape covers of the floor by its part between two heights, m."""
    if isinstance(ball := inspector.GetShape(geometry), Sphere):
        disc = make_sphere_footprint(X_WG.translation(), ball.radius(), low, high)
        return shapely.Polygon() if disc is None else shapely.Point(disc[:2]).buffer(disc[2])
    return shapely.union_all([shapely.Polygon(each) for each in find_shadows(inspector, geometry, X_WG, low, high)])
