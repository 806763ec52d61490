"""The robot in its world: plant, scene, sensor and wheel servo, in a builder or as one diagram with dotted ports."""

from collections.abc import Sequence
from dataclasses import dataclass

from pydrake.geometry import GeometryId, SceneGraph
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex
from pydrake.systems.framework import Diagram, DiagramBuilder, InputPort, OutputPort

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.mounts import Mount
from drake_starnav.scenario.schema import Scenario
from drake_starnav.station.moving_bodies import add_moving_obstacle_drive
from drake_starnav.station.plant import DISCRETE_ONLY, add_plant
from drake_starnav.station.robot_interface import LIDAR_PORTS, POSE_PORTS, RobotInterface, connect_robot
from drake_starnav.station.unseen import warn_of_unseen
from drake_starnav.systems.star_perception import lidar_names
from drake_starnav.worlds.world import World

CHEAT_PORTS = ("cheat.robot_state", "cheat.contact_results", "cheat.geometry_query")


def list_station_outputs(lidars: int) -> list[str]:
    """Names of the output ports of a station by the number of its lidars; see `NavigationStation`."""
    names = lidar_names("lidar", lidars)
    return [
        *(f"{lidar}.{port}" for lidar in names for port in LIDAR_PORTS),
        *(f"localization.{port}" for port in POSE_PORTS),
        *CHEAT_PORTS,
    ]


@dataclass(eq=False)
class Station:
    """What `add_station` put into a builder; `world` is all that the plant holds, `ground` the floor always there."""

    plant: MultibodyPlant
    scene_graph: SceneGraph
    robot_interface: RobotInterface
    ground: GeometryId
    moving_obstacle_geometries: list[GeometryId]
    world: World

    @property
    def scenario(self) -> Scenario:
        """What is declared of the robot."""
        return self.robot_interface.scenario

    @property
    def mounts(self) -> Sequence[Mount]:
        """Where the lidars are."""
        return self.robot_interface.mounts

    @property
    def robot_model(self) -> ModelInstanceIndex:
        """The robot in the plant."""
        return self.robot_interface.model

    @property
    def robot_geometries(self) -> list[GeometryId]:
        """Proximity geometries of the robot."""
        return self.robot_interface.robot_geometries

    @property
    def floor(self) -> list[GeometryId]:
        """Geometries that the robot may touch."""
        return self.robot_interface.floor

    @property
    def geometry_query(self) -> OutputPort:
        """The port of the scene."""
        return self.GetOutputPort("cheat.geometry_query")

    def GetOutputPort(self, name: str) -> OutputPort:
        """The port of a name in `list_station_outputs`."""
        if name == "cheat.robot_state":
            return self.plant.get_state_output_port(self.robot_model)
        if name == "cheat.contact_results":
            return self.plant.get_contact_results_output_port()
        if name == "cheat.geometry_query":
            return self.scene_graph.get_query_output_port()
        return self.robot_interface.GetOutputPort(name)

    def GetInputPort(self, name: str) -> InputPort:
        """The port of that name, as in `NavigationStation`."""
        return self.robot_interface.GetInputPort(name)


def add_station(
    builder: DiagramBuilder, world: World, scenario: Scenario, *, continuous: bool = False, seed: int = 0
) -> Station:
    """Add a robot in its world to a builder: `plant`, `scene_graph`, `robot` and what moves the obstacles that move.

    The plant is discrete, so that any simulator steps it. A continuous one takes half of the time, but needs the
    diagram's own `make_simulator`: under a plain `Simulator` it takes a thousand times as long.

    Args:
        builder: to which they are added; for a continuous plant that of the whole diagram, as CENIC looks no deeper.
        world: obstacles, and where the robot starts; not that of the scenario.
        scenario: its `robot`, `lidar`, `localization`, `drive`, `simulation.time_step` and `plant_config`.
        continuous: whether the plant may be continuous. It is always discrete where obstacles move, whose drive
            must know its steps, and with settings of the discrete contact solver.
        seed: of the sensor's noise and of the faults.
    """
    time_step, settings = scenario.simulation.time_step, scenario.plant_config
    if not time_step > 0.0:
        raise StarnavError(f"simulation.time_step is {time_step:g} s; allowed: 0 < x")
    has_movers = len(world.moving_obstacles) > 0 or (world.model is not None and world.model.moving)
    plant_step = 0.0 if continuous and not has_movers and not DISCRETE_ONLY & set(settings) else time_step
    plant, scene_graph, model, ground = add_plant(builder, world, scenario.robot, plant_step, settings)
    robot = builder.AddNamedSystem("robot", RobotInterface(plant, scene_graph, model, scenario, seed=seed))
    connect_robot(builder, plant, scene_graph, model, robot)
    warn_of_unseen(plant, scene_graph, world, [robot])
    moving_geometries = add_moving_obstacle_drive(builder, plant, world.moving_obstacles)
    return Station(plant, scene_graph, robot, ground, moving_geometries, world)


class NavigationStation(Diagram, Station):
    """A robot with its lidars in a world: plant, scene, sensors and drive in one diagram.

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
        drive.twist_command: vector, as the base's twists are; see `robot.base`.
        lidar.*: as in `LidarSensor`; further lidars are lidar_2, lidar_3, ...
        localization.pose: vector (x, y, yaw) of the robot's base in the world frame W, m and rad, with its
            declared error.
        localization.state: vector (x, y, yaw, v, omega).
        localization.scan_pose: the pose at the time of the scan that arrived last.
        cheat.robot_state: multibody state of the robot.
        cheat.contact_results: `ContactResults` of the plant.
        cheat.geometry_query: `QueryObject` of the scene.

    The plant is discrete, so that any simulator steps it, at any depth of a diagram; `add_station` knows a faster one.
    """

    def __init__(self, world: World, scenario: Scenario, *, seed: int = 0) -> None:
        """Build it; the arguments are those of `add_station`."""
        Diagram.__init__(self)
        builder = DiagramBuilder()
        parts = add_station(builder, world, scenario, seed=seed)
        Station.__init__(self, **vars(parts))
        builder.ExportInput(parts.GetInputPort("drive.twist_command"), "drive.twist_command")
        for name in list_station_outputs(len(self.mounts)):
            builder.ExportOutput(parts.GetOutputPort(name), name)
        builder.BuildInto(self)
        self.set_name("station")


StationInterface = Station | RobotInterface
"""A robot of a plant; the last is one of several."""


def simulated(robot: object) -> StationInterface:
    """The robot as one of a plant; a `StarnavError` for any other, which has no scene."""
    if not isinstance(robot, StationInterface):
        raise StarnavError(
            f"the robot is {type(robot).__name__}, without a plant; allowed here: a station, whose scene is drawn"
        )
    return robot
