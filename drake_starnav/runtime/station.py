"""The drivers of a robot as systems: what is fixed in their inputs is what navigation reads."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import Context, InputPort, LeafSystem

from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.mounts import Mount
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.scenario.schema import Scenario
from drake_starnav.systems.release import declare_value, declare_vector
from drake_starnav.systems.star_perception import lidar_names


class DriverStation(LeafSystem):
    """A `Robot` whose outputs are its inputs.

    ```
                           ┌───────────────┐
    scan ─────────────────>│               ├──> lidar.scan
    scan_pose ────────────>│               ├──> localization.scan_pose
    state ────────────────>│ DriverStation ├──> localization.state, localization.pose
    drive.twist_command ──>│               │
                           └───────────────┘
    ```

    Ports are as of `navigation.Robot`; further lidars have scan_2, lidar_2.scan, ...
    """

    def __init__(self, scenario: Scenario, mounts: Sequence[Mount]) -> None:
        """What is declared of the robot, and where its lidars are."""
        super().__init__()
        self.scenario, self.mounts = scenario, tuple(mounts)
        count, lidars = len(scenario.robot.drive.components), scenario.all_lidars
        names = lidar_names("scan", len(lidars)), lidar_names("lidar", len(lidars))
        for lidar, scan, name in zip(lidars, *names, strict=True):
            port = self.DeclareAbstractInputPort(scan, Value(LaserScan.nothing()))
            declare_value(self, f"{name}.scan", make_empty_scan(lidar), _add_output_of_input(port), {port.ticket()})
        self.DeclareVectorInputPort("drive.twist_command", count)
        where, state = self.DeclareVectorInputPort("scan_pose", 3), self.DeclareVectorInputPort("state", 5)
        for name, size, port in (
            ("localization.scan_pose", 3, where),
            ("localization.state", 5, state),
            ("localization.pose", 3, state),
        ):
            declare_vector(self, name, size, _add_output_of_input(port, slice(size)), {port.ticket()})


def make_empty_scan(lidar: LidarParameters) -> LaserScan:
    """A scan that measures nothing, as before the first one."""
    return LaserScan(0.0, ranges=np.full(lidar.beams, math.nan), **lidar.scan_fields)


class AskedGoal(LeafSystem):
    """The goal that is asked for: outputs `goal`, (x, y) in W, m, and `heading`, rad, or NaN, are its inputs."""

    def __init__(self) -> None:
        super().__init__()
        for name, size in (("goal", 2), ("heading", 1)):
            port = self.DeclareVectorInputPort(name, size)
            declare_vector(self, name, size, _add_output_of_input(port, slice(size)), {port.ticket()})


def _add_output_of_input(port: InputPort, part: slice | None = None) -> Callable[[LeafSystem, Context], Any]:
    """What an input port holds, or a part of it, as the value of an output."""
    return lambda own, context: port.Eval(context) if part is None else port.Eval(context)[part]
