"""What navigation needs of a robot: ports by name, where its lidars are, and what is declared of it."""

import functools
from collections.abc import Callable, Sequence
from typing import Protocol, TypeVar

from pydrake.systems.framework import InputPort, OutputPort

from drake_starnav.lidar.mounts import Mount
from drake_starnav.scenario.schema import Scenario
from drake_starnav.station.model_world import make_world_with_footprints
from drake_starnav.station.navigation_station import NavigationStation
from drake_starnav.station.robot_interface import RobotInterface
from drake_starnav.station.world_geometry import find_obstacle_height
from drake_starnav.systems.release import release
from drake_starnav.systems.star_perception import lidar_names
from drake_starnav.worlds.world import World

Asked = TypeVar("Asked")

DECLARED = "localization", "drive", "robot"
"""Sections of a scenario that say what a robot is, beside its lidars and the time step of a plant."""


class Robot(Protocol):
    """A robot, simulated or real: a system with these ports, and two attributes.

    `NavigationStation`, `RobotInterface` and `runtime.station.DriverStation` are robots; docs/extend.md has another.

    Ports:
        lidar.scan: abstract output, the last `LaserScan`; further lidars are lidar_2, lidar_3, ...
        localization.pose: vector output (x, y, yaw) of the robot's frame in W, m and rad.
        localization.state: vector output (x, y, yaw, v, omega); v is along the robot's x axis.
        localization.scan_pose: vector output (x, y, yaw), the pose at the time of the last scan.
        drive.twist_command: vector input, as the base's twists are; see `robot.base`.

    Attributes:
        scenario: what is declared of it: robot, lidars, localization, drive and `simulation.time_step`.
        mounts: of its lidars, in their order.
    """

    @property
    def scenario(self) -> Scenario: ...

    @property
    def mounts(self) -> Sequence[Mount]: ...

    def GetInputPort(self, port_name: str) -> InputPort: ...

    def GetOutputPort(self, port_name: str) -> OutputPort: ...


def robot_mounts(scenario: Scenario) -> tuple[Mount, ...]:
    """Where a robot's lidars are by its model."""
    return _by_model(scenario, lambda robot: tuple(robot.mounts))


def robot_world(scenario: Scenario, seed: int) -> World:
    """The world of a scenario and a seed, with the footprints of all that stands no higher than the robot's body.

    Raises:
        StarnavError: as in `make_world_with_footprints`.
    """
    return make_world_with_footprints(
        scenario.world,
        seed,
        scenario.robot.shape,
        scenario.goals,
        functools.partial(body_top, scenario),
    )


def body_top(scenario: Scenario) -> float:
    """Height of a robot's body above the floor, without its overhangs, m."""
    return _by_model(scenario, lambda robot: robot.body_top)


def obstacle_top(scenario: Scenario) -> float:
    """Height of prisms, cylinders and walls in a plant with a robot, m."""
    return _by_model(scenario, lambda robot: find_obstacle_height(robot.plant, robot.scene_graph))


def _by_model(scenario: Scenario, asked: Callable[[RobotInterface], Asked]) -> Asked:
    """What is asked of a scenario's robot, alone on the floor."""
    station = NavigationStation(World("empty", (0.0, 0.0, 0.0), (1.0, 0.0)), scenario)
    answer = asked(station.robot_interface)
    release(station)
    return answer


def scan_ports(robot: Robot) -> list[OutputPort]:
    """The ports of the scans of a robot's lidars, in their order."""
    return [robot.GetOutputPort(f"{lidar}.scan") for lidar in lidar_names("lidar", len(robot.mounts))]
