"""A robot as of `KinematicMotion`, of which all commands between two scans are decided and driven in one compiled call.

The loop of `certified_twist` and the certificates is repeated here for compiled code; what they decide by, the rollout
and the kernels of the certificates, are those of the package. The tests compare both command by command.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from drake_starnav.geometry.footprint import Footprint
from drake_starnav.robot import Limits
from drake_starnav.robot.motion import SAMPLES, ramped_velocity, sample, velocity_of
from drake_starnav.safety.clear import Clear, covered
from drake_starnav.safety.shield import braking_twist
from drake_starnav.simulation.kinematics import KinematicMotion
from drake_starnav.surroundings.looks import Chords, Looks
from drake_starnav.surroundings.region_union import RegionUnion
from drake_starnav.surroundings.safe_region import CertifiedRegion
from drake_starnav.surroundings.separation import keeps_clear
from drake_starnav.worlds.clearance import body_clearance
from drake_starnav.worlds.world import World

NO_SLOPES = np.zeros(0)
STRIDE = 32
"""So many poses are between those that are compared with the world first; most of them need not be compared then."""


class Seen(NamedTuple):
    """What `Clear` asks, for compiled code.

    Attributes:
        star: center, bearing_0 and values of a union of one region; empty where it is never enough.
        surfaces, looks, sizes: as of `keeps_clear`.
    """

    star: tuple[np.ndarray, np.ndarray, np.ndarray]
    surfaces: Chords
    looks: Looks
    sizes: tuple[float, float]

    @staticmethod
    def of(star: CertifiedRegion, margin: float, footprint: Footprint) -> "Seen":
        """From the region, the margin (m), and the footprint of the robot."""
        sizes = margin, float(star.look.reach - footprint.radius)
        inside = (
            Clear(star, margin, footprint).inside or RegionUnion.alone(np.zeros(2), 0.0, np.zeros(4), NO_SLOPES)[:3]
        )
        return Seen(inside, star.look.chords, star.looks, sizes)


class CompiledMotion(KinematicMotion):
    """The same robot, whose commands are driven many at a time.

    Attributes:
        asked, changed, braked: how many commands were driven, and of these how many not as they were asked for, and
            how many brake.
    """

    asked = changed = braked = 0

    def look(self) -> None:
        """As of `KinematicMotion`."""
        super().look()
        self._packed = Seen.of(self._seen.safety, self._margin, self._actuation.footprint)

    def burst(self, desired: np.ndarray, count: int) -> np.ndarray:
        """Ask for a twist `count` times, or until the robot stands and stays as it is; without another scan.

        Returns:
            The poses after each command, shape (n, 3), W, m and rad.
        """
        actuation = self._actuation
        base, limits, footprint = actuation.base, actuation.limits, actuation.footprint
        desired = base.saturated(desired, limits)
        proposals = np.array(list(base.proposals(desired, limits)))
        poses, twist = np.empty((count, 3)), np.array(self.twist, dtype=float)
        asked, changed, braked = _burst(
            np.array(self.pose, dtype=float),
            twist,
            (desired, proposals),
            self._packed,
            actuation.numbers,
            (footprint.cover, footprint.body),
            poses,
        )
        self.asked, self.changed, self.braked = self.asked + asked, self.changed + changed, self.braked + braked
        self.pose, self.twist = poses[asked - 1], twist
        return poses[:asked]


@njit(cache=True)
def _burst(pose, twist, asked, seen, does, shape, poses):
    """`CompiledMotion.burst` on arrays, which writes the poses and the last twist: its three counts.

    Args:
        pose, twist: shapes (3,) and (c,), of the robot.
        asked: the twist, shape (c,), and the proposals, shape (n, c).
        seen: `Seen`.
        does: as of `Actuation.numbers`.
        shape: the places of the covering discs, and `Body`.
        poses: shape (m, 3), to be written.
    """
    (desired, proposals), (cover, body) = asked, shape
    is_disc, samples, limits = len(body.polygons.ends) == 0, np.empty((SAMPLES, 6)), Limits(*does[4:])
    changed = braked = braking = 0
    for k in range(len(poses)):
        chosen = -1
        for p in range(len(proposals)):
            count, _, braking, grips = sample(pose, twist, proposals[p], does, samples)
            if count > len(samples):
                samples = np.empty((count, 6))
                sample(pose, twist, proposals[p], does, samples)
            if grips and (
                covered(seen.star, samples[:count], cover)
                or keeps_clear(samples[:count], seen.surfaces, seen.looks, body, seen.sizes)
            ):
                chosen = p
                break
        if chosen >= 0:
            target = proposals[chosen]
            changed += chosen > 0
        else:
            braked += 1
            target = braking_twist(twist, desired, limits, is_disc)
            count, _, braking, _ = sample(pose, twist, target, does, samples)
            if count > len(samples):
                samples = np.empty((count, 6))
                sample(pose, twist, target, does, samples)
        velocity = velocity_of(twist)
        after, _ = ramped_velocity(velocity, velocity_of(target), does[1], limits)
        twist[0], twist[-1] = after.ahead, after.turning
        if len(twist) == 3:
            twist[1] = after.aside
        poses[k] = samples[braking, :3]
        if velocity == after and (poses[k] == pose).all():
            return k + 1, changed, braked
        pose[:] = poses[k]
    return len(poses), changed, braked


def least_clearance(world: World, poses: np.ndarray, footprint: Footprint, known: float) -> tuple[float, int]:
    """The least of a clearance that is known and the true shape's at poses (n, 3), m, and the index of its pose or -1.

    A pose is left out only if the robot cannot have come nearer than `known` on its way from a pose that was compared.
    """
    steps = np.diff(poses, axis=0)
    way = np.concatenate(([0.0], np.cumsum(np.hypot(*steps[:, :2].T) + footprint.lever * abs(steps[:, 2]))))
    clear, at = np.full(len(poses), np.nan), -1
    ends = np.unique(np.append(np.arange(0, len(poses), STRIDE), len(poses) - 1))
    compared, first, last = ends, ends[:-1], ends[1:]
    while True:
        clear[compared] = body_clearance(world, poses[compared], footprint)
        least = compared[np.argmin(clear[compared])]
        if clear[least] < known:
            known, at = float(clear[least]), int(least)
        near = (0.5 * (clear[first] + clear[last] - way[last] + way[first]) < known) & (last - first > 1)
        if not near.any():
            return known, at
        first, last = first[near], last[near]
        compared = (first + last) // 2
        first, last = np.concatenate((first, compared)), np.concatenate((compared, last))
