"""Collars, by which the lidars of several robots in one plant see each other."""

from collections.abc import Sequence

from pydrake.geometry import Convex, Cylinder, GeometryId, Role, SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex

from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.schema import Scenario
from drake_starnav.station.lidar_mounts import lidar_poses
from drake_starnav.station.robot_geometry import RobotModel
from drake_starnav.station.world_geometry import upright_prism

COLLAR = 0.03
"""A collar reaches so far above and below the planes of all lidars, m."""
NAME = "collar"


def add_collars(
    plant: MultibodyPlant, scene_graph: SceneGraph, robots: Sequence[Scenario], models: Sequence[ModelInstanceIndex]
) -> None:
    """Give each robot, in a plant not yet finalized, a collar by which the lidars of the others see it."""
    bases = [plant.GetBodyByName("base_link", model) for model in models]
    floors = [float(plant.GetDefaultFloatingBaseBodyPose(base).translation()[2]) for base in bases]
    planes = [
        floor + float(X_BL.translation()[2])
        for each, model, floor in zip(robots, models, floors, strict=True)
        for X_BL in lidar_poses(RobotModel(plant, scene_graph, model), each.all_lidars)
    ]
    low, high = max(min(planes) - COLLAR, 0.01), max(planes) + COLLAR
    for each, base, floor in zip(robots, bases, floors, strict=True):
        for k, (shape, X_BC) in enumerate(_collar(each.robot, low - floor, high - floor)):
            plant.RegisterCollisionGeometry(base, X_BC, shape, f"{NAME}_{k}", CoulombFriction(0.3, 0.3))


def collar_geometries(scene_graph: SceneGraph) -> list[GeometryId]:
    """The collars of all robots in a scene."""
    inspector = scene_graph.model_inspector()
    named = ((g, inspector.GetName(g).rpartition("::")[2]) for g in inspector.GetAllGeometryIds(Role.kProximity))
    return [geometry for geometry, name in named if name.rpartition("_")[0] == NAME]


def _collar(robot: RobotParameters, low: float, high: float) -> list[tuple[Cylinder | Convex, RigidTransform]]:
    """Solid shapes over a robot's footprint between two heights in base_link, m."""
    if robot.shape.is_disc:
        return [(Cylinder(robot.radius, high - low), RigidTransform([0.0, 0.0, 0.5 * (low + high)]))]
    middle = RigidTransform([0.0, 0.0, 0.5 * (low + high)])
    return [(upright_prism(part, high - low, "collar"), middle) for part in robot.shape.parts]
