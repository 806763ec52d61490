"""A robot that does exactly what its shield lets pass, in a world that its lidars see, without a plant."""

import math
from collections.abc import Sequence

import numpy as np

from drake_starnav.geometry.se2 import compose_poses
from drake_starnav.lidar.mounts import ON_AXIS, Mount
from drake_starnav.robot.motion import Actuation, roll_out
from drake_starnav.safety.certificates import all_accept
from drake_starnav.safety.clear import ClearanceCertificate
from drake_starnav.safety.shield import make_braking_twist, ramp_twist
from drake_starnav.scenario.margins import derive_margins
from drake_starnav.scenario.schema import Scenario
from drake_starnav.surroundings.perception import PerceptionSettings, PerceptionState, perceive
from drake_starnav.worlds.clearance import compute_body_clearance
from drake_starnav.worlds.view import scan_from, visible_shapes
from drake_starnav.worlds.world import World


class KinematicRobot:
    """The robot follows its ramps exactly; its scans are of the world's shapes, taken at the first lidar's rate.

    Attributes:
        pose: (x, y, yaw), W, m and rad.
        twist: as many numbers as those of the base.
        seen: what its shield knows.
        least: clearance so far, after each command of `drive`, m.
        asked, changed, braked: how many commands were driven, and of these how many not as they were asked for, and
            how many brake.
    """

    asked = changed = braked = 0

    def __init__(self, scenario: Scenario, world: World, seed: int, mounts: Sequence[Mount] = (ON_AXIS,)) -> None:
        """
        Args:
            scenario: of the robot and its lidars; of the faults only those of ranges are simulated.
            world: with the robot's start.
            seed: of the lidars' noise.
            mounts: of the lidars, none upside down.
        """
        margins, robot, controller = derive_margins(scenario, mounts), scenario.robot, scenario.controller
        self._lidars = tuple(zip(scenario.all_lidars, mounts, strict=True))
        self._world, self._seed, self._margin, self._rate = world, seed, margins.safety, controller.rate
        self._settings = PerceptionSettings(margins, robot.shape, tuple(mounts))
        self._shapes = visible_shapes(world)
        self._actuation = Actuation(robot.limits, robot.shape, 1.0 / controller.rate, controller.delay, robot.drive)
        self._ticks, self._scans, self.least = 0, 0, np.inf
        self.put(np.array(world.start, dtype=float))

    def put(self, pose: np.ndarray) -> None:
        """Let the robot stand at a pose (x, y, yaw), W, m and rad, as if it had not been anywhere else."""
        self.pose, self.twist = pose, np.zeros(len(self._actuation.base.components))
        self.seen = PerceptionState.initial()
        self.look()

    def look(self) -> None:
        """Take the scans where it is, and perceive."""
        places = [compose_poses(self.pose, mount[:3]) if mount != ON_AXIS else self.pose for _, mount in self._lidars]
        views = zip(self._lidars, places, strict=True)
        scans = [scan_from(self._shapes, place, lidar, self._seed, self._scans) for (lidar, _), place in views]
        self._scans += 1
        self.seen = perceive(self.seen, scans, self.pose, self._settings)

    def drive(self, twist: np.ndarray, duration: float) -> None:
        """Drive at a twist for a time, s, or until something is touched."""
        left, bursts = max(round(duration * self._rate), 1), []
        while left:
            due = self._scans / self._lidars[0][0].rate - 1e-9
            count = min(left, max(math.ceil(due * self._rate - self._ticks), 1))
            bursts.append(self.burst(twist, count))
            self._ticks, left = self._ticks + count, left - count
            if self._ticks / self._rate >= due:
                self.look()
        poses = np.concatenate(bursts)
        clear = compute_body_clearance(self._world, poses, self._actuation.footprint)
        last = int(np.argmax(clear < 0.0)) if (clear < 0.0).any() else len(poses) - 1
        self.pose, self.least = poses[last], min(self.least, float(clear[: last + 1].min()))

    def burst(self, desired: np.ndarray, count: int) -> np.ndarray:
        """Ask for a twist `count` times, or until the robot stands and stays as it is; without another scan.

        Returns:
            The poses after each command, shape (n, 3), W, m and rad.
        """
        actuation, poses = self._actuation, []
        base, limits, footprint = actuation.base, actuation.limits, actuation.footprint
        desired = base.saturate(desired, limits)
        certificates = (ClearanceCertificate(self.seen.surroundings, self._margin, footprint),)
        proposals = list(base.proposals(desired, limits))
        for _ in range(count):
            pose, twist = self.pose, self.twist
            for choice, target in enumerate(proposals):
                motion = roll_out(pose, twist, target, actuation)
                if all_accept(motion, certificates):
                    self.changed += choice > 0
                    break
            else:
                target = make_braking_twist(twist, desired, limits, footprint.is_disc)
                motion = roll_out(pose, twist, target, actuation)
                self.braked += 1
            self.pose, self.twist = motion.pose[motion.braking], ramp_twist(twist, target, actuation)
            poses.append(self.pose)
            if (self.pose == pose).all() and (self.twist == twist).all():
                break
        self.asked += len(poses)
        return np.array(poses)
