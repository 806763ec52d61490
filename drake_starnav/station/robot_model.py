"""Robots as models of a plant: read, checked, and put on the floor."""

import itertools
import math
import os
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.geometry import Box, Capsule, Cylinder, Ellipsoid, GeometryId, SceneGraph, SceneGraphInspector, Sphere
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex, PdControllerGains, RevoluteJoint

from drake_starnav.errors import StarnavError, shown
from drake_starnav.robot import RobotParameters
from drake_starnav.utils.resources import model_path
from drake_starnav.worlds.footprints import ball_vertices

WHEELS = ("left_wheel", "right_wheel")
"""Names of the joints, links and actuators that a robot model must have besides `base_link` and frame `lidar`."""
DRAKE_NAMESPACE = "http://drake.mit.edu"
HULL = "hull"
"""Geometries of the shipped robots whose name begins so get the radius of `robot.radius`; wheels stay inside it."""
WHEEL_GAIN = 10.0
"""Velocity servo of the wheels, N m s/rad."""
TOLERANCE = 1e-3
"""Of where a model's lidar and wheels are, how they are turned, its wheels' radii and `robot.radius`, m and rad."""


def robot_urdf(robot: RobotParameters) -> tuple[str, str | None]:
    """The robot's model file; its text too where that differs from the file's.

    The hull of a shipped robot gets the radius `robot.radius`; the base's mass and inertia grow by `robot.mass_error`.
    """
    path = model_path("robots", f"{robot.model}.urdf")
    shipped = os.path.isfile(path)
    if not shipped:
        path = Path(robot.model)
        if path.suffix != ".urdf" or not os.path.isfile(path):
            names = ", ".join(sorted(p.stem for p in model_path("robots").glob("*.urdf")))
            raise StarnavError(f"robot.model is {shown(robot.model)}; allowed: {names}, or the path of a .urdf file")
        if robot.mass_error == 0.0:
            return str(path), None
    ElementTree.register_namespace("drake", DRAKE_NAMESPACE)  # Drake reads the prefix, not the namespace
    try:
        root = ElementTree.fromstring(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, ElementTree.ParseError) as error:
        raise StarnavError(f"robot model {path} cannot be read: {error}; allowed: a URDF file with one robot") from None
    for mesh in root.iter("mesh"):
        name = mesh.get("filename", "")
        if "://" not in name:  # relative to the file, which is unknown once its text is parsed
            mesh.set("filename", f"file://{(path.parent / name).resolve()}")
    if shipped:
        for element in (*root.iter("collision"), *root.iter("visual")):
            cylinder = element.find("geometry/cylinder")
            if element.get("name", "").startswith(HULL) and cylinder is not None:
                cylinder.set("radius", repr(robot.radius))
        _pull_in(root, robot.radius)
    inertial = root.find("link[@name='base_link']/inertial")
    if robot.mass_error != 0.0 and inertial is not None:
        for element in (*inertial.iter("mass"), *inertial.iter("inertia")):
            for key, value in element.attrib.items():
                element.set(key, repr(float(value) * (1.0 + robot.mass_error)))
    text = ElementTree.tostring(root, encoding="unicode")
    return str(path), text


def _pull_in(root: ElementTree.Element, radius: float) -> None:
    """Move wheels and casters towards the axis where they would reach out of a hull of this radius."""
    joints = {joint.find("child").get("link"): joint for joint in root.findall("joint")}  # type: ignore[union-attr]
    for link in root.iter("link"):
        for element in (*link.iter("collision"), *link.iter("visual")):
            sphere = element.find("geometry/sphere")
            moved = joints.get(link.get("name"), element)
            origin = moved.find("origin")
            if sphere is None or origin is None:
                continue
            x, y, z = (float(value) for value in origin.get("xyz", "0 0 0").split())
            far = radius - float(sphere.get("radius", "0"))
            if far <= 0.0:
                raise StarnavError(
                    f"robot.radius is {radius:g}; allowed: more than the model's wheels have, {radius - far:g} m"
                )
            share = min(1.0, far / max(math.hypot(x, y), 1e-9))
            origin.set("xyz", f"{x * share!r} {y * share!r} {z!r}")


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
    parser.package_map().PopulateFromRosPackagePath()
    try:
        # a file of the user's is read where it lies, for the sake of the meshes that it names
        (model,) = parser.AddModels(path) if text is None else parser.AddModelsFromString(text, "urdf")
    except (RuntimeError, ValueError) as error:
        raise StarnavError(
            f"robot model {path} cannot be read: {' '.join(str(error).split())}; allowed: a URDF file with one robot"
        ) from None
    _check_robot(plant, scene_graph, model, path)
    reach, link = robot_reach(plant, scene_graph, model)
    if reach > robot.radius + TOLERANCE:
        raise StarnavError(
            f"robot.radius is {robot.radius:g} m, and link {link} of robot model {path} reaches {reach:.3f} m "
            "from the robot's axis; allowed: a radius that holds all of the robot"
        )
    if plant.time_step() > 0.0:  # a continuous plant has the servo outside: `WheelServo`
        for wheel in WHEELS:
            plant.GetJointActuatorByName(wheel, model).set_controller_gains(PdControllerGains(p=0.0, d=WHEEL_GAIN))
    base = plant.GetBodyByName("base_link", model)
    height = _wheel_radii(plant, scene_graph, model)[0] - _axles(plant, model)[0][2]
    X_WB = RigidTransform(RotationMatrix.MakeZRotation(start[2]), [start[0], start[1], height])
    plant.SetDefaultFloatingBaseBodyPose(base, X_WB)
    return model


def _check_robot(plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelInstanceIndex, path: str) -> None:
    """Raise a `StarnavError` that names the first thing that the model of a file lacks."""
    for kind, names, has in (
        ("link", ("base_link",), plant.HasBodyNamed),
        ("frame", ("lidar",), plant.HasFrameNamed),
        ("joint", WHEELS, plant.HasJointNamed),
        ("actuator", WHEELS, plant.HasJointActuatorNamed),
    ):
        for name in names:
            if not has(name, model):
                raise StarnavError(f"robot model {path} has no {kind} {name}; allowed: {kind} {', '.join(names)}")
    for index in plant.GetJointIndices(model):
        joint = plant.get_joint(index)
        if joint.child_body().name() == "base_link":
            raise StarnavError(
                f"robot model {path}: link base_link hangs by joint {joint.name()} on {joint.parent_body().name()}; "
                "allowed: base_link as the root, to which all else is joined"
            )
    X_BL = plant.GetFrameByName("lidar", model).GetFixedPoseInBodyFrame()
    x, y, _ = X_BL.translation()
    if math.hypot(x, y) > TOLERANCE or not X_BL.rotation().IsNearlyIdentity(TOLERANCE):
        roll, pitch, yaw = RollPitchYaw(X_BL.rotation()).vector()
        raise StarnavError(
            f"robot model {path}: frame lidar lies at x {x:g}, y {y:g} m of base_link, turned by roll {roll:g}, pitch "
            f"{pitch:g}, yaw {yaw:g} rad; allowed: on its z axis, unturned (lidar.angle_min says where beams begin)"
        )
    inspector = scene_graph.model_inspector()
    for name in WHEELS:
        wheel = plant.GetJointByName(name, model).child_body()
        shapes = [type(inspector.GetShape(g)).__name__ for g in plant.GetCollisionGeometriesForBody(wheel)]
        if shapes != ["Sphere"]:
            raise StarnavError(
                f"robot model {path}: link {wheel.name()} collides as {', '.join(shapes) or 'nothing'}; "
                "allowed: one Sphere, of the wheel's radius"
            )
    actuators = _actuators(plant, model)
    if len(actuators) != len(WHEELS):
        raise StarnavError(
            f"robot model {path} has the actuators {', '.join(actuators)}; allowed: {', '.join(WHEELS)}, as the others "
            "would get no command"
        )
    _check_wheels(plant, scene_graph, model, path)


def _check_wheels(plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelInstanceIndex, path: str) -> None:
    """Raise a `StarnavError` if the wheels do not turn the robot about base_link's z axis as commanded."""
    places, radii = _axles(plant, model), _wheel_radii(plant, scene_graph, model)
    (left_x, left_y), (right_x, right_y) = (place[:2] for place in places)
    if max(abs(left_x), abs(right_x), abs(left_y + right_y)) > TOLERANCE or left_y <= right_y:
        raise StarnavError(
            f"robot model {path}: joints {', '.join(WHEELS)} lie at x {left_x:g}, {right_x:g}, y {left_y:g}, "
            f"{right_y:g} m of base_link; allowed: at x 0 and as far to the left (y > 0) as to the right, since the "
            "robot turns about its axis"
        )
    if abs(radii[0] - radii[1]) > TOLERANCE:
        raise StarnavError(f"robot model {path}: wheels have radii {radii[0]:g}, {radii[1]:g} m; allowed: the same")
    for name in WHEELS:
        joint = plant.GetJointByName(name, model)
        if not isinstance(joint, RevoluteJoint):
            kind = type(joint).__name__.split("_")[0]
            raise StarnavError(f"robot model {path}: joint {name} is a {kind}; allowed: continuous or revolute")
        axis = joint.frame_on_parent().GetFixedPoseInBodyFrame().rotation() @ joint.revolute_axis()
        if axis[1] < 1.0 - TOLERANCE:
            x, y, z = (round(float(value), 3) for value in axis)
            raise StarnavError(
                f"robot model {path}: joint {name} turns about {x:g} {y:g} {z:g} of base_link; allowed: 0 1 0, about "
                "which positive speeds drive forwards"
            )


def robot_reach(plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelInstanceIndex) -> tuple[float, str]:
    """How far from base_link's z axis a robot collides, m, and its link that reaches there."""
    base = plant.GetBodyByName("base_link", model).index()
    poses, joints = {base: RigidTransform()}, [plant.get_joint(index) for index in plant.GetJointIndices(model)]
    for _ in joints:  # each round knows the links one joint farther from the base
        for joint in joints:
            parent, child = joint.parent_body().index(), joint.child_body().index()
            if parent in poses and child not in poses:
                X_PF, X_CM = (f.GetFixedPoseInBodyFrame() for f in (joint.frame_on_parent(), joint.frame_on_child()))
                poses[child] = poses[parent] @ X_PF @ X_CM.inverse()
    inspector, reaches = scene_graph.model_inspector(), [(0.0, "base_link")]
    for index, X_BL in poses.items():
        body = plant.get_body(index)
        for geometry in plant.GetCollisionGeometriesForBody(body):
            points, grown = _outline(inspector, geometry)
            reach = float(np.hypot(*((X_BL @ inspector.GetPoseInFrame(geometry)) @ points)[:2]).max()) + grown
            reaches.append((reach, body.name()))
    return max(reaches)


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
    joints = (plant.GetJointByName(name, model) for name in WHEELS)
    return [joint.frame_on_parent().GetFixedPoseInBodyFrame().translation() for joint in joints]


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
