"""Robots as models of a plant: read, checked, and put on the floor."""

import dataclasses
import math
import warnings
from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree

import numpy as np
import shapely
from pydrake.geometry import CollisionFilterDeclaration, GeometrySet, SceneGraph
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex, PdControllerGains

from drake_starnav.errors import StarnavError
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario import Scenario
from drake_starnav.station.parser_warnings import parsing
from drake_starnav.station.planar_drive import lowest_point, motorize, put_on_joints
from drake_starnav.station.robot_file import center, effort, hold, robot_urdf
from drake_starnav.station.robot_geometry import (
    actuated_joints,
    carried,
    collision_shapes,
    drive_geometry,
    floor_contact,
    link_poses,
    lowest,
    massless_links,
    robot_outline,
    robot_reach,
)
from drake_starnav.station.robot_wheels import found_wheels, stand_on_wheels

TOLERANCE = 1e-3
"""Of where a model's wheels are, how they are turned, their radii and `robot.radius`, m and rad."""
WHEEL_GAIN = 10.0
"""Velocity servo of the wheels, N m s/rad, if those of `SERVO_LAG` do not need more."""
SERVO_LAG = 0.02
"""A robot's speed follows its wheels' commands within this, s."""
EXACT = 1e-6
"""A model whose axles' middle lies so near to the origin of base_link stays as it is, m."""
ROUND = 0.97
"""A model that covers this share of the disc around it counts as a disc."""
SIMPLIFIED = 0.004
"""Corners are left out where the outline grows by no more than about this, m."""


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
        plant, scene_graph: whose robots they are; see `plant_config`.
        robot, start: its model and size, and (x, y, yaw), m and rad, W.
        name: prefix of the model's own name, to distinguish several robots.

    Raises:
        StarnavError: there is no such model, Drake cannot read it, it lacks what a robot must have, it has no wheels on
            both sides, or it is larger than `robot.radius`.
    """
    path, root = robot_urdf(robot)
    sketch, scene, wheels = MultibodyPlant(1.0), SceneGraph(), None
    sketch.RegisterAsSourceForSceneGraph(scene)
    model = _parsed(Parser(sketch), root, path)
    faults, based = [], sketch.HasBodyNamed("base_link", model)  # else there is nothing from which to measure
    if robot.drive.holonomic and based:
        return _planar(plant, scene_graph, robot, start, (path, root, -lowest_point(sketch, scene, model), name))
    if based:
        try:
            wheels = found_wheels(sketch, scene, model, robot.wheel_joints)
        except ValueError as error:
            faults.append(str(error))
    names = () if wheels is None else (*wheels.left, *wheels.right)
    if wheels is not None and max(map(abs, wheels.middle)) > EXACT:
        center(root, *wheels.middle)
    held = hold(root, names)
    if held and wheels is not None:
        warnings.warn(f"robot model {path}: joints held still: {', '.join(held)}", stacklevel=2)
    model = _parsed(Parser(plant, model_name_prefix=name), root, path)
    floor = None
    if wheels is not None:
        efforts = [effort(root, joint) for joint in names]
        floor = stand_on_wheels(plant, scene_graph, model, wheels, efforts)
    faults += model_faults(plant, scene_graph, model, robot.radius, floor)
    _refuse(faults, path)
    assert floor is not None  # without wheels there is a fault
    _set_gains(plant, scene_graph, model)
    _free_wheels(plant, scene_graph, model)
    X_WB = RigidTransform(RotationMatrix.MakeZRotation(start[2]), [start[0], start[1], -floor])
    plant.SetDefaultFloatingBaseBodyPose(plant.GetBodyByName("base_link", model), X_WB)
    return model


def _planar(
    plant: MultibodyPlant,
    scene_graph: SceneGraph,
    robot: RobotParameters,
    start: tuple[float, float, float],
    file: tuple[str, ElementTree.Element, float, str],
) -> ModelInstanceIndex:
    """`add_robot` of an ideal planar base: its file, how high base_link is above the floor, m, and the prefix."""
    path, root, height, name = file
    held = hold(root, ())
    if held:
        warnings.warn(f"robot model {path}: joints held still: {', '.join(held)}", stacklevel=3)
    put_on_joints(root, height)
    model = _parsed(Parser(plant, model_name_prefix=name), root, path)
    motorize(plant, scene_graph, model, start)
    _refuse(list(model_faults(plant, scene_graph, model, robot.radius, None)), path)
    return model


def _refuse(faults: list[str], path: str) -> None:
    if faults:
        counted = faults if len(faults) == 1 else [f"({k}) {fault}" for k, fault in enumerate(faults, start=1)]
        raise StarnavError(f"robot model {path}: {'; '.join(counted)}")


def _parsed(parser: Parser, root: ElementTree.Element, path: str) -> ModelInstanceIndex:
    with parsing(f"robot model {path}", "a URDF file with one robot"):
        (model,) = parser.AddModelsFromString(ElementTree.tostring(root, encoding="unicode"), "urdf")
    return model


def _set_gains(plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelInstanceIndex) -> None:
    """Let the wheels hold their speeds: a discrete plant does it itself, a continuous one by its `WheelServo`."""
    mass = sum(plant.get_body(index).default_mass() for index in plant.GetBodyIndices(model))
    joints, radii = actuated_joints(plant, model), drive_geometry(plant, scene_graph, model).radii
    for joint, radius in zip(joints, radii, strict=True):
        gain = max(WHEEL_GAIN, mass * radius**2 / SERVO_LAG)
        plant.GetJointActuatorByName(joint.name(), model).set_controller_gains(PdControllerGains(p=0.0, d=gain))


def _free_wheels(plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelInstanceIndex) -> None:
    """Let the wheels touch no link of their robot: Drake excepts only the one that their joint hangs on."""
    turned = [part for joint in actuated_joints(plant, model) for part in carried(plant, model, joint.child_body())]
    links = [plant.get_body(index) for index in plant.GetBodyIndices(model)]
    wheels, all_of_them = (
        GeometrySet([g for body in bodies for g in collision_shapes(plant, scene_graph, body)])
        for bodies in (turned, links)
    )
    apart = CollisionFilterDeclaration().ExcludeBetween(wheels, all_of_them)
    scene_graph.collision_filter_manager().Apply(apart)


def with_own_shape(scenario: Scenario) -> Scenario:
    """The scenario with the shape of the robot's model, of which nothing was said: `robot.radius` is 0."""
    robot = scenario.robot
    shape = own_shape(dataclasses.replace(robot, radius=5.0))  # m; a model may reach so far while it is read
    return dataclasses.replace(scenario, robot=dataclasses.replace(robot, **shape))


def own_shape(robot: RobotParameters) -> dict[str, Any]:
    """`radius`, and `footprint` unless it is round, from a model's collision shapes with all joints at zero."""
    plant, scene_graph = MultibodyPlant(1.0), SceneGraph()
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    model = add_robot(plant, scene_graph, robot, (0.0, 0.0, 0.0))
    outline = robot_outline(plant, scene_graph, link_poses(plant, model))
    if outline is None:
        raise StarnavError(
            f"robot model {robot.model} has no collision shapes that enclose anything; allowed: robot.radius or "
            "robot.footprint"
        )
    hull, radius = shapely.Polygon(outline), float(np.hypot(*outline.T).max())
    if hull.area > ROUND * math.pi * radius**2:
        return {"radius": math.ceil(1e3 * radius) / 1e3}
    simple = hull.simplify(SIMPLIFIED).buffer(SIMPLIFIED, join_style="mitre") if len(outline) > 8 else hull
    corners = shapely.get_coordinates(simple)[:-1].round(4).tolist()
    return {"radius": RobotParameters.radius, "footprint": corners}


def model_faults(
    plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelInstanceIndex, radius: float, floor: float | None
) -> Iterator[str]:
    """What is wrong with a model in a plant not yet finalized, of a `robot.radius`, m.

    `floor`: its height in base_link, m; None if the model has no wheels.
    """
    based = plant.HasBodyNamed("base_link", model)
    if not based:
        yield "it has no link base_link; allowed: link base_link, whose x axis is the robot's heading"
    for name in massless_links(plant, plant.GetBodyIndices(model)):
        yield f"link {name} has no mass; allowed: <inertial> with a mass and an inertia"
    if not based:
        return
    reach, link = robot_reach(plant, scene_graph, link_poses(plant, model))
    if reach > radius + TOLERANCE:
        yield f"link {link} reaches {reach:.3f} m from the robot's axis; allowed: up to robot.radius, {radius:g} m"
    if floor is not None:
        yield from _floor_faults(plant, scene_graph, model, floor)


def _floor_faults(
    plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelInstanceIndex, floor: float
) -> Iterator[str]:
    """What would lift the wheels off the floor."""
    inspector = scene_graph.model_inspector()
    for index, X_BL in link_poses(plant, model).items():
        body = plant.get_body(index)
        for geometry in collision_shapes(plant, scene_graph, body):
            low = lowest(inspector, geometry, X_BL)
            if low < floor - TOLERANCE and floor_contact(inspector, geometry) is None:
                yield (
                    f"link {body.name()} reaches {1e3 * (floor - low):.0f} mm lower than the wheels; allowed: down to "
                    "the floor that they stand on"
                )
