"""What makes a model of a plant a robot, as one diagram."""

import functools
import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

from pydrake.geometry import CollisionFilterDeclaration, GeometryId, GeometrySet, Role, SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, ModelInstanceIndex
from pydrake.systems.framework import Diagram, DiagramBuilder, InputPort, LeafSystem, OutputPort, System
from pydrake.systems.primitives import DiscreteTimeDelay

from drake_starnav.errors import StarnavError
from drake_starnav.scenario.schema import DriveParameters, Scenario
from drake_starnav.station.lidar_mounts import find_lidar_poses, find_mount
from drake_starnav.station.lidar_sensor import LidarMount, LidarSensor
from drake_starnav.station.model_world import find_floor_geometries
from drake_starnav.station.planar_drive import PlanarVelocityCommand
from drake_starnav.station.planar_localization import PlanarLocalization, derive_lidar_seed
from drake_starnav.station.robot_body import find_protrusion
from drake_starnav.station.robot_geometry import RobotModel, find_drive_geometry, read_floor_contact
from drake_starnav.station.wheel_drive import StepsCheck, WheelServo, WheelSlip, WheelSpeedCommand
from drake_starnav.systems.star_perception import lidar_names

LIDAR_PORTS = ("scan", "ranges", "point_cloud", "X_WS")
POSE_PORTS = ("pose", "state", "scan_pose")


class RobotInterface(Diagram):
    """Lidar, localization and wheel servo that make a model of a plant a robot, as one diagram.

    ```
                           ┌────────────────┐
    geometry_query ───────>│                ├──> lidar.scan, lidar.ranges, lidar.point_cloud, lidar.X_WS
    multibody_state ──────>│ RobotInterface ├──> localization.pose, localization.state, localization.scan_pose
    drive.twist_command ──>│                ├──> desired_state
                           └────────────────┘
    ```

    Ports:
        geometry_query: abstract, `QueryObject` of the scene.
        multibody_state: vector of the robot's model, from the plant.
        drive.twist_command, lidar.*, localization.*: as in `NavigationStation`.
        desired_state: vector of the robot's model, to the plant.

    With a continuous plant the last port is `actuation`, torques of its `WheelServo`, N m.
    The lidar sees other robots in the plant where they reach into its plane, but not its own robot. Bodies
    joined to the robot, such as an arm, and what it carries belong to it.

    A robot with several lidars has the ports of the others under lidar_2, lidar_3, ...

    Attributes:
        scenario: what is declared of the robot, with the time step of a discrete plant.
        mounts: of the lidars.
        heights: of the lidars above the floor z = 0, with all joints at their defaults, m.
        top: height of its highest collision shape, with all joints at zero, of joined bodies at their defaults, m.
        body_top: the same without `robot.overhangs`.
        longest_step: of a plant with which it drives as told, s.
        reach: how far any point that collides is from base_link's origin, m, however the robot is tilted.
        robot_geometries: collision shapes of all that.
        sticking_out: tells of a robot's parameters by how much what collides, with all joints at their defaults and
            without what it carries, sticks out of their footprint, m, and which link.
    """

    def __init__(
        self,
        plant: MultibodyPlant,
        scene_graph: SceneGraph,
        model: ModelInstanceIndex,
        scenario: Scenario,
        *,
        seed: int = 0,
        carried: Sequence[BodyIndex] = (),
    ) -> None:
        """
        Args:
            plant: finalized.
            model: the robot, as from `add_robot`.
            scenario: its `robot`, `lidar`, `localization` and `drive`; and `simulation.time_step`, to a multiple of
                which the delay of the drive is rounded up, unless the plant is discrete and has its own.
            seed: of the sensor's noise and of the faults.
            carried: bodies that lie on the robot without a joint: neither seen, nor struck by it.
        """
        super().__init__()
        self.plant, self.scene_graph = plant, scene_graph
        time_step = plant.time_step() or scenario.simulation.time_step
        self.scenario = replace(scenario, simulation=replace(scenario.simulation, time_step=time_step))
        self.robot, self.lidars, self.drive = scenario.robot, scenario.all_lidars, scenario.drive
        self.model = self.robot_model = model
        self.moving_obstacle_geometries, self.world = (), None  # nobody knows what the plant holds
        self.continuous = plant.time_step() == 0.0
        robot_model = RobotModel(plant, scene_graph, model)
        _check_added(robot_model, planar=self.robot.drive.holonomic)
        base, context = plant.GetBodyByName("base_link", model).body_frame(), plant.CreateDefaultContext()
        bodies = find_joined_bodies(plant, model)
        poses = {i: plant.CalcRelativeTransform(context, base, plant.get_body(i).body_frame()) for i in bodies}
        self.longest_step = robot_model.longest_step()
        self._drive = None if self.robot.drive.holonomic else find_drive_geometry(robot_model)
        self.sticking_out = functools.partial(find_protrusion, robot_model, poses)
        builder = DiagramBuilder()
        inspector = scene_graph.model_inspector()
        own_frames = [plant.GetBodyFrameIdOrThrow(index) for index in (*bodies, *carried)]
        self.robot_geometries = [g for f in own_frames for g in inspector.GetGeometries(f, Role.kProximity)]
        self._keep_to_the_floor()
        self.base_frame = plant.GetBodyFrameIdOrThrow(plant.GetBodyByName("base_link", model).index())
        lidar_poses = find_lidar_poses(robot_model, self.lidars)
        lift = plant.EvalBodyPoseInWorld(context, robot_model.base).translation()[2]
        self.heights, self.top = tuple(float(lift + X.translation()[2]) for X in lidar_poses), robot_model.top(on=poses)
        self.body_top = robot_model.top(self.robot.overhangs.split(), on=poses)
        self.reach = math.inf if carried else robot_model.reach(poses)
        self.mounts = tuple(map(find_mount, lidar_poses, self.lidars, self.heights))
        sensors = {}
        for k, (name, lidar) in enumerate(zip(lidar_names("lidar", len(lidar_poses)), self.lidars, strict=True)):
            mount = LidarMount(self.base_frame, lidar_poses[k], own_frames)
            sensor = LidarSensor(lidar, mount, seed=derive_lidar_seed(seed, k))
            sensors[name] = builder.AddNamedSystem(name, sensor)
        sizes = {"num_positions": plant.num_positions(model), "num_velocities": plant.num_velocities(model)}
        localization = PlanarLocalization(**sizes, lidars=self.lidars, error=scenario.localization, seed=seed)
        localization = builder.AddNamedSystem("localization", localization)
        wheels: LeafSystem = PlanarVelocityCommand(robot=self.robot)
        if self._drive is not None:
            wheels = WheelSpeedCommand(robot=self.robot, drive=self._drive)
        wheels = builder.AddNamedSystem("wheels", wheels)
        query_ports = [sensor.GetInputPort("geometry_query") for sensor in sensors.values()]
        exported_port = builder.ExportInput(query_ports[0], "geometry_query")
        for port in query_ports[1:]:
            builder.ConnectInput(exported_port, port)
        command, turning = self._add_drive_faults(builder, wheels, seed)
        state = builder.ExportInput(localization.GetInputPort("multibody_state"), "multibody_state")
        if self._drive is None:
            builder.ConnectInput(state, wheels.GetInputPort("multibody_state"))
        builder.ExportInput(command, "drive.twist_command")
        for name, sensor in sensors.items():
            for port_name in LIDAR_PORTS:
                builder.ExportOutput(sensor.GetOutputPort(port_name), f"{name}.{port_name}")
        for name in POSE_PORTS:
            builder.ExportOutput(localization.GetOutputPort(name), f"localization.{name}")
        if plant.time_step() > 0.0:
            builder.ExportOutput(turning, "desired_state")
        else:
            builder.AddNamedSystem("steps_check", StepsCheck())
            servo = builder.AddNamedSystem("servo", WheelServo(robot_model))
            builder.Connect(turning, servo.GetInputPort("desired_state"))
            builder.ConnectInput(state, servo.GetInputPort("multibody_state"))
            builder.ExportOutput(servo.GetOutputPort("actuation"), "actuation")
        builder.BuildInto(self)

    @property
    def robot_interface(self) -> "RobotInterface":
        """This system; a diagram around it returns the one inside."""
        return self

    @property
    def geometry_query(self) -> OutputPort:
        """The port of the scene."""
        return self.scene_graph.get_query_output_port()

    @cached_property
    def floor(self) -> list[GeometryId]:
        """Collision shapes that the robot may touch."""
        return find_floor_geometries(self.plant, self.scene_graph)

    def _keep_to_the_floor(self) -> None:
        """Let some shapes of the robot touch nothing but the floor, and some anything but it."""
        inspector, filters = self.scene_graph.model_inspector(), CollisionFilterDeclaration()
        contact_texts = {geometry: read_floor_contact(inspector, geometry) for geometry in self.robot_geometries}
        others = set(inspector.GetAllGeometryIds(Role.kProximity)) - set(self.floor)
        for floor_only, kept_from in ((True, others), (False, self.floor)):
            shapes = [geometry for geometry, floor in contact_texts.items() if floor is floor_only]
            filters.ExcludeBetween(GeometrySet(shapes), GeometrySet(list(kept_from)))
        self.scene_graph.collision_filter_manager().Apply(filters)

    def _add_drive_faults(self, builder: DiagramBuilder, wheels: LeafSystem, seed: int) -> tuple[InputPort, OutputPort]:
        """The port that takes the twist, behind the delay, and the one of the wheels' speeds, with their slip."""
        command_port, speed_port = wheels.GetInputPort("twist_command"), wheels.GetOutputPort("desired_state")
        if self.drive.slip > 0.0 and self._drive is not None:
            sides = [int(arm > 0.0) for arm in self._drive.arms]
            slip_system = builder.AddNamedSystem("wheel_slip", WheelSlip(sides=sides, slip=self.drive.slip, seed=seed))
            builder.Connect(speed_port, slip_system.get_input_port())
            speed_port = slip_system.get_output_port()
        if self.drive.delay > 0.0:
            twist_size = len(self.robot.drive.components)
            time_step = self.scenario.simulation.time_step
            delay = DiscreteTimeDelay(time_step, count_delay_steps(self.drive, time_step), twist_size)
            delay_system = builder.AddNamedSystem("drive_delay", delay)
            builder.Connect(delay_system.get_output_port(), command_port)
            command_port = delay_system.get_input_port()
        return command_port, speed_port


def _check_added(robot: RobotModel, *, planar: bool) -> None:
    """Raise a `StarnavError` for a model that a parser added, without what `add_robot` gives it."""
    has_base = robot.plant.HasBodyNamed("base_link", robot.index)
    floors = (read_floor_contact(robot.inspector, shape) for shape in robot.shapes(*robot.links))
    if not has_base or not robot.wheels or not (planar or any(floors)):
        raise StarnavError(
            f"model {robot.plant.GetModelInstanceName(robot.index)} of the plant is not one of add_robot, which finds "
            "its wheels and lets them roll; allowed: add_robot(plant, scene_graph, scenario.robot, start), its file "
            "as robot.model, instead of a Parser of your own"
        )


def find_joined_bodies(plant: MultibodyPlant, model: ModelInstanceIndex) -> list[BodyIndex]:
    """A robot's links, and all bodies that joints hold to them, such as those of an arm on it; not the world body."""
    joints = [plant.get_joint(index) for index in plant.GetJointIndices()]
    joined_pairs = [{joint.parent_body().index(), joint.child_body().index()} for joint in joints]
    joined_pairs = [pair for pair in joined_pairs if plant.world_body().index() not in pair]
    found_bodies = set(plant.GetBodyIndices(model))
    while new_bodies := {index for pair in joined_pairs if pair & found_bodies for index in pair} - found_bodies:
        found_bodies |= new_bodies
    return sorted(found_bodies)


def count_delay_steps(drive: DriveParameters, time_step: float) -> int:
    """The drive's delay in time steps, rounded up: at least one if there is any delay."""
    return max(math.ceil(drive.delay / time_step - 1e-9), int(drive.delay > 0.0))


def connect_robot(
    builder: DiagramBuilder, plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelInstanceIndex, robot: System
) -> None:
    """Connect a `RobotInterface`, or a diagram that exports all of its inputs and outputs, to plant and scene."""
    builder.Connect(scene_graph.get_query_output_port(), robot.GetInputPort("geometry_query"))
    builder.Connect(plant.get_state_output_port(model), robot.GetInputPort("multibody_state"))
    if plant.time_step() > 0.0:
        builder.Connect(robot.GetOutputPort("desired_state"), plant.get_desired_state_input_port(model))
    else:
        builder.Connect(robot.GetOutputPort("actuation"), plant.get_actuation_input_port(model))
