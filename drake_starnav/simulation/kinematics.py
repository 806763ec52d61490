"""A robot that does exactly what it is commanded, in a world that its lidars see, without a plant."""

from collections.abc import Sequence

import numpy as np

from drake_starnav.geometry.se2 import composed
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.mounts import ON_AXIS, Mount
from drake_starnav.robot.motion import Actuation, roll_out
from drake_starnav.safety.certificates import Certificate, standard_certificates
from drake_starnav.safety.shield import certified_twist, ramped_twist
from drake_starnav.scenario.margins import derive_margins
from drake_starnav.scenario.schema import Scenario
from drake_starnav.surroundings.perception import Perceived, PerceptionSettings, perceive
from drake_starnav.worlds.clearance import body_clearance
from drake_starnav.worlds.view import scan_from, visible_shapes
from drake_starnav.worlds.world import World


class KinematicMotion:
    """The robot follows its ramps exactly; the scans are of the world's shapes, and taken at the lidar's rate.

    Attributes:
        pose: (x, y, yaw), W, m and rad.
        twist: as many numbers as those of the base.
        scan: the last one of the first lidar.
        least: clearance so far, after each command, m.
    """

    def __init__(
        self, scenario: Scenario, world: World, seed: int, shield: bool, mounts: Sequence[Mount] = (ON_AXIS,)
    ) -> None:
        """
        Args:
            scenario: of the robot and its lidars; of the faults only those of ranges are simulated.
            world: with the robot's start.
            seed: of the lidars' noise.
            shield: whether a twist is driven only as far as the certificates accept it.
            mounts: of the lidars, none upside down.
        """
        margins = derive_margins(scenario, mounts)
        self._lidars = tuple(zip(scenario.all_lidars, mounts, strict=True))
        self._world, self._seed, self._shield, self._margin = world, seed, shield, margins.safety
        self._settings = PerceptionSettings(margins, scenario.robot.shape, None, tuple(mounts))
        controller, robot = scenario.controller, scenario.robot
        self._rate, self._shapes = controller.rate, visible_shapes(world)
        self._actuation = Actuation(robot.limits, robot.shape, 1.0 / controller.rate, controller.delay, robot.drive)
        self._ticks, self._scans, self.least = 0, 0, np.inf
        self.put(np.array(world.start, dtype=float))

    @property
    def touched(self) -> bool:
        """Whether the robot has touched anything."""
        return bool(self.least < 0.0)

    def put(self, pose: np.ndarray) -> None:
        """Let the robot stand at a pose (x, y, yaw), W, m and rad, as if it had not been anywhere else."""
        self.pose, self.twist = pose, np.zeros(len(self._actuation.base.components))
        self._seen = Perceived.nothing()
        self.look()

    def look(self) -> None:
        """Take the scans where it is, and perceive."""
        scans: list[LaserScan] = []
        for lidar, mount in self._lidars:
            place = composed(self.pose, mount[:3]) if mount != ON_AXIS else self.pose
            scans.append(scan_from(self._shapes, place, lidar, self._seed, self._scans))
        self.scan, self._scans = scans[0], self._scans + 1
        if self._shield:
            self._seen = perceive(self._seen, scans, self.pose, self._settings)
            place = self.pose[:2]
            self._certificates: tuple[Certificate, ...] = standard_certificates(
                self._seen.safety, self._margin, self._actuation, place
            )

    def drive(self, twist: np.ndarray, duration: float) -> None:
        """Drive at a twist for a time, s, or until something is touched."""
        actuation, rate = self._actuation, self._rate
        want = twist = actuation.base.saturated(twist, actuation.limits)
        poses = []
        for _ in range(max(round(duration * rate), 1)):
            if self._shield:
                want, _ = certified_twist(self.pose, self.twist, twist, self._certificates, actuation)
            motion = roll_out(self.pose, self.twist, want, actuation)
            self.pose, self.twist = motion.pose[motion.braking], ramped_twist(self.twist, want, actuation)
            poses.append(self.pose)
            self._ticks += 1
            if self._ticks / rate >= self._scans / self._lidars[0][0].rate - 1e-9:
                self.look()
        clear = body_clearance(self._world, np.array(poses), actuation.footprint)
        last = int(np.argmax(clear < 0.0)) if (clear < 0.0).any() else len(poses) - 1
        self.pose, self.least = poses[last], min(self.least, float(clear[: last + 1].min()))

    def close(self) -> None:
        """Nothing to give back."""
