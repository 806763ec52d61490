"""Where the parts of a robot's model are, and how far they reach."""

import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from types import MappingProxyType
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
from pydrake.multibody.tree import BodyIndex, FrameIndex, Joint, ModelInstanceIndex, RevoluteJoint, RigidBody

from drake_starnav.errors import StarnavError
from drake_starnav.worlds.footprints import make_ball_vertices, make_box_vertices, make_convex_footprint

TOLERANCE = 1e-3
"""Tolerance of places and headings of a model's wheels and lidars, of its radii and of `robot.radius`, m and rad."""
LONGEST_STEP, LEAST_STANCE = 0.025, 0.12
"""Longest step of a plant, s: a default period of commands; and the least stance of a robot, m, with which it may be
so long. Over 19 m by recorded twists, with nothing that steers it back, a shipped robot ends 4 to 9 cm from where steps
of half the length take it."""
FLOOR_CONTACT = ("starnav", "floor")
"""Group and name of a property of a robot's collision shapes."""


NOTHING: Mapping[BodyIndex, RigidTransform] = MappingProxyType({})


class RobotModel(NamedTuple):
    """A robot in a plant: its model instance, which need not be finalized."""

    plant: MultibodyPlant
    scene_graph: SceneGraph
    index: ModelInstanceIndex

    @property
    def inspector(self) -> SceneGraphInspector:
        """The scene's inspector."""
        return self.scene_graph.model_inspector()

    @property
    def joints(self) -> list[Joint]:
        """The robot's joints."""
        return [self.plant.get_joint(index) for index in self.plant.GetJointIndices(self.index)]

    @property
    def links(self) -> list[RigidBody]:
        """The robot's links."""
        return [self.plant.get_body(index) for index in self.plant.GetBodyIndices(self.index)]

    @property
    def base(self) -> RigidBody:
        """The link base_link."""
        return self.plant.GetBodyByName("base_link", self.index)

    @property
    def wheels(self) -> list[RevoluteJoint]:
        """Joints with a motor, in the order of their actuators."""
        actuators = (self.plant.get_joint_actuator(index) for index in self.plant.GetJointActuatorIndices())
        return [actuator.joint() for actuator in actuators if actuator.model_instance() == self.index]

    def shapes(self, *links: RigidBody) -> list[GeometryId]:
        """What still collides of links."""
        found_geometries = (g for link in links for g in self.plant.GetCollisionGeometriesForBody(link))
        return [g for g in found_geometries if self.inspector.GetProximityProperties(g) is not None]

    def find_carried_links(self, link: RigidBody) -> list[RigidBody]:
        """A link, and all that hang on it."""
        joints_below, found_bodies = self._find_joints_below(), [link]
        for body in found_bodies:  # grows
            found_bodies += [joint.child_body() for joint in joints_below.get(body.index(), ())]
        return found_bodies

    def poses(self) -> dict[BodyIndex, RigidTransform]:
        """Where its links are in base_link, with all joints at zero."""
        poses = {self.base.index(): RigidTransform()}
        joints_below = self._find_joints_below()
        for parent in (links := [self.base.index()]):  # grows
            for joint in joints_below.get(parent, ()):
                child = joint.child_body().index()
                if child not in poses:
                    X_PF = joint.frame_on_parent().GetFixedPoseInBodyFrame()
                    X_CM = joint.frame_on_child().GetFixedPoseInBodyFrame()
                    poses[child] = poses[parent] @ X_PF @ X_CM.inverse()
                    links.append(child)
        return poses

    def _find_joints_below(self) -> dict[BodyIndex, list[Joint]]:
        """Joints by the link that is their parent."""
        joints_below: dict[BodyIndex, list[Joint]] = {}
        for joint in self.joints:
            joints_below.setdefault(joint.parent_body().index(), []).append(joint)
        return joints_below

    def find_extents(self, poses: Mapping[BodyIndex, RigidTransform]) -> Iterator["Extent"]:
        """What the colliding shapes of links cover, with the links at poses in a frame."""
        for index, X_FL in poses.items():
            link = self.plant.get_body(index)
            for geometry in self.shapes(link):
                points, rounding_radius = sample_outline(self.inspector, geometry)
                placed_points = (X_FL @ self.inspector.GetPoseInFrame(geometry)) @ points
                floor = read_floor_contact(self.inspector, geometry)
                yield Extent(link, geometry, placed_points, rounding_radius, floor)

    def find_lowest_point(self, poses: Mapping[BodyIndex, RigidTransform]) -> float:
        """How high the lowest point of links at poses is, m; infinite without shapes."""
        return min((each.low for each in self.find_extents(poses)), default=math.inf)

    def top(self, without: Collection[str] = (), on: Mapping[BodyIndex, RigidTransform] = NOTHING) -> float:
        """How high its highest shape is above its lowest one, on the floor, m; 0 without shapes.

        `without` those of links of these names; with bodies `on` it at poses in base_link, such as an arm.
        """
        poses = {**on, **self.poses()}
        shape_tops = (each.high for each in self.find_extents(poses) if each.link.name() not in without)
        return max(shape_tops, default=0.0) - min(self.find_lowest_point(poses), 0.0)

    def measure_stance(self) -> float:
        """Half the width or length, whichever is less, of where it touches the floor, m; infinite without wheels."""
        poses = self.poses()
        floor_height = self.find_lowest_point(poses)
        touching_shapes = [each for each in self.find_extents(poses) if each.low < floor_height + TOLERANCE]
        if not any(each.floor for each in touching_shapes):
            return math.inf
        return 0.5 * float(np.ptp([each.points[:2].mean(axis=1) for each in touching_shapes], axis=0).min())

    def longest_step(self) -> float:
        """Longest step of a plant, s, after which what lost the floor has not tilted the robot so that it would drive
        otherwise than told; a whole number of them makes `LONGEST_STEP`."""
        return LONGEST_STEP / max(1, math.ceil(LEAST_STANCE / max(self.measure_stance(), 1e-3) - 1e-6))

    def reach(self, poses: Mapping[BodyIndex, RigidTransform]) -> float:
        """How far any point of links at poses in base_link is from its origin, m; 0 without shapes."""
        return max((np.linalg.norm(e.points, axis=0).max() + e.grown for e in self.find_extents(poses)), default=0.0)

    def find_highest_frame(self) -> float:
        """How high its highest frame is above the floor, m: twice that of a tilted one, as lidars see no farther up."""
        poses, plant = self.poses(), self.plant
        frames = (plant.get_frame(FrameIndex(k)) for k in range(plant.num_frames()))
        frame_poses = [
            poses[f.body().index()] @ f.GetFixedPoseInBodyFrame() for f in frames if f.body().index() in poses
        ]
        floor_height = min(self.find_lowest_point(poses), 0.0)
        frame_heights = [(X.translation()[2] - floor_height, abs(X.rotation().matrix()[2, 2])) for X in frame_poses]
        return max(float(z) * (1.0 if upright > math.cos(TOLERANCE) else 2.0) for z, upright in frame_heights)

    def keep_off_floor(self, geometry: GeometryId, properties: ProximityProperties) -> None:
        """Let a shape with these properties never touch the floor."""
        set_floor_contact(properties, False)
        self.scene_graph.AssignRole(self.plant.get_source_id(), geometry, properties, RoleAssign.kReplace)


class Extent(NamedTuple):
    """What a shape covers: all that is nearer than `grown` to the hull of points (3, n), m.

    `floor`: whether it touches nothing but the floor, or anything but it; None if nothing is said of it.
    """

    link: RigidBody
    geometry: GeometryId
    points: np.ndarray
    grown: float
    floor: bool | None

    @property
    def low(self) -> float:
        """Height of its lowest point, m."""
        return float(self.points[2].min()) - self.grown

    @property
    def high(self) -> float:
        """Height of its highest point, m."""
        return float(self.points[2].max()) + self.grown


def make_robot_outline(robot: RobotModel, left_out: Collection[str] = ()) -> np.ndarray | None:
    """The convex hull of what a robot collides with, with all joints at zero, seen from above, without some links.

    Counter-clockwise, shape (n, 2), about base_link's z axis, m; round shapes lie within. None if they enclose nothing.
    """
    robot_parts = robot.find_extents(robot.poses())
    kept_shapes = (each for each in robot_parts if each.floor is not True and each.link.name() not in left_out)
    shape_corners = [inflate_points(each.points.T, each.grown) for each in kept_shapes]
    return make_convex_footprint(np.vstack([*shape_corners, np.zeros((0, 3))]), -math.inf, math.inf)


def set_floor_contact(properties: ProximityProperties, floor: bool) -> None:
    """Say that a shape touches nothing but the floor, or anything but it; `RobotInterface` sees to that."""
    properties.AddProperty(*FLOOR_CONTACT, floor)


def read_floor_contact(inspector: SceneGraphInspector, geometry: GeometryId) -> bool | None:
    """Whether a shape touches nothing but the floor; None if nothing is said of it."""
    properties = inspector.GetProximityProperties(geometry)
    if properties is None or not properties.HasProperty(*FLOOR_CONTACT):
        return None
    return properties.GetProperty(*FLOOR_CONTACT)


def sample_outline(inspector: SceneGraphInspector, geometry: GeometryId) -> tuple[np.ndarray, float]:
    """Points of a shape in its own frame, shape (3, n), m, and by what it reaches beyond them, m."""
    shape = inspector.GetShape(geometry)
    if isinstance(shape, Sphere):
        return np.zeros((3, 1)), shape.radius()
    if isinstance(shape, Capsule):
        return np.array([[0.0, 0.0], [0.0, 0.0], [-0.5 * shape.length(), 0.5 * shape.length()]]), shape.radius()
    if isinstance(shape, Cylinder):
        rim_angles = np.linspace(0.0, 2.0 * math.pi, 73)
        rim_points = shape.radius() * np.vstack((np.cos(rim_angles), np.sin(rim_angles)))
        half_lengths = np.full((1, len(rim_angles)), 0.5 * shape.length())
        return np.hstack((np.vstack((rim_points, half_lengths)), np.vstack((rim_points, -half_lengths)))), 0.0
    if isinstance(shape, Box):
        return make_box_vertices(shape.size()).T, 0.0
    if isinstance(shape, Ellipsoid):
        return make_ball_vertices(np.array((shape.a(), shape.b(), shape.c()))).T, 0.0
    convex_hull = inspector.GetConvexHull(geometry)
    if convex_hull is None:
        raise StarnavError(
            f"geometry {inspector.GetName(geometry)} is a {type(shape).__name__}; allowed: a solid shape"
        )
    return np.array([convex_hull.vertex(k) for k in range(convex_hull.num_vertices())]).T, 0.0


def inflate_points(points: np.ndarray, inflation: float) -> np.ndarray:
    """Corners of what contains all places so near to some points, shape (n, 3), m."""
    return (points[:, None] + make_ball_vertices(np.full(3, inflation))).reshape(-1, 3) if inflation else points


def find_massless_links(plant: MultibodyPlant, bodies: Iterable[BodyIndex]) -> list[str]:
    """Names of the bodies, in a plant not yet finalized, that move although nothing with a mass moves with them.

    A link that a joint moves may leave the mass to what it carries; a body without any joint, which moves freely, only
    to what is welded to it.
    """
    joints = [plant.get_joint(index) for index in plant.GetJointIndices()]
    parent_bodies = {joint.child_body().index(): joint.parent_body().index() for joint in joints}
    welded_links = {joint.child_body().index() for joint in joints if joint.num_velocities() == 0}
    heavy_bodies = {plant.world_body().index()}
    root_of: dict[BodyIndex, BodyIndex | None] = {}  # of what carries a mass; None if a joint on the way to it moves
    for body in map(BodyIndex, range(1, plant.num_bodies())):
        if plant.get_body(body).default_mass() > 0.0:
            link_chain, carrier = [], body
            while carrier in parent_bodies and carrier not in root_of:
                link_chain.append(carrier)
                carrier = parent_bodies[carrier]
            carrying_root: BodyIndex | None = root_of.get(carrier, carrier)
            for link in reversed(link_chain):
                carrying_root = root_of[link] = carrying_root if link in welded_links else None
            if carrying_root is not None:
                heavy_bodies.add(carrying_root)
    held_links = heavy_bodies | root_of.keys() | welded_links
    return [plant.get_body(body).name() for body in bodies if body not in held_links]


class Drive(NamedTuple):
    """Where a robot's wheels touch the floor, in the order of their actuators, m.

    `radii` are negative of wheels that turn about -y; `arms` are how far to the right of base_link's z axis they are.
    """

    radii: tuple[float, ...]
    arms: tuple[float, ...]

    def rates(self, v: float | np.ndarray, omega: float | np.ndarray) -> list:
        """Rates of the wheels, rad/s, of a robot that drives at v, m/s, and omega, rad/s."""
        return [(v + arm * omega) / radius for radius, arm in zip(*self, strict=True)]


def find_drive_geometry(robot: RobotModel) -> Drive:
    """Where the wheels of a robot, as from `add_robot`, touch the floor."""
    poses, wheel_contacts = robot.poses(), []
    for joint in robot.wheels:
        link = joint.child_body()
        (rolling_sphere,) = (g for g in robot.shapes(link) if read_floor_contact(robot.inspector, g))
        X_BL = poses[link.index()]
        axis = X_BL.rotation() @ (joint.frame_on_child().GetFixedRotationMatrixInBodyFrame() @ joint.revolute_axis())
        y = (X_BL @ robot.inspector.GetPoseInFrame(rolling_sphere)).translation()[1]
        wheel_contacts.append((math.copysign(robot.inspector.GetShape(rolling_sphere).radius(), axis[1]), -float(y)))
    return Drive(*zip(*wheel_contacts, strict=True))


def compute_wheel_rates(robot: RobotModel) -> np.ndarray:
    """The matrix that takes the wheels' rates, in the order of their actuators, out of the state of a model."""
    plant, model, rate_rows = robot.plant, robot.index, []
    for joint in robot.wheels:
        joint_rates = np.zeros(plant.num_velocities())
        joint_rates[joint.velocity_start()] = 1.0
        rate_rows.append((*np.zeros(plant.num_positions(model)), *plant.GetVelocitiesFromArray(model, joint_rates)))
    return np.array(rate_rows)


def find_standing_range(robot: RobotModel, floor: float) -> tuple[float, float, float]:
    """The least and the largest x at which a robot stands on a floor, and that of its centre of mass, m.

    All in base_link; `floor` is its height there, m.
    """
    poses, mass_places = robot.poses(), []
    for index, X_BL in poses.items():
        link = robot.plant.get_body(index)
        mass_places.append((link.default_mass(), float((X_BL @ link.default_com())[0])))
    link_masses, x = np.array(mass_places).T
    standing_places = [float(each.points[0].mean()) for each in robot.find_extents(poses) if each.low < floor + 1e-3]
    return min(standing_places), max(standing_places), float(link_masses @ x / link_masses.sum())


def find_drive_ability(robot: RobotModel) -> tuple[float, float]:
    """Acceleration, m/s^2, and yaw acceleration, rad/s^2, of a robot whose wheels carry and grip with all its weight.

    They are those of base_link, by the efforts and arms of the wheels and by mass and inertia of all links.
    """
    yaw_inertia, total_mass = 0.0, 0.0
    for index, X_BL in robot.poses().items():
        link = robot.plant.get_body(index)
        link_inertia = link.default_spatial_inertia().ReExpress(X_BL.rotation()).Shift(-X_BL.translation())
        yaw_inertia += link_inertia.CalcRotationalInertia().CopyToFullMatrix3()[2, 2]
        total_mass += link.default_mass()
    (radii, arms), joints = find_drive_geometry(robot), robot.wheels
    wheel_grip, push, torque = -robot.plant.gravity_field().gravity_vector()[2] * total_mass / len(joints), 0.0, 0.0
    for joint, radius, arm in zip(joints, radii, arms, strict=True):
        effort_limit = robot.plant.GetJointActuatorByName(joint.name(), robot.index).effort_limit()
        wheel_force = min(effort_limit / abs(radius), wheel_grip)
        push, torque = push + wheel_force, torque + wheel_force * abs(arm)
    return push / total_mass, torque / yaw_inertia
