"""A robot that does exactly what it is told, in a world that its lidar sees, as drivers deliver it: for the runtime."""

import math
from dataclasses import replace

import numpy as np

from drake_starnav.geometry.se2 import compose_poses
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.mounts import Mount
from drake_starnav.lidar.raycast import Fan, cast_groups
from drake_starnav.lidar.sensor_model import measure
from drake_starnav.robot.motion import Pose, advance_pose, convert_to_velocity
from drake_starnav.runtime import Odometry
from drake_starnav.runtime.loop import Reading
from drake_starnav.scenario.schema import Scenario
from drake_starnav.worlds import make_world
from drake_starnav.worlds.clearance import compute_body_clearance
from drake_starnav.worlds.view import scan_from, visible_shapes
from drake_starnav.worlds.world import World

EPOCH = 1.7e9
"""When it begins, s: a clock as robots have it."""


class BareRobot:
    """Read and driven in lock step; the attributes are the truth.

    Attributes:
        pose, twist, time: now; the time is since the beginning, s.
        way: driven so far, m.
        clearance: the least so far, m.
    """

    def __init__(self, scenario: Scenario, world: World | None = None, seed: int = 0) -> None:
        self.scenario, self.seed = scenario, seed
        self.world = make_world(scenario.world, seed, scenario.robot.radius) if world is None else world
        self.shapes = visible_shapes(self.world)
        self.period, self.limits = 1.0 / scenario.controller.rate, scenario.robot.limits
        self.twist = np.zeros(len(scenario.robot.drive.components))
        self.pose, self.ticks, self.scans = np.array(self.world.start, float), 0, 0
        self.way, self.clearance = 0.0, math.inf

    @property
    def time(self) -> float:
        return self.ticks * self.period

    @property
    def speed(self) -> float:
        return float(np.hypot(*self.twist[:-1]) if len(self.twist) > 2 else abs(self.twist[0]))

    @property
    def stands(self) -> bool:
        return self.speed == 0.0 and (self.limits.steers > 0.0 or self.twist[-1] == 0.0)

    def read(self) -> Reading:
        now, scans, lidar = EPOCH + self.time, [], self.scenario.lidar
        if self.scans / lidar.rate <= self.time + 1e-9:
            ranges = self._ranges(self.scans)
            scans, self.scans = [LaserScan(now, ranges=ranges, **lidar.scan_fields)], self.scans + 1
        ahead, aside, turning = convert_to_velocity(self.twist)
        turning *= ahead if self.limits.steers > 0.0 else 1.0
        x, y, yaw = self.pose.tolist()
        return Reading(now, scans, [Odometry(now, x, y, yaw, ahead, turning, aside)], self.world.goal)

    def _ranges(self, index: int) -> np.ndarray:
        lidar, distances = self.scenario.lidar, np.full(self.scenario.lidar.beams, math.inf)
        fan = Fan.regular(*lidar.field_of_view)
        cast_groups(tuple(self.shapes), self.pose[None], tuple(fan), distances, lidar.range_max)
        return measure(distances, lidar, self.seed, index)

    def drive(self, command) -> None:
        """Follow a command for a period; it ramps as the certificate assumes."""
        twist = np.asarray(command.twist)
        assert np.isfinite(twist).all()
        pose, _ = advance_pose(
            Pose(*self.pose), convert_to_velocity(self.twist), convert_to_velocity(twist), self.period, self.limits
        )
        after = np.array(pose)
        self.way += math.dist(after[:2], self.pose[:2])
        self.pose, self.twist, self.ticks = after, twist.copy(), self.ticks + 1
        clear = compute_body_clearance(self.world, self.pose[None], self.scenario.robot.shape)
        self.clearance = min(self.clearance, float(clear[0]))

    def close(self) -> None:
        """Nothing to give back."""


class Slipping(BareRobot):
    """Its wheels, which odometry counts, do what they are told; the ground gives a share of it from `begin` on, s."""

    def __init__(self, scenario: Scenario, share: float, begin: float = 0.0, **options) -> None:
        super().__init__(scenario, **options)
        self.share, self.begin, self.lost = share, begin, np.zeros(2)

    def _ranges(self, index):
        lost, wheels = self.lost, self.pose
        self.pose = np.array((*(wheels[:2] - lost), wheels[2]))
        ranges, self.pose = super()._ranges(index), wheels
        return ranges

    def drive(self, command) -> None:
        before = self.pose[:2].copy()
        super().drive(command)
        self.lost = self.lost + (self.time > self.begin) * (1.0 - self.share) * (self.pose[:2] - before)


class TwoEyes(BareRobot):
    """Two lidars, ahead and behind the axis, the second of which scans half a period later."""

    MOUNTS = Mount(0.15, 0.0, 0.0, False), Mount(-0.15, 0.0, math.pi, False)

    def read(self):
        reading, lidar, scans = super().read(), self.scenario.lidar, []
        for k, mount in enumerate(self.MOUNTS):
            if self.ticks % 4 == 2 * k:  # 10 Hz each
                scan = scan_from(self.shapes, compose_poses(self.pose, mount[:3]), lidar, k, self.ticks)
                scans.append((k, replace(scan, time=reading.now)))
        return reading._replace(scans=scans)
