"""What a robot's model must have."""

import math
from collections.abc import Iterator

from pydrake.geometry import SceneGraph
from pydrake.math import RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex

from drake_starnav.station.robot_geometry import (
    collision_shapes,
    floor_contact,
    lidar_pose,
    link_poses,
    massless_links,
    outline,
    robot_reach,
)

TOLERANCE = 1e-3
"""Of where a model's lidar and wheels are, how they are turned, its wheels' radii and `robot.radius`, m and rad."""


def missing(plant: MultibodyPlant, model: ModelInstanceIndex) -> Iterator[str]:
    """What the model of a file lacks in names."""
    if not plant.HasBodyNamed("base_link", model):
        yield "it has no link base_link; allowed: link base_link, whose x axis is the robot's heading"
    if not plant.HasFrameNamed("lidar", model):
        yield "it has no frame lidar; allowed: a frame or a link lidar"


def model_faults(
    plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelInstanceIndex, radius: float, floor: float | None
) -> Iterator[str]:
    """What else is wrong with a model.

    Args:
        plant: not yet finalized.
        scene_graph, model: of the plant.
        radius: `robot.radius`, m.
        floor: its height in base_link, m; None if the model has no wheels.
    """
    for name in massless_links(plant, plant.GetBodyIndices(model)):
        yield f"link {name} has no mass; allowed: <inertial> with a mass and an inertia"
    if not plant.HasBodyNamed("base_link", model):
        return
    yield from _lidar_faults(plant, model)
    yield from _reach_faults(plant, scene_graph, model, radius)
    if floor is not None:
        yield from _floor_faults(plant, scene_graph, model, floor)


def _lidar_faults(plant: MultibodyPlant, model: ModelInstanceIndex) -> Iterator[str]:
    if not plant.HasFrameNamed("lidar", model):
        return
    X_BL = lidar_pose(plant, model)
    if X_BL is None:
        yield "frame lidar is not joined to link base_link; allowed: a joint between them"
        return
    x, y, _ = X_BL.translation()
    if math.hypot(x, y) > TOLERANCE or not X_BL.rotation().IsNearlyIdentity(TOLERANCE):
        roll, pitch, yaw = RollPitchYaw(X_BL.rotation()).vector() + 0.0  # no -0
        yield (
            f"frame lidar lies at x {x:g}, y {y:g} m of base_link, turned by roll {roll:g}, pitch {pitch:g}, yaw "
            f"{yaw:g} rad; allowed: on its z axis, unturned (lidar.angle_min says where beams begin)"
        )


def _reach_faults(
    plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelInstanceIndex, radius: float
) -> Iterator[str]:
    reach, link = robot_reach(plant, scene_graph, link_poses(plant, model))
    if reach > radius + TOLERANCE:
        yield f"link {link} reaches {reach:.3f} m from the robot's axis; allowed: up to robot.radius, {radius:g} m"


def _floor_faults(
    plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelInstanceIndex, floor: float
) -> Iterator[str]:
    """What would lift the wheels off the floor."""
    inspector = scene_graph.model_inspector()
    for index, X_BL in link_poses(plant, model).items():
        body = plant.get_body(index)
        for geometry in collision_shapes(plant, scene_graph, body):
            points, grown = outline(inspector, geometry)
            low = float(((X_BL @ inspector.GetPoseInFrame(geometry)) @ points)[2].min()) - grown
            if low < floor - TOLERANCE and floor_contact(inspector, geometry) is None:
                yield (
                    f"link {body.name()} reaches {1e3 * (floor - low):.0f} mm lower than the wheels; allowed: down to "
                    "the floor that they stand on"
                )
