"""The robot in its world: plant, scene, sensor and wheel servo, in a builder or as one diagram with dotted ports."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from pydrake.geometry import GeometryId, SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex
from pydrake.systems.framework import Diagram, DiagramBuilder, InputPort, OutputPort

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.faults import DriveParameters, LocalizationParameters
from drake_starnav.scenario.schema import SimulationParameters
from drake_starnav.station.collision_monitor import Hull
from drake_starnav.station.moving_bodies import add_moving_obstacle_drive
from drake_starnav.station.plant import DISCRETE_ONLY, add_plant
from drake_starnav.station.robot_interface import LIDAR_PORTS, POSE_PORTS, RobotInterface, connect_robot
from drake_starnav.station.world_geometry import surface_world
from drake_starnav.worlds.world import World

STATION_OUTPUTS = (
    *(f"lidar.{port}" for port in LIDAR_PORTS),
    *(f"localization.{port}" for port in POSE_PORTS),
    "cheat.robot_state",
    "cheat.contact_results",
    "cheat.geometry_query",
)
"""Output ports of a station; see `NavigationStation`."""


@dataclass(frozen=True)
class Station:
    """What `add_station` put into a builder.

    Attributes:
        plant, scene_graph: of the world.
        equipment: the robot's lidar, localization and wheels.
        ground: geometry of the floor that is always there.
        moving_obstacle_geometries: what may run into the robot.
        hull: of the robot among obstacles with which the plant has no contact, see `surface_world`; None without any.
    """

    plant: MultibodyPlant
    scene_graph: SceneGraph
    equipment: RobotInterface
    ground: GeometryId
    moving_obstacle_geometries: list[GeometryId]
    hull: Hull | None

    @property
    def robot_model(self) -> ModelInstanceIndex:
        """The robot in the plant."""
        return self.equipment.model

    @property
    def robot_geometries(self) -> list[GeometryId]:
        """Proximity geometries of the robot."""
        return self.equipment.robot_geometries

    @property
    def floor(self) -> list[GeometryId]:
        """Geometries that the robot may touch."""
        return self.equipment.floor

    def GetOutputPort(self, name: str) -> OutputPort:
        """The port of a name in `STATION_OUTPUTS`."""
        if name == "cheat.robot_state":
            return self.plant.get_state_output_port(self.robot_model)
        if name == "cheat.contact_results":
            return self.plant.get_contact_results_output_port()
        if name == "cheat.geometry_query":
            return self.scene_graph.get_query_output_port()
        return self.equipment.GetOutputPort(name)

    def GetInputPort(self, name: str) -> InputPort:
        """The port of that name, as of `NavigationStation`."""
        return self.equipment.GetInputPort(name)


def add_station(
    builder: DiagramBuilder,
    world: World,
    robot: RobotParameters,
    lidar: LidarParameters,
    *,
    localization: LocalizationParameters | None = None,
    drive: DriveParameters | None = None,
    time_step: float = SimulationParameters.time_step,
    continuous: bool = False,
    settings: Mapping[str, Any] = MappingProxyType({}),
    seed: int = 0,
) -> Station:
    """Add a robot in its world to a builder: `plant`, `scene_graph`, `robot` and what moves the obstacles that move.

    The plant is discrete, so that any simulator steps it. A continuous one takes half of the time, but needs the
    diagram's own `make_simulator`: under a plain `Simulator` it takes a thousand times as long.

    Args:
        builder: to which they are added; for a continuous plant that of the whole diagram, as CENIC looks no deeper.
        world, robot, lidar, localization, drive, seed: as for `NavigationStation`.
        time_step: of a discrete plant, s; the delay of a drive is rounded up to a multiple of it.
        continuous: whether the plant may be continuous. It is always discrete where obstacles move, whose drive
            must know its steps, and with settings of the discrete contact solver.
        settings: of the plant, laid over `plant_config`: keys of `MultibodyPlantConfig`.
    """
    if not time_step > 0.0:
        raise StarnavError(f"time_step is {time_step:g} s; allowed: 0 < x")
    moving = len(world.moving_obstacles) > 0 or (world.model is not None and world.model.moving)
    step = 0.0 if continuous and not moving and not DISCRETE_ONLY & set(settings) else time_step
    plant, scene_graph, model, ground = add_plant(builder, world, robot, step, settings)
    equipment = RobotInterface(
        plant,
        scene_graph,
        model,
        lidar,
        robot=robot,
        localization=localization,
        drive=drive,
        time_step=time_step,
        seed=seed,
    )
    builder.AddNamedSystem("robot", equipment)
    connect_robot(builder, plant, scene_graph, model, equipment)
    moving_geometries = add_moving_obstacle_drive(builder, plant, world.moving_obstacles)
    surfaces = surface_world(world)
    hull = None if surfaces is None else Hull(equipment.base_frame, equipment.reach, surfaces)
    return Station(plant, scene_graph, equipment, ground, moving_geometries, hull)


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

    The plant is discrete, so that any simulator steps it, at any depth of a diagram; `add_station` knows a faster one.
    """

    def __init__(
        self,
        world: World,
        robot: RobotParameters,
        lidar: LidarParameters,
        *,
        localization: LocalizationParameters | None = None,
        drive: DriveParameters | None = None,
        time_step: float = SimulationParameters.time_step,
        settings: Mapping[str, Any] = MappingProxyType({}),
        seed: int = 0,
    ) -> None:
        """
        Args:
            world: obstacles, and where the robot starts.
            robot: model and size.
            lidar: the sensor.
            localization: error of the believed pose; none by default.
            drive: faults of the drive; none by default.
            time_step: of the plant, s.
            settings: of the plant, as for `add_station`.
            seed: of the sensor's noise and of the faults.
        """
        super().__init__()
        builder = DiagramBuilder()
        parts = add_station(
            builder,
            world,
            robot,
            lidar,
            localization=localization,
            drive=drive,
            time_step=time_step,
            settings=settings,
            seed=seed,
        )
        self.plant, self.scene_graph, self.equipment = parts.plant, parts.scene_graph, parts.equipment
        self.robot_model, self.robot_geometries = parts.robot_model, parts.robot_geometries
        self.ground = parts.ground
        self.moving_obstacle_geometries, self.hull = parts.moving_obstacle_geometries, parts.hull
        builder.ExportInput(parts.GetInputPort("drive.twist_command"), "drive.twist_command")
        for name in STATION_OUTPUTS:
            builder.ExportOutput(parts.GetOutputPort(name), name)
        builder.BuildInto(self)
        self.set_name("station")

    @property
    def floor(self) -> list[GeometryId]:
        """Geometries that the robot may touch."""
        return self.equipment.floor
