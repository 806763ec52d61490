"""Robots as models of a plant: read, checked, and put on the floor."""

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np
from pydrake.geometry import (
    Box,
    Capsule,
    CollisionFilterDeclaration,
    Cylinder,
    Ellipsoid,
    GeometryId,
    GeometrySet,
    ProximityProperties,
    RoleAssign,
    SceneGraph,
    SceneGraphInspector,
    Sphere,
)
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import BodyIndex, ModelInstanceIndex, PdControllerGains, RevoluteJoint

from drake_starnav.errors import StarnavError
from drake_starnav.robot import RobotParameters
from drake_starnav.station.parser_warnings import none_skipped
from drake_starnav.station.robot_file import WHEELS, robot_urdf
from drake_starnav.worlds.footprints import ball_vertices

WHEEL_GAIN = 10.0
"""Velocity servo of the wheels, N m s/rad."""
CASTER_CLEARANCE = 0.005
"""A sphere this near to the floor, or nearer, is a caster, m."""
TOLERANCE = 1e-3
"""Of where a model's lidar and wheels are, how they are turned, its wheels' radii and `robot.radius`, m and rad."""


def add_robot(
    plant: MultibodyPlant,
    scene_graph: SceneGraph,
    robot: RobotParameters,
    start: tuple[float, float, float],
    *,
    name: str = "",
) -> ModelInstanceIndex:
    """Add a robot, standing on the floor z = 0, to a plant not yet finalized.

    Args:
        plant: whose robots they are; see `plant_config`.
        scene_graph: of the plant.
        robot: its model and size.
        start: (x, y, yaw), m and rad, W.
        name: prefix of the model's own name, to distinguish several robots.

    Raises:
        StarnavError: there is no such model, Drake cannot read it, it lacks what a robot must have, its wheels do not
            turn it about base_link's axis, or it is larger than `robot.radius`.
    """
    path, text = robot_urdf(robot)
    parser = Parser(plant, model_name_prefix=name)
    try:
        with none_skipped(f"robot model {path}"):
            (model,) = parser.AddModelsFromString(text, "urdf")
    except StarnavError:
        raise
    except (RuntimeError, ValueError) as error:
        raise StarnavError(
            f"robot model {path} cannot be read: {' '.join(str(error).split())}; allowed: a URDF file with one robot"
        ) from None
    _check_robot(plant, scene_graph, model, robot, path)
    if plant.time_step() > 0.0:  # a continuous plant has the servo outside: `WheelServo`
        for wheel in WHEELS:
            plant.GetJointActuatorByName(wheel, model).set_controller_gains(PdControllerGains(p=0.0, d=WHEEL_GAIN))
    base = plant.GetBodyByName("base_link", model)
    height = _wheel_radii(plant, scene_graph, model)[0] - _axles(plant, model)[0][2]
    _free_wheels(plant, scene_graph, model)
    _free_casters(plant, scene_graph, model, -height)
    X_WB = RigidTransform(RotationMatrix.MakeZRotation(start[2]), [start[0], start[1], height])
    plant.SetDefaultFloatingBaseBodyPose(base, X_WB)
    return model


def _check_robot(
    plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelInstanceIndex, robot: RobotParameters, path: str
) -> None:
    """Raise a `StarnavError` that names all that the model of a file lacks."""
    faults = [
        *_missing(plant, model, robot.wheel_joints),
        *(
            f"link {name} has no mass; allowed: <inertial> with a mass and an inertia"
            for name in massless_links(plant, plant.GetBodyIndices(model))
        ),
    ]
    wheels = [plant.HasJointNamed(name, model) for name in WHEELS]
    shapes = list(_wheel_shape_faults(plant, scene_graph, model))
    faults += shapes
    if plant.HasBodyNamed("base_link", model):  # else there is nothing from which to measure
        faults += [*_base_faults(plant, model), *_reach_faults(plant, scene_graph, model, robot.radius)]
        if all(wheels):
            faults += _wheel_joint_faults(plant, model, robot.wheel_joints)
            faults += () if shapes else _floor_faults(plant, scene_graph, model)
    _refuse(faults, path)


def _refuse(faults: list[str], path: str) -> None:
    if faults:
        counted = faults if len(faults) == 1 else [f"({k}) {fault}" for k, fault in enumerate(faults, start=1)]
        raise StarnavError(f"robot model {path}: {'; '.join(counted)}")


def _missing(plant: MultibodyPlant, model: ModelInstanceIndex, wheel_joints: tuple[str, str]) -> Iterator[str]:
    if not plant.HasBodyNamed("base_link", model):
        yield "it has no link base_link; allowed: link base_link"
    if not plant.HasFrameNamed("lidar", model):
        yield "it has no frame lidar; allowed: a frame or a link lidar"
    wheels = zip(wheel_joints, WHEELS, strict=True)
    missing = [given for given, name in wheels if not plant.HasJointNamed(name, model)]
    if missing:
        joints = (plant.get_joint(index) for index in plant.GetJointIndices(model))
        turning = [joint.name() for joint in joints if isinstance(joint, RevoluteJoint)]
        yield (
            f"it has no joint{'s' if len(missing) > 1 else ''} {', '.join(missing)}; allowed: robot.wheel_joints: "
            f"[left, right] with two of {', '.join(turning) or 'the joints that turn'}"
        )


def _base_faults(plant: MultibodyPlant, model: ModelInstanceIndex) -> Iterator[str]:
    for index in plant.GetJointIndices(model):
        joint = plant.get_joint(index)
        if joint.child_body().name() == "base_link":
            yield (
                f"link base_link hangs by joint {joint.name()} on {joint.parent_body().name()}; "
                "allowed: base_link as the root, to which all else is joined"
            )
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


def _wheel_shape_faults(plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelInstanceIndex) -> Iterator[str]:
    """What keeps the wheels from rolling."""
    inspector, radii = scene_graph.model_inspector(), []
    for name in WHEELS:
        if not plant.HasJointNamed(name, model):
            continue
        wheel = plant.GetJointByName(name, model).child_body()
        shapes = [inspector.GetShape(g) for g in plant.GetCollisionGeometriesForBody(wheel)]
        if len(shapes) == 1 and isinstance(shapes[0], Sphere):
            radii.append(shapes[0].radius())
            continue
        kinds = ", ".join(type(shape).__name__ for shape in shapes) or "nothing"
        yield f"link {wheel.name()} collides as {kinds}; allowed: one Sphere or Cylinder, of the wheel's radius"
    if len(radii) == 2 and abs(radii[0] - radii[1]) > TOLERANCE:
        yield f"wheels have radii {radii[0]:g}, {radii[1]:g} m; allowed: the same"


def _wheel_joint_faults(
    plant: MultibodyPlant, model: ModelInstanceIndex, wheel_joints: tuple[str, str]
) -> Iterator[str]:
    """What keeps the wheels from turning the robot about base_link's z axis as commanded."""
    given = dict(zip(WHEELS, wheel_joints, strict=True))
    actuators = [given.get(name, name) for name in _actuators(plant, model)]
    if len(actuators) != len(WHEELS):
        yield (
            f"it has the actuators {', '.join(actuators)}; allowed: {', '.join(wheel_joints)}, as the others would "
            "get no command"
        )
    (left_x, left_y), (right_x, right_y) = (place[:2] for place in _axles(plant, model))
    if max(abs(left_x), abs(right_x), abs(left_y + right_y)) > TOLERANCE or left_y <= right_y:
        yield (
            f"joints {', '.join(wheel_joints)} lie at x {left_x:g}, {right_x:g}, y {left_y:g}, {right_y:g} m of "
            "base_link; allowed: at x 0 and as far to the left (y > 0) as to the right, since the robot turns "
            "about its axis"
        )
    for name in WHEELS:
        joint = plant.GetJointByName(name, model)
        if not isinstance(joint, RevoluteJoint):
            kind = type(joint).__name__.split("_")[0]
            yield f"joint {given[name]} is a {kind}; allowed: continuous or revolute"
            continue
        axis = _joint_pose(plant, model, name).rotation() @ joint.revolute_axis()
        if axis[1] < 1.0 - TOLERANCE:
            x, y, z = (round(float(value), 3) for value in axis)
            yield (
                f"joint {given[name]} turns about {x:g} {y:g} {z:g} of base_link; allowed: 0 1 0, about which positive "
                "speeds drive forwards"
            )


def _reach_faults(
    plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelInstanceIndex, radius: float
) -> Iterator[str]:
    reach, link = robot_reach(plant, scene_graph, _link_poses(plant, model))
    if reach > radius + TOLERANCE:
        yield f"link {link} reaches {reach:.3f} m from the robot's axis; allowed: up to robot.radius, {radius:g} m"


def _floor_faults(plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelInstanceIndex) -> Iterator[str]:
    """What would lift the wheels off the floor."""
    inspector = scene_graph.model_inspector()
    floor = _axles(plant, model)[0][2] - _wheel_radii(plant, scene_graph, model)[0]
    for index, X_BL in _link_poses(plant, model).items():
        body = plant.get_body(index)
        for geometry in plant.GetCollisionGeometriesForBody(body):
            points, grown = _outline(inspector, geometry)
            low = float(((X_BL @ inspector.GetPoseInFrame(geometry)) @ points)[2].min()) - grown
            if low < floor - TOLERANCE:
                yield (
                    f"link {body.name()} reaches {1e3 * (floor - low):.0f} mm lower than the wheels; allowed: down to "
                    "the floor that they stand on"
                )


def _free_wheels(plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelInstanceIndex) -> None:
    """Let the wheels touch no link of their robot: Drake excepts only the one that their joint hangs on."""
    shapes = {
        index: plant.GetCollisionGeometriesForBody(plant.get_body(index)) for index in plant.GetBodyIndices(model)
    }
    wheels = [g for name in WHEELS for g in shapes[plant.GetJointByName(name, model).child_body().index()]]
    links = [g for geometries in shapes.values() for g in geometries]
    apart = CollisionFilterDeclaration().ExcludeBetween(GeometrySet(wheels), GeometrySet(links))
    scene_graph.collision_filter_manager().Apply(apart)


def _free_casters(plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelInstanceIndex, floor: float) -> None:
    """Take the friction from the spheres that stand on the floor beside the wheels, as a caster's wheel turns freely.

    Args:
        plant, scene_graph, model: the robot's.
        floor: its height in base_link, m.
    """
    inspector = scene_graph.model_inspector()
    wheels = {plant.GetJointByName(name, model).child_body().index() for name in WHEELS}
    for index, X_BL in _link_poses(plant, model).items():
        for geometry in () if index in wheels else plant.GetCollisionGeometriesForBody(plant.get_body(index)):
            shape = inspector.GetShape(geometry)
            if not isinstance(shape, Sphere):
                continue
            middle = (X_BL @ inspector.GetPoseInFrame(geometry)).translation()
            if middle[2] - shape.radius() < floor + CASTER_CLEARANCE:
                properties = ProximityProperties(inspector.GetProximityProperties(geometry))
                properties.UpdateProperty("material", "coulomb_friction", CoulombFriction(0.0, 0.0))
                scene_graph.AssignRole(plant.get_source_id(), geometry, properties, RoleAssign.kReplace)


def lidar_pose(plant: MultibodyPlant, model: ModelInstanceIndex) -> RigidTransform | None:
    """Of frame `lidar` in base_link, with all joints at zero; None if it is not joined to it."""
    frame = plant.GetFrameByName("lidar", model)
    X_BL = _link_poses(plant, model).get(frame.body().index())
    return None if X_BL is None else X_BL @ frame.GetFixedPoseInBodyFrame()


def robot_reach(
    plant: MultibodyPlant, scene_graph: SceneGraph, poses: Mapping[BodyIndex, RigidTransform]
) -> tuple[float, str]:
    """How far from base_link's z axis a robot's links at their poses in base_link collide, m, and which of them."""
    inspector, reaches = scene_graph.model_inspector(), [(0.0, "base_link")]
    for index, X_BL in poses.items():
        body = plant.get_body(index)
        for geometry in plant.GetCollisionGeometriesForBody(body):
            points, grown = _outline(inspector, geometry)
            reach = float(np.hypot(*((X_BL @ inspector.GetPoseInFrame(geometry)) @ points)[:2]).max()) + grown
            reaches.append((reach, body.name()))
    return max(reaches)


def _link_poses(plant: MultibodyPlant, model: ModelInstanceIndex) -> dict[BodyIndex, RigidTransform]:
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


def _outline(inspector: SceneGraphInspector, geometry: GeometryId) -> tuple[np.ndarray, float]:
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


def _actuators(plant: MultibodyPlant, model: ModelInstanceIndex) -> list[str]:
    """Names of a model's actuators, in their order; the plant need not be finalized."""
    actuators = (plant.get_joint_actuator(index) for index in plant.GetJointActuatorIndices())
    return [actuator.name() for actuator in actuators if actuator.model_instance() == model]


def _axles(plant: MultibodyPlant, model: ModelInstanceIndex) -> list[np.ndarray]:
    """Where the left and the right wheel's joints are, shape (3,), base_link, m."""
    return [_joint_pose(plant, model, name).translation() for name in WHEELS]


def _joint_pose(plant: MultibodyPlant, model: ModelInstanceIndex, name: str) -> RigidTransform:
    """Of a joint in base_link, with all joints at zero; in its parent link if that is not joined to base_link."""
    frame = plant.GetJointByName(name, model).frame_on_parent()
    X_BP = _link_poses(plant, model).get(frame.body().index(), RigidTransform())
    return X_BP @ frame.GetFixedPoseInBodyFrame()


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


def _wheel_radii(plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelInstanceIndex) -> list[float]:
    """Radii of the left and the right wheel's collision spheres, m."""
    bodies = (plant.GetJointByName(name, model).child_body() for name in WHEELS)
    spheres = (plant.GetCollisionGeometriesForBody(body)[0] for body in bodies)
    return [scene_graph.model_inspector().GetShape(sphere).radius() for sphere in spheres]


def drive_geometry(plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelInstanceIndex) -> dict[str, Any]:
    """What `WheelSpeedCommand` asks of a model: wheel radius and track, m, and which actuator is the first."""
    left, right = _axles(plant, model)
    return {
        "wheel_radius": _wheel_radii(plant, scene_graph, model)[0],
        "track": math.hypot(left[0] - right[0], left[1] - right[1]),
        "right_first": _actuators(plant, model)[0] == WHEELS[1],
    }


def wheel_rates(plant: MultibodyPlant, model: ModelInstanceIndex) -> np.ndarray:
    """The matrix that takes the wheels' rates, in the order of their actuators, out of the state of a model."""
    rows = []
    for name in _actuators(plant, model):
        rates = np.zeros(plant.num_velocities())
        rates[plant.GetJointByName(name, model).velocity_start()] = 1.0
        rows.append((*np.zeros(plant.num_positions(model)), *plant.GetVelocitiesFromArray(model, rates)))
    return np.array(rows)
