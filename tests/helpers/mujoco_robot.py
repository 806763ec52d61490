"""The shipped robot in MuJoCo, as drivers deliver it: for the runtime, with physics that are not ours."""

import math

import mujoco
import numpy as np

from benchmarks.simulators import MUJOCO_STEP, mjcf
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.scenario.schema import Scenario
from drake_starnav.worlds.world import World
from tests.helpers.bare_robot import BareRobot

TRACK, WHEEL = 0.16, 0.05


class MujocoRobot(BareRobot):
    """Pose and twist are those of the simulated base; what it touches is counted.

    Attributes:
        touched: periods in which anything but the floor was touched.
    """

    def __init__(self, scenario: Scenario, world: World | None = None, seed: int = 0) -> None:
        super().__init__(scenario, world, seed)
        self.model = mujoco.MjModel.from_xml_string(mjcf(scenario, self.world))
        self.data = mujoco.MjData(self.model)
        bearings = LaserScan(0.0, ranges=np.ones(scenario.lidar.beams), **scenario.lidar.scan_fields).bearings
        self.rays = np.column_stack((np.cos(bearings), np.sin(bearings), np.zeros(len(bearings))))
        self.noise, self.touched = np.random.default_rng(seed), 0
        mujoco.mj_forward(self.model, self.data)
        self._observe()

    @property
    def stands(self) -> bool:
        return abs(self.twist[0]) < 0.02

    def _observe(self) -> None:
        x, y, _, qw, qx, qy, qz = self.data.qpos[:7]
        yaw = math.atan2(2.0 * (qw * qz + qx * qy), qw * qw + qx * qx - qy * qy - qz * qz)
        vx, vy = self.data.qvel[:2]
        self.pose = np.array((x, y, yaw))
        self.twist = np.array((vx * math.cos(yaw) + vy * math.sin(yaw), self.data.qvel[5]))

    def _ranges(self, index: int) -> np.ndarray:
        lidar, count = self.scenario.lidar, len(self.rays)
        rays = (self.rays @ self.data.site_xmat[0].reshape(3, 3).T).ravel()
        hit, ranges, group = np.zeros(count, np.int32), np.zeros(count), np.array((1, 0, 0, 0, 0, 0), np.uint8)
        place = self.data.site_xpos[0]
        mujoco.mj_multiRay(self.model, self.data, place, rays, group, 1, 1, hit, ranges, None, count, lidar.range_max)
        ranges[(ranges < 0.0) | (ranges >= lidar.range_max)] = math.inf
        return np.maximum(ranges + lidar.noise * self.noise.standard_normal(count), lidar.range_min)

    def drive(self, command) -> None:
        v, omega = command.twist
        self.data.ctrl[:2] = (v - TRACK * omega) / WHEEL, (v + TRACK * omega) / WHEEL
        mujoco.mj_step(self.model, self.data, round(self.period / MUJOCO_STEP))
        before = self.pose
        self._observe()
        self.way += math.dist(before[:2], self.pose[:2])
        self.ticks += 1
        self.touched += any(self._strikes(contact.geom) for contact in self.data.contact[: self.data.ncon])

    def _strikes(self, geoms) -> bool:
        roots = [self.model.body_rootid[self.model.geom_bodyid[each]] for each in geoms]
        return roots[0] != roots[1] and 0 not in geoms
