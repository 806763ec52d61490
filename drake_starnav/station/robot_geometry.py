"""Where the parts of a robot's model are, and how far they reach."""

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

import numpy as np
from pydrake.geometry import (
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    GeometryId,
    ProximityProperties,
    RoleAssign,
    SceneGraph,
    SceneGraphInspector,
    Sphere,
)
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, ModelInstanceIndex, RevoluteJoint, RigidBody

from drake_starnav.errors import StarnavError
from drake_starnav.worlds.footprints import ball_vertices, box_vertices, convex_footprint

FLOOR_CONTACT = ("starnav", "floor")
"""Group and name of a property of a robot's collision shapes."""


def robot_reach(
    plant: MultibodyPlant, scene_graph: SceneGraph, poses: Mapping[BodyIndex, RigidTransform]
) -> tuple[float, str]:
    """How far from base_link's z axis a robot's links at their poses in base_link collide, m, and which of them."""
    inspector, reaches = scene_graph.model_inspector(), [(0.0, "base_link")]
    for body, geometry, X_BG in _extents(plant, scene_graph, poses):
        points, grown = outline(inspector, geometry)
        reaches.append((float(np.hypot(*(X_BG @ points)[:2]).max()) + grown, body.name()))
    return max(reaches)


def robot_outline(
    plant: MultibodyPlant, scene_graph: SceneGraph, poses: Mapping[BodyIndex, RigidTransform]
) -> np.ndarray | None:
    """The convex hull of what a robot's links at their poses in base_link collide with, seen from above.

    Counter-clockwise, shape (n, 2), about base_link's z axis, m; round shapes lie within. None if they enclose nothing.
    """
    inspector, found = scene_graph.model_inspector(), []
    for _, geometry, X_BG in _extents(plant, scene_graph, poses):
        points, grown = outline(inspector, geometry)
        found.append(swollen((X_BG @ points).T, grown))
    return convex_footprint(np.vstack(found), -math.inf, math.inf)


def _extents(
    plant: MultibodyPlant, scene_graph: SceneGraph, poses: Mapping[BodyIndex, RigidTransform]
) -> Iterator[tuple[RigidBody, GeometryId, RigidTransform]]:
    """Shapes with which a robot touches other things than the floor, and where they are in base_link."""
    inspector = scene_graph.model_inspector()
    for index, X_BL in poses.items():
        body = plant.get_body(index)
        for geometry in collision_shapes(plant, scene_graph, body):
            if floor_contact(inspector, geometry) is not True:
                yield body, geometry, X_BL @ inspector.GetPoseInFrame(geometry)


def collision_shapes(plant: MultibodyPlant, scene_graph: SceneGraph, body: RigidBody) -> list[GeometryId]:
    """Those of a body that still collide."""
    inspector = scene_graph.model_inspector()
    return [g for g in plant.GetCollisionGeometriesForBody(body) if inspector.GetProximityProperties(g) is not None]


def set_floor_contact(properties: ProximityProperties, floor: bool) -> None:
    """Say that a shape touches nothing but the floor, or anything but it; `RobotInterface` sees to that."""
    properties.AddProperty(*FLOOR_CONTACT, floor)


def floor_contact(inspector: SceneGraphInspector, geometry: GeometryId) -> bool | None:
    """Whether a shape touches nothing but the floor; None if nothing is said of it."""
    properties = inspector.GetProximityProperties(geometry)
    if properties is None or not properties.HasProperty(*FLOOR_CONTACT):
        return None
    return properties.GetProperty(*FLOOR_CONTACT)


def carried(plant: MultibodyPlant, model: ModelInstanceIndex, link: RigidBody) -> list[RigidBody]:
    """A link of a robot, and all that hang on it."""
    joints, found = [plant.get_joint(index) for index in plant.GetJointIndices(model)], [link]
    for body in found:  # grows
        found += [joint.child_body() for joint in joints if joint.parent_body().index() == body.index()]
    return found


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
        return box_vertices(shape.size()).T, 0.0
    if isinstance(shape, Ellipsoid):
        return ball_vertices(np.array((shape.a(), shape.b(), shape.c()))).T, 0.0
    hull = inspector.GetConvexHull(geometry)
    if hull is None:
        raise StarnavError(
            f"geometry {inspector.GetName(geometry)} is a {type(shape).__name__}; allowed: a solid shape"
        )
    return np.array([hull.vertex(k) for k in range(hull.num_vertices())]).T, 0.0


def swollen(points: np.ndarray, grown: float) -> np.ndarray:
    """Corners of what contains all places so near to some points, shape (n, 3), m."""
    return (points[:, None] + ball_vertices(np.full(3, grown))).reshape(-1, 3) if grown else points


def lowest(inspector: SceneGraphInspector, geometry: GeometryId, X_BL: RigidTransform) -> float:
    """How high the lowest point of a shape is in base_link, in which its link is at X_BL, m."""
    points, grown = outline(inspector, geometry)
    return float(((X_BL @ inspector.GetPoseInFrame(geometry)) @ points)[2].min()) - grown


def keep_off_floor(
    plant: MultibodyPlant, scene_graph: SceneGraph, geometry: GeometryId, properties: ProximityProperties
) -> None:
    """Let a shape with these properties never touch the floor."""
    set_floor_contact(properties, False)
    scene_graph.AssignRole(plant.get_source_id(), geometry, properties, RoleAssign.kReplace)


def actuated_joints(plant: MultibodyPlant, model: ModelInstanceIndex) -> list[RevoluteJoint]:
    """A robot's wheels, in the order of their actuators."""
    actuators = (plant.get_joint_actuator(index) for index in plant.GetJointActuatorIndices())
    return [actuator.joint() for actuator in actuators if actuator.model_instance() == model]


def massless_links(plant: MultibodyPlant, bodies: Iterable[BodyIndex]) -> list[str]:
    """Names of the bodies, in a plant not yet finalized, that move although nothing with a mass moves with them.

    A link that a joint moves may leave the mass to what it carries; a body without any joint, which moves freely, only
    to what is welded to it.
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


class Drive(NamedTuple):
    """Where a robot's wheels touch the floor, in the order of their actuators, each of shape (n,), m.

    `radii` are negative of wheels that turn about -y; `arms` are how far to the right of base_link's z axis they are.
    """

    radii: np.ndarray
    arms: np.ndarray

    def rates(self, v: float | np.ndarray, omega: float | np.ndarray) -> np.ndarray:
        """How fast the wheels turn where the robot drives at v, m/s, and omega, rad/s: rad/s."""
        return (v + self.arms * omega) / self.radii


def drive_geometry(plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelInstanceIndex) -> Drive:
    """Of a robot as from `add_robot`."""
    inspector, poses, drive = scene_graph.model_inspector(), link_poses(plant, model), []
    for joint in actuated_joints(plant, model):
        link = joint.child_body()
        (sphere,) = (g for g in collision_shapes(plant, scene_graph, link) if floor_contact(inspector, g))
        X_BL = poses[link.index()]
        axis = X_BL.rotation() @ (joint.frame_on_child().GetFixedRotationMatrixInBodyFrame() @ joint.revolute_axis())
        y = (X_BL @ inspector.GetPoseInFrame(sphere)).translation()[1]
        drive.append((math.copysign(inspector.GetShape(sphere).radius(), axis[1]), -y))
    return Drive(*np.array(drive).T)


def wheel_rates(plant: MultibodyPlant, model: ModelInstanceIndex) -> np.ndarray:
    """The matrix that takes the wheels' rates, in the order of their actuators, out of the state of a model."""
    rows = []
    for joint in actuated_joints(plant, model):
        rates = np.zeros(plant.num_velocities())
        rates[joint.velocity_start()] = 1.0
        rows.append((*np.zeros(plant.num_positions(model)), *plant.GetVelocitiesFromArray(model, rates)))
    return np.array(rows)
