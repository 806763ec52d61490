"""Where the parts of a robot's model are, and how far they reach."""

import itertools
import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from pydrake.geometry import (
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    GeometryId,
    SceneGraph,
    SceneGraphInspector,
    Sphere,
)
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, ModelInstanceIndex

from drake_starnav.errors import StarnavError
from drake_starnav.station.robot_file import WHEELS
from drake_starnav.worlds.footprints import ball_vertices


def lidar_pose(plant: MultibodyPlant, model: ModelInstanceIndex) -> RigidTransform | None:
    """Of frame `lidar` in base_link, with all joints at zero; None if it is not joined to it."""
    frame = plant.GetFrameByName("lidar", model)
    X_BL = link_poses(plant, model).get(frame.body().index())
    return None if X_BL is None else X_BL @ frame.GetFixedPoseInBodyFrame()


def robot_reach(
    plant: MultibodyPlant, scene_graph: SceneGraph, poses: Mapping[BodyIndex, RigidTransform]
) -> tuple[float, str]:
    """How far from base_link's z axis a robot's links at their poses in base_link collide, m, and which of them."""
    inspector, reaches = scene_graph.model_inspector(), [(0.0, "base_link")]
    for index, X_BL in poses.items():
        body = plant.get_body(index)
        for geometry in plant.GetCollisionGeometriesForBody(body):
            points, grown = outline(inspector, geometry)
            reach = float(np.hypot(*((X_BL @ inspector.GetPoseInFrame(geometry)) @ points)[:2]).max()) + grown
            reaches.append((reach, body.name()))
    return max(reaches)


def link_poses(plant: MultibodyPlant, model: ModelInstanceIndex) -> dict[BodyIndex, RigidTransform]:
    """Where a robot's links are in base_link, with all joints at zero."""
    base = plant.GetBodyByName("base_link", model).index()
    poses, joints = {base: RigidTransform()}, [plant.get_joint(index) for index in plant.GetJointIndices(model)]
    for _ in joints:  # each round knows the links one joint farther from the base
        for joint in joints:
            parent, child = joint.parent_body().index(), joint.child_body().index()
            if parent in poses and child not in poses:
                X_PF, X_CM = (f.GetFixedPoseInBodyFrame() for f in (joint.frame_on_parent(), joint.frame_on_child()))
                poses[child] = poses[parent] @ X_PF @ X_CM.inverse()
    return poses


def outline(inspector: SceneGraphInspector, geometry: GeometryId) -> tuple[np.ndarray, float]:
    """Points of a shape in its own frame, shape (3, n), m, and by what it reaches beyond them, m."""
    shape = inspector.GetShape(geometry)
    if isinstance(shape, Sphere):
        return np.zeros((3, 1)), shape.radius()
    if isinstance(shape, Capsule):
        return np.array([[0.0, 0.0], [0.0, 0.0], [-0.5 * shape.length(), 0.5 * shape.length()]]), shape.radius()
    if isinstance(shape, Cylinder):
        angle = np.linspace(0.0, 2.0 * math.pi, 73)
        rim = shape.radius() * np.vstack((np.cos(angle), np.sin(angle)))
        half = np.full((1, len(angle)), 0.5 * shape.length())
        return np.hstack((np.vstack((rim, half)), np.vstack((rim, -half)))), 0.0
    if isinstance(shape, Box):
        return 0.5 * shape.size()[:, None] * np.array(list(itertools.product((-1.0, 1.0), repeat=3))).T, 0.0
    if isinstance(shape, Ellipsoid):
        return ball_vertices(np.array((shape.a(), shape.b(), shape.c()))).T, 0.0
    hull = inspector.GetConvexHull(geometry)
    if hull is None:
        raise StarnavError(
            f"geometry {inspector.GetName(geometry)} is a {type(shape).__name__}; allowed: a solid shape"
        )
    return np.array([hull.vertex(k) for k in range(hull.num_vertices())]).T, 0.0


def joint_pose(plant: MultibodyPlant, model: ModelInstanceIndex, name: str) -> RigidTransform:
    """Of a joint in base_link, with all joints at zero; in its parent link if that is not joined to base_link."""
    frame = plant.GetJointByName(name, model).frame_on_parent()
    X_BP = link_poses(plant, model).get(frame.body().index(), RigidTransform())
    return X_BP @ frame.GetFixedPoseInBodyFrame()


def axles(plant: MultibodyPlant, model: ModelInstanceIndex) -> list[np.ndarray]:
    """Where the left and the right wheel's joints are, shape (3,), base_link, m."""
    return [joint_pose(plant, model, name).translation() for name in WHEELS]


def wheel_radii(plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelInstanceIndex) -> list[float]:
    """Radii of the left and the right wheel's collision spheres, m."""
    bodies = (plant.GetJointByName(name, model).child_body() for name in WHEELS)
    spheres = (plant.GetCollisionGeometriesForBody(body)[0] for body in bodies)
    return [scene_graph.model_inspector().GetShape(sphere).radius() for sphere in spheres]


def actuator_names(plant: MultibodyPlant, model: ModelInstanceIndex) -> list[str]:
    """Names of a model's actuators, in their order; the plant need not be finalized."""
    actuators = (plant.get_joint_actuator(index) for index in plant.GetJointActuatorIndices())
    return [actuator.name() for actuator in actuators if actuator.model_instance() == model]


def massless_links(plant: MultibodyPlant, bodies: Iterable[BodyIndex]) -> list[str]:
    """Names of the bodies that move although there is nothing with a mass that moves with them.

    A link that a joint moves may leave the mass to what it carries; a body without any joint, which moves freely, only
    to what is welded to it.

    Args:
        plant: not yet finalized.
        bodies: all that are asked about.
    """
    joints = [plant.get_joint(index) for index in plant.GetJointIndices()]
    on = {joint.child_body().index(): joint.parent_body().index() for joint in joints}
    welded = {joint.child_body().index() for joint in joints if joint.num_velocities() == 0}
    heavy = {plant.world_body().index()}
    for body in map(BodyIndex, range(1, plant.num_bodies())):
        if plant.get_body(body).default_mass() > 0.0:
            carrier, turned = body, False
            while carrier in on:
                heavy.add(carrier)
                turned = turned or carrier not in welded
                carrier = on[carrier]
            if not turned:
                heavy.add(carrier)
    return [plant.get_body(body).name() for body in bodies if body not in heavy and body not in welded]


def drive_geometry(plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelInstanceIndex) -> dict[str, Any]:
    """What `WheelSpeedCommand` asks of a model: wheel radius and track, m, and which actuator is the first."""
    left, right = axles(plant, model)
    return {
        "wheel_radius": wheel_radii(plant, scene_graph, model)[0],
        "track": math.hypot(left[0] - right[0], left[1] - right[1]),
        "right_first": actuator_names(plant, model)[0] == WHEELS[1],
    }


def wheel_rates(plant: MultibodyPlant, model: ModelInstanceIndex) -> np.ndarray:
    """The matrix that takes the wheels' rates, in the order of their actuators, out of the state of a model."""
    rows = []
    for name in actuator_names(plant, model):
        rates = np.zeros(plant.num_velocities())
        rates[plant.GetJointByName(name, model).velocity_start()] = 1.0
        rows.append((*np.zeros(plant.num_positions(model)), *plant.GetVelocitiesFromArray(model, rates)))
    return np.array(rows)
