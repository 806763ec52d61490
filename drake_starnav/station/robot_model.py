"""Robots as models of a plant: read, checked, and put on the floor."""

import dataclasses
import math
import re
import warnings
from collections.abc import Iterator
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np
import shapely
from pydrake.geometry import CollisionFilterDeclaration, GeometrySet, SceneGraph
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex, PdControllerGains

from drake_starnav.errors import StarnavError
from drake_starnav.models.parser_warnings import refuse_parser_warnings
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.schema import Scenario
from drake_starnav.station.planar_drive import put_on_joints
from drake_starnav.station.robot_body import (
    HOLDS_ALL,
    add_body,
    add_looks,
    find_overhang_faults,
    find_protrusion,
    read_own_body,
)
from drake_starnav.station.robot_file import ModelText, fix_joints, make_robot_urdf, move_origin, read_effort
from drake_starnav.station.robot_geometry import (
    TOLERANCE,
    RobotModel,
    find_drive_ability,
    find_drive_geometry,
    find_massless_links,
    find_standing_range,
    make_robot_outline,
)
from drake_starnav.station.robot_wheels import Wheels, find_wheels, stand_on_wheels
from drake_starnav.utils.resources import find_model_path

WHEEL_GAIN = 10.0
"""Velocity servo of the wheels, N m s/rad, if those of `SERVO_LAG` do not need more."""
SERVO_LAG = 0.02
"""A robot's speed follows its wheels' commands within this, s."""
SPARE_GRIP = 3.0
"""Wheels must be able to turn a robot by this many times what is asked: casters carry part of its weight, and drag."""
OUTLINE_GROWTH = 0.004
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
            both sides, or it sticks out of its footprint.
    """
    text = make_robot_urdf(robot)
    plan = _plan_standing(text, robot)
    floor, faults = None, list(plan.faults)
    model = RobotModel(plant, scene_graph, _parse_model(Parser(plant, model_name_prefix=name), text.root, text.path))
    if text.body is not None:
        add_body(model, robot.shape, text.body)
        if text.changed:
            add_looks(model, robot.shape, text.body, text.root)
    if plan.planar:
        put_on_joints(model, max(0.0, -model.find_lowest_point(model.poses())), start)
    elif plan.wheels is not None:
        efforts = [read_effort(text.root, joint) for joint in plan.wheels.joints]
        floor = stand_on_wheels(model, plan.wheels, efforts)
    faults += find_model_faults(model, robot, floor)
    if len(faults) > 1:
        faults = [f"({k}) {fault}" for k, fault in enumerate(faults, start=1)]
    if faults:
        raise StarnavError(f"robot model {text.path}: {'; '.join(faults)}")
    if floor is not None:
        _put_on_floor(model, start, floor)
    return model.index


class _StandingPlan(NamedTuple):
    """On what a model is to stand: on joints of a planar base, on wheels, or, by its faults, on nothing."""

    planar: bool
    wheels: Wheels | None
    faults: tuple[str, ...]


def _plan_standing(text: ModelText, robot: RobotParameters) -> _StandingPlan:
    """Find on what a robot stands; in its text, hold all other joints still, and centre it on its axles."""
    plant, scene_graph = _make_empty_plant()
    model = RobotModel(plant, scene_graph, _parse_model(Parser(plant), text.root, text.path))
    has_base = plant.HasBodyNamed("base_link", model.index)  # else there is nothing from which to measure
    planar, wheels = robot.drive.holonomic and has_base, None
    faults: tuple[str, ...] = ()
    if has_base and not planar:
        try:
            wheels = find_wheels(model, robot.wheel_joints)
        except ValueError as error:
            faults = (str(error),)
    if wheels is not None and max(map(abs, wheels.middle)) > 1e-6:
        move_origin(text.root, *wheels.middle)
    held_joints = fix_joints(text.root, () if wheels is None else wheels.joints)
    if held_joints and (planar or wheels is not None):
        warnings.warn(f"robot model {text.path}: joints held still: {', '.join(held_joints)}", stacklevel=3)
    return _StandingPlan(planar, wheels, faults)


def _make_empty_plant() -> tuple[MultibodyPlant, SceneGraph]:
    plant, scene_graph = MultibodyPlant(1.0), SceneGraph()
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    return plant, scene_graph


def _parse_model(parser: Parser, root: ElementTree.Element, path: str) -> ModelInstanceIndex:
    ElementTree.indent(root)  # one element a line, by which the parser names it
    model_text = ElementTree.tostring(root, encoding="unicode")

    def said(message: str) -> str:
        """A message with the link instead of a line of a file that nobody has."""
        match = re.match(r"<literal-string>\.urdf:(\d+): (?:error|warning): ", message)
        if match is None:
            return message
        links = re.findall(r'<link name="([^"]*)"', "\n".join(model_text.splitlines()[: int(match[1])]))
        return f"link {links[-1]}: {message[match.end() :]}" if links else message[match.end() :]

    with refuse_parser_warnings(f"robot model {path}", "a URDF file with one robot", said):
        (model,) = parser.AddModelsFromString(model_text, "urdf")
    return model


def _put_on_floor(robot: RobotModel, start: tuple[float, float, float], floor: float) -> None:
    """Let a robot stand on wheels at (x, y, yaw), m and rad, W, its floor, of a height in base_link, m, at z = 0."""
    _set_gains(robot)
    _exclude_wheel_collisions(robot)
    X_WB = RigidTransform(RotationMatrix.MakeZRotation(start[2]), [*start[:2], -floor])
    robot.plant.SetDefaultFloatingBaseBodyPose(robot.base, X_WB)


def _set_gains(robot: RobotModel) -> None:
    """Let the wheels hold their speeds: a discrete plant does it itself, a continuous one by its `WheelServo`."""
    mass = sum(link.default_mass() for link in robot.links)
    for joint, radius in zip(robot.wheels, find_drive_geometry(robot).radii, strict=True):
        gains = PdControllerGains(p=0.0, d=max(WHEEL_GAIN, mass * radius**2 / SERVO_LAG))
        robot.plant.GetJointActuatorByName(joint.name(), robot.index).set_controller_gains(gains)


def _exclude_wheel_collisions(robot: RobotModel) -> None:
    """Let the wheels touch no link of their robot: Drake excepts only the one that their joint hangs on."""
    turned_parts = [part for joint in robot.wheels for part in robot.find_carried_links(joint.child_body())]
    wheels, all_of_them = (GeometrySet(robot.shapes(*links)) for links in (turned_parts, robot.links))
    filter_declaration = CollisionFilterDeclaration().ExcludeBetween(wheels, all_of_them)
    robot.scene_graph.collision_filter_manager().Apply(filter_declaration)


def add_own_shape(scenario: Scenario) -> Scenario:
    """The scenario with the shape of the robot's model, of which nothing was said: `robot.radius` is 0."""
    robot = scenario.robot
    shape = read_own_shape(dataclasses.replace(robot, radius=4.9))  # m; a model may reach so far while it is read
    return dataclasses.replace(scenario, robot=dataclasses.replace(robot, **shape))


def read_own_shape(robot: RobotParameters) -> dict[str, Any]:
    """`radius`, and `footprint` unless it is round, of a shipped robot; of another one that of its collision shapes."""
    if find_model_path("robots", f"{robot.model}.urdf").is_file():
        return read_own_body(robot.model)
    plant, scene_graph = _make_empty_plant()
    model = add_robot(plant, scene_graph, robot, (0.0, 0.0, 0.0))
    outline = make_robot_outline(RobotModel(plant, scene_graph, model), robot.overhangs.split())
    if outline is None:
        raise StarnavError(
            f"robot model {robot.model} has no collision shapes that enclose anything; allowed: robot.radius or "
            "robot.footprint"
        )
    hull, radius = shapely.Polygon(outline), float(np.hypot(*outline.T).max())
    if hull.area > 0.97 * math.pi * radius**2:  # it counts as the disc around it
        return {"radius": math.ceil(1e3 * radius) / 1e3}
    simple_hull = hull.simplify(OUTLINE_GROWTH).buffer(OUTLINE_GROWTH, join_style="mitre") if len(outline) > 8 else hull
    corners = shapely.get_coordinates(simple_hull)[:-1].round(4).tolist()
    return {"radius": RobotParameters.radius, "footprint": corners}


def find_model_faults(robot: RobotModel, parameters: RobotParameters, floor: float | None) -> Iterator[str]:
    """What is wrong with a model in a plant not yet finalized, of the parameters that were declared.

    `floor`: its height in base_link, m; None if the model has no wheels.
    """
    has_base = robot.plant.HasBodyNamed("base_link", robot.index)
    if not has_base:
        yield "it has no link base_link; allowed: link base_link, whose x axis is the robot's heading"
    for name in find_massless_links(robot.plant, robot.plant.GetBodyIndices(robot.index)):
        yield f"link {name} has no mass; allowed: <inertial> with a mass and an inertia"
    if not has_base:
        return
    by, link = find_protrusion(robot, robot.poses(), parameters)
    if by > TOLERANCE:
        yield f"link {link} sticks out of {parameters.said_of_shape} by {1e3 * by:.0f} mm; allowed: {HOLDS_ALL}"
    yield from find_overhang_faults(robot, parameters, 0.0 if floor is None else floor)
    if floor is None:
        return
    pushing_ability, turning_ability = find_drive_ability(robot)
    for name in ("max_acceleration", "max_deceleration"):
        if pushing_ability < (asked_acceleration := getattr(parameters, name)):
            yield (
                f"its wheels push it with at most {pushing_ability:.3g} m/s^2, and robot.{name} is "
                f"{asked_acceleration:g} m/s^2; allowed: no more, a larger effort of their joints, or less mass"
            )
    top_acceleration, asked_acceleration = turning_ability / SPARE_GRIP, parameters.max_yaw_acceleration
    fault_text = f"robot.max_yaw_acceleration is {asked_acceleration:g} rad/s^2"
    if not parameters.drive.turns_on_the_spot:  # it speeds up or brakes on its tightest circle, and steers
        hardest = max(parameters.limits.max_acceleration, parameters.limits.max_deceleration)
        asked_acceleration += hardest / parameters.least_radius
        fault_text = (
            f"{asked_acceleration:.3g} rad/s^2 are asked of them, by {fault_text} and "
            "robot.max_acceleration or max_deceleration "
        )
        fault_text += f"{hardest:g} m/s^2 on circles of robot.least_radius {parameters.least_radius:g} m"
    if top_acceleration < asked_acceleration:
        yield (
            f"its wheels turn it with at most {top_acceleration:.3g} rad/s^2, and {fault_text}; allowed: no more, "
            "wheels farther apart, a larger effort of their joints, or less inertia about the axis"
        )
    least, largest, middle = find_standing_range(robot, floor)
    if not least < middle < largest:
        yield (
            f"its centre of mass lies at x = {middle:.3g} m, and it stands on the floor from {least:.3g} to "
            f"{largest:.3g} m, so that it tips over; allowed: between, by the <inertial> of its links or by casters"
        )
    for each in robot.find_extents(robot.poses()):
        if each.low < floor - TOLERANCE and each.floor is None:  # what would lift the wheels
            yield (
                f"link {each.link.name()} reaches {1e3 * (floor - each.low):.0f} mm lower than the wheels; allowed: "
                "down to the floor that they stand on"
            )
