"""A disc in ir-sim, as drivers deliver it: for the runtime, with a lidar that is not ours."""

import contextlib
import io
import math

import numpy as np

from benchmarks.simulators import irsim_world
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.runtime import Odometry
from drake_starnav.runtime.loop import Reading
from drake_starnav.scenario.schema import Scenario
from tests.helpers.bare_robot import EPOCH, BareRobot


class IrsimRobot(BareRobot):
    """It does at once what it is told; `touched` counts the periods in which it collides."""

    def __init__(self, scenario: Scenario, seed: int = 0) -> None:
        super().__init__(scenario, seed=seed)
        self.simulation = irsim_world(scenario, self.world, self.period, noise=False)
        self.noise, self.touched = np.random.default_rng(seed), 0

    def read(self) -> Reading:
        now, scans, lidar = EPOCH + self.time, [], self.scenario.lidar
        if self.scans / lidar.rate <= self.time + 1e-9:
            seen = self.simulation.robot.get_lidar_scan()
            ranges = np.array(seen["ranges"], float)
            ranges[ranges >= lidar.range_max - 1e-6] = math.inf
            ranges += lidar.noise * self.noise.standard_normal(len(ranges))
            angles = seen["angle_min"], seen["angle_increment"]
            scans, self.scans = [LaserScan(now, *angles, lidar.range_min, lidar.range_max, ranges)], self.scans + 1
        return Reading(now, scans, [Odometry(now, *self.pose.tolist(), *self.twist.tolist())], self.world.goal)

    def drive(self, command) -> None:
        self.twist = np.array(command.twist)
        with contextlib.redirect_stdout(io.StringIO()):
            self.simulation.step(self.twist[:, None])
        self.pose = self.simulation.robot.state[:3, 0].copy()
        self.ticks += 1
        self.touched += bool(self.simulation.robot.collision)
