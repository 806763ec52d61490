"""A robot that does exactly what it is commanded, in a world that its lidars see, without a plant."""

import functools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.geometry.footprint import Body, Footprint, Polygons
from drake_starnav.geometry.se2 import composed
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.mounts import ON_AXIS, Mount
from drake_starnav.robot import Limits
from drake_starnav.robot.motion import SAMPLES, Actuation, ramped_velocity, sample, velocity_of
from drake_starnav.safety.clear import Clear, covered
from drake_starnav.safety.shield import braking_twist
from drake_starnav.scenario.margins import derive_margins
from drake_starnav.scenario.schema import Scenario
from drake_starnav.surroundings.looks import Chords, Known, Look, Looks
from drake_starnav.surroundings.perception import Perceived, PerceptionSettings, perceive
from drake_starnav.surroundings.region_union import RegionUnion
from drake_starnav.surroundings.safe_region import CertifiedRegion
from drake_starnav.surroundings.separation import keeps_clear
from drake_starnav.worlds.clearance import body_clearance
from drake_starnav.worlds.view import scan_from, visible_shapes
from drake_starnav.worlds.world import World

NO_SLOPES = np.zeros(0)


class Seen(NamedTuple):
    """What `Clear` asks, for compiled code; of plain tuples, which are handed over faster.

    Attributes:
        star: center, bearing_0 and values of a union of one region; empty where it is never enough.
        surfaces, looks, sizes: as of `keeps_clear`, the looks without the body.
    """

    star: tuple[np.ndarray, np.ndarray, np.ndarray]
    surfaces: tuple
    looks: tuple
    sizes: tuple[float, float]

    @staticmethod
    def of(star: CertifiedRegion, margin: float, footprint: Footprint, *, all_of_it: bool) -> "Seen":
        """From the region, the margin (m), and the footprint of the robot; or only the star, which is soon made."""
        inside = (
            Clear(star, margin, footprint).inside or RegionUnion.alone(np.zeros(2), 0.0, np.zeros(4), NO_SLOPES)[:3]
        )
        if not all_of_it:
            return Seen(inside, *_unseen(), (0.0, 0.0))
        places, free, _, stood = star.looks
        sizes = margin, float(star.look.reach - footprint.radius)
        return Seen(inside, tuple(star.look.chords), (places, free, stood), sizes)


@functools.cache
def _unseen() -> tuple[tuple, tuple]:
    """Surfaces and looks of nothing, which compiled functions make."""
    places, free, _, stood = Looks.of(Known())
    return tuple(Look.none().chords), (places, free, stood)


class KinematicMotion:
    """The robot follows its ramps exactly; the scans are of the world's shapes, and taken at the lidar's rate.

    Attributes:
        pose: (x, y, yaw), W, m and rad.
        twist: as many numbers as those of the base.
        scan: the last one of the first lidar.
        seen: what its shield knows; with one.
        least: clearance so far, after each command, m.
        asked, changed, braked: how many commands were driven, and of these how many not as they were asked for, and
            how many brake.

    What is certified is decided as by `shielded`, whose loop is repeated here for compiled code: all commands between
    two scans are one call.
    """

    asked = changed = braked = 0

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
        self._settings = PerceptionSettings(margins, scenario.robot.shape, None, tuple(mounts), plans=False)
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
        self.seen = Perceived.nothing()
        self.look()

    def look(self) -> None:
        """Take the scans where it is, and perceive."""
        scans: list[LaserScan] = []
        for lidar, mount in self._lidars:
            place = composed(self.pose, mount[:3]) if mount != ON_AXIS else self.pose
            scans.append(scan_from(self._shapes, place, lidar, self._seed, self._scans))
        self.scan, self._scans = scans[0], self._scans + 1
        if self._shield:
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
        poses, footprint = np.concatenate(bursts), self._actuation.footprint
        clear = body_clearance(self._world, poses, footprint)
        last = int(np.argmax(clear < 0.0)) if (clear < 0.0).any() else len(poses) - 1
        self.pose, self.least = poses[last], min(self.least, float(clear[: last + 1].min()))

    def burst(self, desired: np.ndarray, count: int) -> np.ndarray:
        """Ask for a twist `count` times, or until the robot stands and stays as it is; without another scan.

        Returns:
            The poses after each command, shape (n, 3), W, m and rad.
        """
        actuation = self._actuation
        base, limits, footprint = actuation.base, actuation.limits, actuation.footprint
        desired = base.saturated(desired, limits)
        pose, twist, poses = np.array(self.pose, dtype=float), np.array(self.twist, dtype=float), np.empty((count, 3))
        numbers, (polygons, *sizes) = actuation.numbers, footprint.body
        shape = footprint.cover, tuple(polygons), *sizes
        seen = Seen.of(self.seen.safety, self._margin, footprint, all_of_it=False)
        ask = desired, desired[None], self._shield, False
        asked, *_, open_ = _burst(pose, twist, ask, tuple(seen), numbers, shape, poses)
        if open_:
            proposals = np.array(list(base.proposals(desired, limits)))
            seen = Seen.of(self.seen.safety, self._margin, footprint, all_of_it=True)
            further, changed, braked, _ = _burst(
                pose, twist, (desired, proposals, True, True), tuple(seen), numbers, shape, poses[asked:]
            )
            asked, self.changed, self.braked = asked + further, self.changed + changed, self.braked + braked
        self.asked, self.pose, self.twist = self.asked + asked, poses[asked - 1], twist
        return poses[:asked]

    def close(self) -> None:
        """Nothing to give back."""


@kernel
def _sampled(pose, twist, target, numbers, samples):
    """All samples of the motion that `sample` writes, from where on it brakes, and whether the wheels grip."""
    count, _, braking, grips = sample(pose, twist, target, numbers, samples)
    if count > len(samples):
        samples = np.empty((count, 6))
        sample(pose, twist, target, numbers, samples)
    return samples[:count], braking, grips


@kernel
def _burst(pose, twist, asked, seen, numbers, shape, poses):
    """`KinematicMotion.burst` on arrays, which writes poses and the last twist: its three counts, and if it is open.

    It ends, and is open, at a command that the star does not certify, where nothing else is to be asked.

    Args:
        pose, twist: shapes (3,) and (c,), of the robot.
        asked: the twist, shape (c,), the proposals, shape (n, c), whether one must be certified, and whether by more
            than the star.
        seen: `Seen` as a plain tuple.
        numbers: as of `Actuation.numbers`.
        shape: the places of the covering discs, and the fields of `Body`.
        poses: shape (m, 3), to be written.
    """
    (desired, proposals, certifies, complete), (cover, polygons, radius, lever) = asked, shape
    seen, body = Seen(*seen), Body(Polygons(*polygons), radius, lever)
    surfaces, looks = Chords(*seen.surfaces), Looks(seen.looks[0], seen.looks[1], body, seen.looks[2])
    is_disc, samples, limits = len(body.polygons.ends) == 0, np.empty((SAMPLES, 6)), Limits(*numbers[4:])
    changed = braked = braking = 0
    motion = samples
    for k in range(len(poses)):
        chosen = -1
        for p in range(len(proposals)):
            motion, braking, grips = _sampled(pose, twist, proposals[p], numbers, samples)
            if not certifies or (
                grips
                and (
                    covered(seen.star, motion, cover)
                    or (complete and keeps_clear(motion, surfaces, looks, body, seen.sizes))
                )
            ):
                chosen = p
                break
        if chosen < 0 and not complete:
            return k, changed, braked, True
        if chosen >= 0:
            target = proposals[chosen]
            changed += chosen > 0
        else:
            braked += 1
            target = braking_twist(twist, desired, limits, is_disc)
            motion, braking, _ = _sampled(pose, twist, target, numbers, samples)
        velocity = velocity_of(twist)
        after, _ = ramped_velocity(velocity, velocity_of(target), numbers[1], limits)
        twist[0], twist[-1] = after.ahead, after.turning
        if len(twist) == 3:
            twist[1] = after.aside
        poses[k] = motion[braking, :3]
        if velocity == after and (poses[k] == pose).all():
            return k + 1, changed, braked, False
        pose[:] = poses[k]
    return len(poses), changed, braked, False
