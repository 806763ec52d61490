"""What a robot's model must have."""

import math
from collections.abc import Iterator

from pydrake.geometry import (
    SceneGraph,
    Sphere,
)
from pydrake.math import RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex, RevoluteJoint

from drake_starnav.errors import StarnavError
from drake_starnav.robot import RobotParameters
from drake_starnav.station.robot_file import WHEELS
from drake_starnav.station.robot_geometry import (
    actuator_names,
    axles,
    joint_pose,
    lidar_pose,
    link_poses,
    massless_links,
    outline,
    robot_reach,
    wheel_radii,
)

TOLERANCE = 1e-3
"""Of where a model's lidar and wheels are, how they are turned, its wheels' radii and `robot.radius`, m and rad."""


def check_robot(
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
    actuators = [given.get(name, name) for name in actuator_names(plant, model)]
    if len(actuators) != len(WHEELS):
        yield (
            f"it has the actuators {', '.join(actuators)}; allowed: {', '.join(wheel_joints)}, as the others would "
            "get no command"
        )
    (left_x, left_y), (right_x, right_y) = (place[:2] for place in axles(plant, model))
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
        axis = joint_pose(plant, model, name).rotation() @ joint.revolute_axis()
        if axis[1] < 1.0 - TOLERANCE:
            x, y, z = (round(float(value), 3) for value in axis)
            yield (
                f"joint {given[name]} turns about {x:g} {y:g} {z:g} of base_link; allowed: 0 1 0, about which positive "
                "speeds drive forwards"
            )


def _reach_faults(
    plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelInstanceIndex, radius: float
) -> Iterator[str]:
    reach, link = robot_reach(plant, scene_graph, link_poses(plant, model))
    if reach > radius + TOLERANCE:
        yield f"link {link} reaches {reach:.3f} m from the robot's axis; allowed: up to robot.radius, {radius:g} m"


def _floor_faults(plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelInstanceIndex) -> Iterator[str]:
    """What would lift the wheels off the floor."""
    inspector = scene_graph.model_inspector()
    floor = axles(plant, model)[0][2] - wheel_radii(plant, scene_graph, model)[0]
    for index, X_BL in link_poses(plant, model).items():
        body = plant.get_body(index)
        for geometry in plant.GetCollisionGeometriesForBody(body):
            points, grown = outline(inspector, geometry)
            low = float(((X_BL @ inspector.GetPoseInFrame(geometry)) @ points)[2].min()) - grown
            if low < floor - TOLERANCE:
                yield (
                    f"link {body.name()} reaches {1e3 * (floor - low):.0f} mm lower than the wheels; allowed: down to "
                    "the floor that they stand on"
                )
