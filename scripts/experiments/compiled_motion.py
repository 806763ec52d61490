"""A robot as of `KinematicMotion`, of which all commands between two scans are decided and driven in one compiled call.

The loop of `certified_twist` and the certificates is repeated here for compiled code; what they decide by, the rollout
and the kernels of the certificates, are those of the package. The tests compare both command by command.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from drake_starnav.control.braking_certificate import covered
from drake_starnav.control.motion import SAMPLES, Pose, advanced, sample, velocity_of
from drake_starnav.control.shield import braking_twist
from drake_starnav.geometry.footprint import Footprint, Polygons
from drake_starnav.geometry.polyline import point_to_segment_squared
from drake_starnav.regions.chords import Chords
from drake_starnav.regions.region_union import RegionUnion, cover_at
from drake_starnav.regions.safe_region import CertifiedRegion, out_of_sight
from drake_starnav.regions.separation import keeps_clear
from drake_starnav.robot import Limits
from drake_starnav.simulation.kinematics import KinematicMotion
from drake_starnav.worlds.clearance import body_clearance
from drake_starnav.worlds.world import World

STRIDE = 32
"""So many poses are between those that are compared with the world first; most of them need not be compared then."""
BLOCK = 32
"""So many surfaces are asked about at once: those that refused the last motion first, and those out of reach never."""
ROUNDING = 1e-6
"""Far more than distances are rounded by, m."""
NO_POLYGONS = Polygons(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0), np.zeros(0, np.int64))
"""Of a disc."""


class Seen(NamedTuple):
    """What the last scan certifies, for compiled code.

    Attributes:
        star: center, bearing_0 and values of a union of one region.
        sight: center, bearing_0 and bearings of a `CertifiedRegion`.
        earlier: the regions of earlier scans as one union; empty: none.
        surfaces: of the hits, the nearest to the scan's place first; for a disc, none.
        away: of the first one of each BLOCK of them, m.
        refused: index of the block that refused a motion last, shape (1,).
        sizes: as of `keeps_clear`.
    """

    star: tuple[np.ndarray, np.ndarray, np.ndarray]
    sight: tuple[np.ndarray, float, tuple[float, float]]
    earlier: RegionUnion
    surfaces: Chords
    away: np.ndarray
    refused: np.ndarray
    sizes: tuple[float, float, float]

    @staticmethod
    def of(star: CertifiedRegion, margin: float, footprint: Footprint) -> "Seen":
        """From the region, the margin (m), and the footprint of the robot."""
        rows = [other.alone.rows for other in star.earlier]
        earlier = RegionUnion(*map(np.concatenate, zip(*rows, strict=True))) if rows else RegionUnion.none()
        ends, shades, center = Chords(np.zeros((0, 4)), np.zeros(0, np.bool_), star.center)
        if not footprint.is_disc:
            ends, shades, center = star.chords
        away = _distances(ends, center)
        order = np.argsort(away, kind="stable")
        first, last = star.sight
        return Seen(
            star.alone[:3],
            (star.center, float(star.bearing_0), (float(first), float(last))),
            earlier,
            Chords(ends[order], shades[order], center),
            away[order[::BLOCK]],
            np.zeros(1, np.int64),
            (margin, footprint.radius, float(star.reach - footprint.radius)),
        )


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
            (footprint.cover, NO_POLYGONS if footprint.is_disc else footprint.polygons, footprint.is_disc),
            poses,
        )
        self.asked, self.changed, self.braked = self.asked + asked, self.changed + changed, self.braked + braked
        self.pose, self.twist = poses[asked - 1], twist
        return poses[:asked]


@njit(cache=True)
def _burst(pose, twist, asked, seen, does, body, poses):
    """`CompiledMotion.burst` on arrays, which writes the poses and the last twist: its three counts.

    Args:
        pose, twist: shapes (3,) and (c,), of the robot.
        asked: the twist, shape (c,), and the proposals, shape (n, c).
        seen: `Seen`.
        does: as of `Actuation.numbers`.
        body: the places of the covering discs, `Polygons`, and whether it is a disc.
        poses: shape (m, 3), to be written.
    """
    (desired, proposals), (cover, polygons, is_disc) = asked, body
    samples, limits = np.empty((SAMPLES, 6)), Limits(*does[3:])
    now = Pose(pose[0], pose[1], pose[2])
    changed = braked = 0
    for k in range(len(poses)):
        pose[:] = now.x, now.y, now.yaw
        chosen = -1
        for p in range(len(proposals)):
            count, _, _, grips = sample(pose, twist, proposals[p], does, samples)
            if count > len(samples):
                samples = np.empty((count, 6))
                sample(pose, twist, proposals[p], does, samples)
            if grips and _accepts(samples[:count], seen, cover, polygons, is_disc):
                chosen = p
                break
        if chosen >= 0:
            target = proposals[chosen]
            changed += chosen > 0
        else:
            braked += 1
            target = braking_twist(twist, desired, limits, is_disc)
        velocity = velocity_of(twist)
        now, after, _ = advanced(now, velocity, velocity_of(target), does[1], limits)
        twist[0], twist[-1] = after.ahead, after.turning
        if len(twist) == 3:
            twist[1] = after.aside
        poses[k] = now.x, now.y, now.yaw
        same = now.x == pose[0] and now.y == pose[1] and now.yaw == pose[2]
        if same and velocity == after:
            return k + 1, changed, braked
    return len(poses), changed, braked


@njit(cache=True)
def _accepts(samples, seen, cover, polygons, is_disc):
    """Whether the `standard_certificates` of a static world accept the samples (n, 6) of a motion that grips."""
    if covered(seen.star, samples, cover):
        return True
    if is_disc:
        return False
    center, bearing_0, sight = seen.sight
    unseen = out_of_sight(center, bearing_0, sight, samples[:, :2])
    for k in range(len(samples)):
        if unseen[k] and cover_at(seen.earlier, samples[k, 0], samples[k, 1], 0.0) < 0:
            return False
    ends, shades, place = seen.surfaces
    away, refused, (margin, radius, _) = seen.away, seen.refused, seen.sizes
    reach = radius + margin + math.hypot(samples[0, 0] - place[0], samples[0, 1] - place[1])
    for k in range(1, len(samples)):
        way = math.hypot(samples[k, 0] - samples[k - 1, 0], samples[k, 1] - samples[k - 1, 1])
        reach += way + radius * abs(samples[k, 2] - samples[k - 1, 2])
    for b in range(-1, len(away)):
        if b > 0 and away[b] > reach + ROUNDING:  # the kernel, too, passes over surfaces so far away
            break
        block = refused[0] if b < 0 else b
        some = slice(block * BLOCK, (block + 1) * BLOCK)
        if not keeps_clear(samples[:, :3], Chords(ends[some], shades[some], place), polygons, seen.sizes):
            refused[0] = block
            return False
    return True


@njit(cache=True)
def _distances(ends, place):
    """Distance of each chord (k, 4) from a place (2,), shape (k,), m."""
    out = np.empty(len(ends))
    for j in range(len(ends)):
        out[j] = point_to_segment_squared(place[0], place[1], ends[j, 0], ends[j, 1], ends[j, 2], ends[j, 3])
    return np.sqrt(out)


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
