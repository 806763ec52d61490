"""Which joints of a robot are its wheels, and how it stands on them."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from pydrake.geometry import Cylinder, GeometryId, ProximityProperties, Role, RoleAssign, Sphere
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import CoulombFriction
from pydrake.multibody.tree import BodyIndex, FixedOffsetFrame, RevoluteJoint, RigidBody, SpatialInertia, UnitInertia

from drake_starnav.station.robot_geometry import RobotModel, set_floor_contact

OPPOSITE = 0.005
"""Wheels of an axle differ by no more than this along x and z, m; an axle so near to the middle carries the grip."""
AXIS_SHARE = 0.99
"""Least share of y in the axis of a wheel, and of z in that of a swivel."""
CASTER_CLEARANCE = 0.005
"""A shape no farther from the floor than this, m, is a caster, and a wheel there stands on it."""
CASTER_RADIUS = 0.02
LIFT = 5e-5
"""Casters clear the floor by this, m: the wheels carry the weight, and with it the grip."""
STIFFNESS, STIFFNESS_PER_MASS = 1e7, 1.25e6
"""Largest stiffness of a wheel whose file says none, N/m, and that for each kg of its robot: under its load it sinks by
some 4 um, so that the load does not shorten the radius that it rolls on; a harder one would let a light robot hop."""
ALONG_Z = np.array([0.0, 0.0, 1.0])


class Wheels(NamedTuple):
    """Names of the joints of a robot's wheels, and the middle of the axles, (x, y) in base_link, m."""

    left: tuple[str, ...]
    right: tuple[str, ...]
    middle: tuple[float, float]

    @property
    def joints(self) -> tuple[str, ...]:
        """All, the left ones first."""
        return (*self.left, *self.right)


class _Turning(NamedTuple):
    """A joint that turns about y: its name, its place in base_link, and how low it carries a shape, m."""

    name: str
    place: np.ndarray
    low: float


class _Span(NamedTuple):
    """What of a wheel is how far from its axis, and from where to where along it, m."""

    radius: float
    low: float
    high: float


def find_wheels(robot: RobotModel, joints: tuple[str, str]) -> Wheels:
    """The wheels of a model as it was read into a plant not yet finalized.

    Args:
        robot: as it was read.
        joints: names of the left and of the right joints, separated by spaces; empty where they are to be found: joints
            that turn about y or -y, on no swivel, in pairs left and right, with shapes down to one floor. Of several
            such joints in a chain, as of a suspension, it is the last.

    Raises:
        ValueError: there are none, or not these; says what is allowed.
    """
    turning = {each.name: each for each in _find_turning_joints(robot)}
    choice = f"robot.wheel_joints: [left, right] with two of {', '.join(turning) or 'the joints that turn about y'}"
    if any(joints):
        left_names, right_names = (tuple(side.split()) for side in joints)
        missing = [name for name in (*left_names, *right_names) if name not in turning]
        if missing or not (left_names and right_names):
            names = ", ".join(missing) or "on one side"
            raise ValueError(f"it has no joint{'s' * (len(missing) > 1)} {names} about y or -y; allowed: {choice}")
    else:
        wheel_pairs = _find_wheel_pairs([each for each in turning.values() if np.isfinite(each.low)])
        floor_height = min((end.low for pair in wheel_pairs for end in pair), default=0.0)
        wheel_pairs = [pair for pair in wheel_pairs if max(end.low for end in pair) <= floor_height + CASTER_CLEARANCE]
        left_names, right_names = (tuple(pair[k].name for pair in wheel_pairs) for k in (0, 1))
        if not wheel_pairs:
            raise ValueError(
                "it has no two joints about y or -y, opposite each other, that carry collision shapes down to one "
                f"floor; allowed: such wheels, or {choice}"
            )
    x, y, _ = np.mean([turning[name].place for name in left_names], axis=0)
    x_right, y_right, _ = np.mean([turning[name].place for name in right_names], axis=0)
    if abs(x - x_right) > OPPOSITE or y <= y_right:
        raise ValueError(
            f"joints {', '.join((*left_names, *right_names))} lie at x {x:g}, {x_right:g}, y {y:g}, {y_right:g} m of "
            "base_link; allowed: opposite each other, the left ones at the larger y"
        )
    return Wheels(left_names, right_names, (0.5 * float(x + x_right), 0.5 * float(y + y_right)))


def stand_on_wheels(robot: RobotModel, wheels: Wheels, efforts: Sequence[float]) -> float:
    """Put motors on the wheels, let them roll as spheres, and all else that is low slide; returns the floor's height.

    The edge of a cylinder on the floor makes a robot too slow. What is not the floor a wheel meets with its own shape,
    or with the plane of a sphere. Several axles with grip would hinder each other in turns: if none lies in the middle,
    wheels without mass to speak of are added there, and the others slide. A robot with nothing to stand on before or
    behind its axle gets a caster there, so that it does not tip over.

    Args:
        robot: in a plant not yet finalized; the origin of base_link lies in the middle of the axles.
        wheels: as from `find_wheels`, with collision shapes.
        efforts: the largest torque of each, the left ones first, N m.

    Returns:
        m, in base_link.
    """
    joints = [robot.plant.GetJointByName(name, robot.index) for name in wheels.joints]
    poses = robot.poses()
    spans = [_measure_wheel_span(robot, joint) for joint in joints]
    axles = [(poses[joint.child_body().index()] @ _add_axle(joint)).translation() for joint in joints]
    floor = min(float(axle[2]) - span.radius for axle, span in zip(axles, spans, strict=True))
    has_grip = [abs(axle[0]) <= OPPOSITE for axle in axles]
    for joint, span, axle, grips, effort in zip(joints, spans, axles, has_grip, efforts, strict=True):
        robot.plant.AddJointActuator(joint.name(), joint, effort)
        radius = float(axle[2]) - floor
        _add_rolling_sphere(robot, joint, span._replace(radius=radius if grips else radius - LIFT), slides=not grips)
    if not any(has_grip):
        _add_grip(robot, "left_grip", axles[: len(wheels.left)], floor)
        _add_grip(robot, "right_grip", axles[len(wheels.left) :], floor)
    turned_links = {link.index() for joint in joints for link in robot.find_carried_links(joint.child_body())}
    support_places = [float(axle[0]) for axle, grips in zip(axles, has_grip, strict=True) if not grips]
    for index, X_BL in poses.items():
        if index not in turned_links:
            support_places += _let_link_slide(robot, index, X_BL, floor)
    _add_missing_casters(robot, support_places, 0.5 * float(np.ptp([axle[1] for axle in axles])), floor)
    return floor


def _add_missing_casters(robot: RobotModel, support_places: list[float], half_track: float, floor: float) -> None:
    """Add a caster before or behind the axle where a robot has none of its supports, as far away as the others are.

    Supports are given by their x in base_link, m; without any a caster is as far away as `half_track`.
    """
    farthest_place = max(map(abs, support_places), default=half_track)
    for x in (-farthest_place, farthest_place):
        if not any(place * x > 0.0 for place in support_places):
            X_BG = RigidTransform([x, 0.0, floor + LIFT + CASTER_RADIUS])
            _register_sphere(robot, robot.base, X_BG, CASTER_RADIUS, None)


def _find_turning_joints(robot: RobotModel) -> list[_Turning]:
    """The joints of a model about y or -y that hang on no swivel, and that no other such joint hangs on."""
    poses, turning_joints, joints = robot.poses(), [], robot.joints
    parent_joints = {joint.child_body().index(): joint for joint in joints}
    joint_axes = {
        joint.name(): (poses[joint.child_body().index()] @ _add_axle(joint)).rotation() @ ALONG_Z
        for joint in joints
        if isinstance(joint, RevoluteJoint) and joint.child_body().index() in poses
    }
    for name, axis in joint_axes.items():
        joint = robot.plant.GetJointByName(name, robot.index)
        below = robot.find_carried_links(joint.child_body())
        body, is_swivel = joint.parent_body().index(), False
        while body in parent_joints:
            is_swivel = is_swivel or abs(joint_axes.get(parent_joints[body].name(), np.zeros(3))[2]) > AXIS_SHARE
            body = parent_joints[body].parent_body().index()
        axes_below = (joint_axes.get(parent_joints[part.index()].name(), np.zeros(3)) for part in below[1:])
        arm = any(abs(each[1]) > AXIS_SHARE for each in axes_below)
        if is_swivel or arm or abs(axis[1]) < AXIS_SHARE:
            continue
        low = robot.find_lowest_point({part.index(): poses[part.index()] for part in below})
        turning_joints.append(_Turning(name, (poses[joint.child_body().index()] @ _add_axle(joint)).translation(), low))
    return turning_joints


def _find_wheel_pairs(turning: list[_Turning]) -> list[tuple[_Turning, _Turning]]:
    """Joints opposite each other, the left one first; of several at one side, outer with outer."""
    wheel_pairs, other_joints = [], sorted(turning, key=lambda each: (each.place[1], each.name))
    while other_joints:
        right_joint = other_joints.pop(0)
        across = [each for each in other_joints if np.abs(each.place - right_joint.place)[[0, 2]].max() <= OPPOSITE]
        if across and across[-1].place[1] > right_joint.place[1] + OPPOSITE:
            other_joints.remove(across[-1])
            wheel_pairs.append((across[-1], right_joint))
    return wheel_pairs


def _add_axle(joint: RevoluteJoint) -> RigidTransform:
    """A frame on the axis of a joint, z along it, in the link that it turns."""
    X = joint.frame_on_child().GetFixedPoseInBodyFrame()
    return X @ RigidTransform(RotationMatrix.MakeFromOneVector(joint.revolute_axis(), 2), np.zeros(3))


def _measure_wheel_span(robot: RobotModel, joint: RevoluteJoint) -> _Span:
    """The span of a wheel's shapes; a sphere counts with its plane."""
    poses = robot.poses()
    X_AB = (poses[joint.child_body().index()] @ _add_axle(joint)).inverse()
    part_poses = {part.index(): X_AB @ poses[part.index()] for part in robot.find_carried_links(joint.child_body())}
    spans = [
        (np.hypot(*each.points[:2]).max() + each.grown, each.points[2].min(), each.points[2].max())
        for each in robot.find_extents(part_poses)
    ]
    radii, low, high = np.array(spans).T
    return _Span(float(radii.max()), float(low.min()), float(high.max()))


def _add_rolling_sphere(robot: RobotModel, joint: RevoluteJoint, span: _Span, *, slides: bool) -> None:
    """Give a wheel a sphere that touches only the floor, and let what else it carries never touch it."""
    link, X_LA = joint.child_body(), _add_axle(joint)
    wheel_middle = RigidTransform(X_LA.translation() + 0.5 * (span.low + span.high) * (X_LA.rotation() @ ALONG_Z))
    properties = None
    for part in robot.find_carried_links(link):
        for geometry in robot.shapes(part):
            own_properties = ProximityProperties(robot.inspector.GetProximityProperties(geometry))
            properties = properties or ProximityProperties(own_properties)
            if part is link and isinstance(robot.inspector.GetShape(geometry), Sphere):
                geometry = _flatten_sphere(robot, link, geometry, X_LA, own_properties)
            robot.keep_off_floor(geometry, own_properties)
    assert properties is not None
    if not properties.HasProperty("material", "point_contact_stiffness"):
        properties.AddProperty("material", "point_contact_stiffness", _find_stiffness(robot))
    _register_sphere(robot, link, wheel_middle, span.radius, None if slides else properties)


def _flatten_sphere(
    robot: RobotModel, link: RigidBody, geometry: GeometryId, X_LA: RigidTransform, properties: ProximityProperties
) -> GeometryId:
    """Put a thin disc across an axle into the place of a sphere of a link."""
    plant, inspector = robot.plant, robot.inspector
    X_LG = RigidTransform(X_LA.rotation(), inspector.GetPoseInFrame(geometry).translation())
    name, disc = inspector.GetName(geometry).rpartition("::")[2], Cylinder(inspector.GetShape(geometry).radius(), 1e-3)
    robot.scene_graph.RemoveRole(plant.get_source_id(), geometry, Role.kProximity)
    return plant.RegisterCollisionGeometry(link, X_LG, disc, name, properties)


def _find_stiffness(robot: RobotModel) -> float:
    return min(STIFFNESS, STIFFNESS_PER_MASS * sum(link.default_mass() for link in robot.links))


def _register_sphere(
    robot: RobotModel, link: RigidBody, X_LG: RigidTransform, radius: float, grip: ProximityProperties | None
) -> None:
    """Add a sphere that touches only the floor; without friction if nothing is known of its grip."""
    properties = ProximityProperties() if grip is None else grip
    if grip is None:
        properties.AddProperty("material", "coulomb_friction", CoulombFriction(0.0, 0.0))
    name = f"{link.name()}_on_floor"
    taken_names = {robot.inspector.GetName(g).rpartition("::")[2] for g in robot.shapes(link)}
    while name in taken_names:
        name += "_"
    set_floor_contact(properties, True)
    robot.plant.RegisterCollisionGeometry(link, X_LG, Sphere(radius), name, properties)


def _add_grip(robot: RobotModel, name: str, axles: list[np.ndarray], floor: float) -> None:
    """Add a wheel in the middle of the axles of a side that is neither seen nor struck, with a motor."""
    place = np.mean(axles, axis=0) * (0.0, 1.0, 1.0)
    radius = float(place[2]) - floor
    plant, inertia = robot.plant, SpatialInertia(0.1, np.zeros(3), UnitInertia.SolidSphere(radius))  # kg
    link, base = plant.AddRigidBody(name, robot.index, inertia), robot.base.body_frame()
    frame = plant.AddFrame(FixedOffsetFrame(f"{name}_axle", base, RigidTransform(place), robot.index))
    joint = plant.AddJoint(RevoluteJoint(name, frame, link.body_frame(), [0.0, 1.0, 0.0]))
    plant.AddJointActuator(name, joint)
    properties = ProximityProperties()
    properties.AddProperty("material", "coulomb_friction", CoulombFriction(1.0, 1.0))
    properties.AddProperty("material", "point_contact_stiffness", _find_stiffness(robot))
    _register_sphere(robot, link, RigidTransform(), radius, properties)


def _let_link_slide(robot: RobotModel, link: BodyIndex, X_BL: RigidTransform, floor: float) -> list[float]:
    """Let the shapes of a link that reach the floor slide on it, as a caster's wheel; returns their x in base_link, m.

    A sphere just above the floor stays; else a sphere without friction, that touches only the floor, comes beneath.
    """
    support_places = []
    for each in list(robot.find_extents({link: X_BL})):
        clearance = each.low - floor
        if not -0.006 <= clearance < CASTER_CLEARANCE:  # m; a caster may lie a little lower than the wheels in a model
            continue
        lowest_place = each.points[:, each.points[2] < each.points[2].min() + 1e-3].mean(axis=1)
        support_places.append(float(lowest_place[0]))
        properties = ProximityProperties(robot.inspector.GetProximityProperties(each.geometry))
        is_sphere = isinstance(robot.inspector.GetShape(each.geometry), Sphere)
        if is_sphere and 0.5 * LIFT < clearance < 2.0 * LIFT:
            properties.UpdateProperty("material", "coulomb_friction", CoulombFriction(0.0, 0.0))
            source = robot.plant.get_source_id()
            robot.scene_graph.AssignRole(source, each.geometry, properties, RoleAssign.kReplace)
            continue
        robot.keep_off_floor(each.geometry, properties)
        place = X_BL.inverse() @ np.array([*lowest_place[:2], floor + LIFT + CASTER_RADIUS])
        _register_sphere(robot, each.link, RigidTransform(place), CASTER_RADIUS, None)
    return support_places
