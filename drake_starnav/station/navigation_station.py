"""The robot in its world, as one diagram with dotted ports."""

import math

from pydrake.geometry import GeometryId, Role, SceneGraph
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlant, MultibodyPlantConfig
from pydrake.multibody.tree import ModelInstanceIndex
from pydrake.systems.framework import Diagram, DiagramBuilder, InputPort, OutputPort
from pydrake.systems.primitives import DiscreteTimeDelay

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.faults import DriveParameters, LocalizationParameters
from drake_starnav.station.lidar_sensor import LidarMount, LidarSensor
from drake_starnav.station.model_world import add_model, drop_half_spaces, floor_geometries
from drake_starnav.station.moving_bodies import add_moving_obstacle_drive, add_moving_obstacles
from drake_starnav.station.planar_localization import PlanarLocalization
from drake_starnav.station.robot_model import add_robot, drive_geometry, robot_reach
from drake_starnav.station.wheel_slip import WheelSlip
from drake_starnav.station.wheel_speed_command import WheelSpeedCommand
from drake_starnav.station.world_geometry import add_ground, add_world
from drake_starnav.worlds.world import World

LIDAR_PORTS = ("scan", "ranges", "point_cloud", "X_WS")
POSE_PORTS = ("pose", "state", "scan_pose")


class RobotInterface(Diagram):
    """What makes a model of a plant a robot: its lidar, its localization and its wheel servo, as one diagram.

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
        drive.twist_command, lidar.*, localization.*: as of `NavigationStation`.
        desired_state: vector of the robot's model, to the plant.

    The lidar sees other robots in the plant where they reach into its plane, but not its own robot.
    """

    def __init__(
        self,
        plant: MultibodyPlant,
        scene_graph: SceneGraph,
        model: ModelInstanceIndex,
        lidar: LidarParameters,
        *,
        localization: LocalizationParameters | None = None,
        drive: DriveParameters | None = None,
        seed: int = 0,
    ) -> None:
        """
        Args:
            plant: finalized.
            scene_graph: of the plant.
            model: the robot, as from `add_robot`.
            lidar: the sensor.
            localization: error of the believed pose; none by default.
            drive: faults of the drive; none by default.
            seed: of the sensor's noise and of the faults.
        """
        super().__init__()
        self.plant, self.scene_graph, self.robot_model, self.lidar = plant, scene_graph, model, lidar
        self.localization, self.drive = localization or LocalizationParameters(), drive or DriveParameters()
        self.time_step, self.reach = plant.time_step(), robot_reach(plant, scene_graph, model)[0]
        builder = DiagramBuilder()
        inspector = scene_graph.model_inspector()
        frames = [plant.GetBodyFrameIdOrThrow(index) for index in plant.GetBodyIndices(model)]
        self.robot_geometries = [g for f in frames for g in inspector.GetGeometries(f, Role.kProximity)]
        mount = LidarMount(
            parent_frame_id=plant.GetBodyFrameIdOrThrow(plant.GetBodyByName("base_link", model).index()),
            X_PS=plant.GetFrameByName("lidar", model).GetFixedPoseInBodyFrame(),
            exclude_frames=frames,
        )
        sensor = builder.AddNamedSystem(
            "lidar",
            LidarSensor(lidar, mount, seed=seed),
        )
        where = builder.AddNamedSystem(
            "localization",
            PlanarLocalization(
                num_positions=plant.num_positions(model),
                num_velocities=plant.num_velocities(model),
                lidar=lidar,
                error=localization,
                seed=seed,
            ),
        )
        wheels = builder.AddNamedSystem("wheels", WheelSpeedCommand(**drive_geometry(plant, scene_graph, model)))
        builder.ExportInput(sensor.GetInputPort("geometry_query"), "geometry_query")
        command, turning = self._add_drive_faults(builder, wheels, seed)
        builder.ExportInput(where.GetInputPort("multibody_state"), "multibody_state")
        builder.ExportInput(command, "drive.twist_command")
        for name in LIDAR_PORTS:
            builder.ExportOutput(sensor.GetOutputPort(name), f"lidar.{name}")
        for name in POSE_PORTS:
            builder.ExportOutput(where.GetOutputPort(name), f"localization.{name}")
        builder.ExportOutput(turning, "desired_state")
        builder.BuildInto(self)

    def _add_drive_faults(
        self, builder: DiagramBuilder, wheels: WheelSpeedCommand, seed: int
    ) -> tuple[InputPort, OutputPort]:
        """The port that takes the twist, behind the delay, and the one of the wheels' speeds, with their slip."""
        command, turning = wheels.GetInputPort("twist_command"), wheels.GetOutputPort("desired_state")
        if self.drive.slip > 0.0:
            slipping = builder.AddNamedSystem("wheel_slip", WheelSlip(slip=self.drive.slip, seed=seed))
            builder.Connect(turning, slipping.get_input_port())
            turning = slipping.get_output_port()
        if self.drive.delay > 0.0:
            delay = DiscreteTimeDelay(self.time_step, delay_steps(self.drive, self.time_step), 2)
            late = builder.AddNamedSystem("drive_delay", delay)
            builder.Connect(late.get_output_port(), command)
            command = late.get_input_port()
        return command, turning


class NavigationStation(Diagram):
    """A differential-drive robot with a lidar in a world: plant, scene, sensor and wheel servo in one diagram.

    ```
                           ┌───────────────────┐
                           │                   ├──> lidar.scan, lidar.ranges, lidar.point_cloud, lidar.X_WS
                           │                   ├──> localization.pose, localization.state
    drive.twist_command ──>│ NavigationStation ├──> localization.scan_pose
                           │                   ├──> cheat.robot_state, cheat.contact_results
                           │                   ├──> cheat.geometry_query
                           └───────────────────┘
    ```

    Ports:
        drive.twist_command: vector (v, omega), m/s and rad/s.
        lidar.*: as of `LidarSensor`; the sensor frame S lies on the robot's axis.
        localization.pose: vector (x, y, yaw) of the robot's base in the world frame W, m and rad, with its
            declared error.
        localization.state: vector (x, y, yaw, v, omega).
        localization.scan_pose: the pose at the time of the scan that arrived last.
        cheat.robot_state: multibody state of the robot.
        cheat.contact_results: `ContactResults` of the plant.
        cheat.geometry_query: `QueryObject` of the scene.
    """

    def __init__(
        self,
        world: World,
        robot: RobotParameters,
        lidar: LidarParameters,
        *,
        localization: LocalizationParameters | None = None,
        drive: DriveParameters | None = None,
        plant: MultibodyPlantConfig | None = None,
        time_step: float = 0.005,
        seed: int = 0,
    ) -> None:
        """
        Args:
            world: obstacles, and where the robot starts.
            robot: model and size.
            lidar: the sensor.
            localization: error of the believed pose; none by default.
            drive: faults of the drive; none by default.
            plant: its settings, instead of `plant_config(time_step)`.
            time_step: of the plant, s.
            seed: of the sensor's noise and of the faults.
        """
        super().__init__()
        if not time_step > 0.0:
            raise StarnavError(f"time_step is {time_step:g} s; allowed: 0 < x")
        builder = DiagramBuilder()
        settings = plant or plant_config(time_step)
        self.plant: MultibodyPlant
        self.plant, scene_graph, self.robot_model, self.ground = add_plant(builder, world, robot, settings)
        plant = self.plant
        self.scene_graph: SceneGraph = scene_graph
        self.floor = [self.ground] if world.model is None else floor_geometries(plant, scene_graph)
        model = plant, scene_graph, self.robot_model
        equipment = RobotInterface(*model, lidar, localization=localization, drive=drive, seed=seed)
        self.equipment: RobotInterface = builder.AddNamedSystem("robot", equipment)
        self.moving_obstacle_geometries = add_moving_obstacle_drive(builder, plant, world.moving_obstacles)
        robot_state = plant.get_state_output_port(self.robot_model)
        builder.Connect(scene_graph.get_query_output_port(), equipment.GetInputPort("geometry_query"))
        builder.Connect(robot_state, equipment.GetInputPort("multibody_state"))
        builder.Connect(equipment.GetOutputPort("desired_state"), plant.get_desired_state_input_port(self.robot_model))
        builder.ExportInput(equipment.GetInputPort("drive.twist_command"), "drive.twist_command")
        for name in (*(f"lidar.{port}" for port in LIDAR_PORTS), *(f"localization.{port}" for port in POSE_PORTS)):
            builder.ExportOutput(equipment.GetOutputPort(name), name)
        builder.ExportOutput(robot_state, "cheat.robot_state")
        builder.ExportOutput(plant.get_contact_results_output_port(), "cheat.contact_results")
        builder.ExportOutput(scene_graph.get_query_output_port(), "cheat.geometry_query")
        builder.BuildInto(self)
        self.set_name("station")

    @property
    def robot_geometries(self) -> list[GeometryId]:
        """Proximity geometries of the robot."""
        return self.equipment.robot_geometries


def delay_steps(drive: DriveParameters, time_step: float) -> int:
    """The drive's delay in steps of the plant, rounded up: at least one if there is any delay."""
    return max(math.ceil(drive.delay / time_step - 1e-9), int(drive.delay > 0.0))


def add_plant(
    builder: DiagramBuilder, world: World, robot: RobotParameters, settings: MultibodyPlantConfig
) -> tuple[MultibodyPlant, SceneGraph, ModelInstanceIndex, GeometryId]:
    """Add a plant and scene graph with the robot, the ground and the obstacles of a world; the plant is finalized.

    Returns:
        plant, scene graph, the robot's model instance, and the ground's geometry.
    """
    plant, scene_graph = AddMultibodyPlant(settings, builder)
    model = add_robot(plant, scene_graph, robot, world.start)
    ground = add_ground(plant, world.extent)
    if world.model is None:
        add_world(plant, world)
    else:
        add_model(plant, scene_graph, world.model)
    add_moving_obstacles(plant, scene_graph, world.moving_obstacles, model)
    plant.Finalize()
    if world.model is not None:
        drop_half_spaces(plant, scene_graph)
    return plant, scene_graph, model, ground


def plant_config(time_step: float) -> MultibodyPlantConfig:
    """Settings of a plant with which the robots drive as commanded; `time_step` in s."""
    return MultibodyPlantConfig(
        time_step=time_step,
        contact_model="point",
        discrete_contact_approximation="lagged",
        use_sampled_output_ports=False,  # sampling makes each step an unrestricted update, which copies all state
    )
