"""Moving obstacles as discs: a Kalman filter of constant velocity for each cluster. Lengths are of persons: nature."""

import math
from dataclasses import field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.lidar.laser_scan import DYNAMIC, STANDING, STATIC, UNKNOWN, LaserScan, placed_ends
from drake_starnav.tracking.clusters import (
    SMALLEST_RADIUS,
    clusters,
    first_disc,
    fitted_center,
    fitted_radius,
    least_distance,
    partners,
)
from drake_starnav.tracking.occupancy_history import Judged
from drake_starnav.tracking.parameters import DynamicObstacleParameters
from drake_starnav.tracking.prediction import Rows, chosen_rows, grown, occlusion_points, predicted_rows, seen_past
from drake_starnav.utils.snapshot import replaced, snapshot

GAIN = 0.2
"""Share by which a track's radius, and its share of moving beams, follow the latest cluster."""
RADIUS_WEIGHT = 0.2
"""Weight of a track's radius, in hits, if a cluster shows only part of the rim."""
NOISE = 0.01
NOISE_PER_RANGE = 0.005
"""Standard deviation of a measured centre, m, and what a metre of range adds."""
FIRST_SPREAD = 0.05
FIRST_SPEED_SHARE = 0.75
"""Standard deviations of a new track: of its place, m, and of its velocity, as a share of the greatest speed."""
GATE = 0.25
GATE_SPEED = 2.0
GATE_NEW = 0.3
GATE_WIDEST = 0.7
"""A cluster may continue a track whose prediction is nearer than GATE, m, and this speed times the time since the track
was seen; a track that does not count yet may be farther by GATE_NEW, m, and none by more than GATE_WIDEST."""
CONFIRMED_AFTER = 4
CONFIRMED_SPEED = 0.12
CONFIRMED_MOTION = 0.3
"""A track counts after this many scans if it has been faster than this, m/s, and a larger share than this of its beams
moved."""
SETTLED_AFTER = 10
"""Scans after which the speed of a track is known."""
PACE_DECAY = 0.2
"""The greatest recent speed decays at this rate, m/s^2."""
DRIFT_TIME = 2.5
"""A track's drift is its mean velocity over about this time, s."""
CREEPING_AFTER = 1.5
CREEPING_SPEED = 0.01
CREEPING_NOISE = 0.5
CREEPING_MOTION = 0.03
CREEPING_SWING = 0.15
"""A track creeps if it was first seen this long ago, s, and drifts by more than this speed, m/s, and this share of its
noise over that time. Unless a larger share than this of its beams hit what was free before, it must drift faster by the
last, m/rad, times the rate at which it is seen from another side: what is no disc seems to move then."""
FORGOTTEN_AFTER = 0.8
FORGOTTEN_NEW = 0.15
"""A track that is not seen is forgotten after this time, s; one that never counted, or is not where it should be,
sooner."""


@snapshot
class Tracks:
    """Dynamic obstacles as the scans show them, and all hits that may be theirs. Immutable; W, m, s.

    Attributes:
        time: of the last scan, s.
        position, velocity: shape (n, 2), of the centres, m and m/s.
        radius: shape (n,), m.
        variance: shape (n, 3): of position, of position with velocity, and of velocity, the same for both axes.
        scans: shape (n,), how many scans have seen each.
        seen: shape (n,), when it was seen last, s.
        motion: shape (n,), share of its beams that hit what was free before, smoothed.
        pace: shape (n,), its greatest recent speed, m/s: an obstacle that turns back seems to stand for a moment.
        since: shape (n,), when it was seen first, s.
        drift: shape (n, 2), its mean velocity of late, m/s: less noisy than `velocity`, and late.
        swing: shape (n,), mean rate at which the lidar's own motion shows it from another side, rad/s.
        origin: shape (2,), where the lidar was, W, m.
        hits: shape (k, 3), the hits of the last scan that are not certainly static: x, y, and the radius within which
            what was there may be by now.
        standing: shape (l, 3), static hits on objects that might start to move; none unless `guarded`.
        owner: shape (k,), the track that each hit belongs to; -1 for none.
        occlusions: shape (m, 3), places at the edges of occluded areas, from which something may come; none unless
            `guarded`.
    """

    time: float = -math.inf
    position: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    velocity: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    radius: np.ndarray = field(default_factory=lambda: np.zeros(0))
    variance: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    scans: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    seen: np.ndarray = field(default_factory=lambda: np.zeros(0))
    motion: np.ndarray = field(default_factory=lambda: np.zeros(0))
    pace: np.ndarray = field(default_factory=lambda: np.zeros(0))
    since: np.ndarray = field(default_factory=lambda: np.zeros(0))
    drift: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    swing: np.ndarray = field(default_factory=lambda: np.zeros(0))
    origin: np.ndarray = field(default_factory=lambda: np.zeros(2))
    hits: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    owner: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    standing: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    occlusions: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))

    def __len__(self) -> int:
        return len(self.radius)

    @cached_property
    def confirmed(self) -> np.ndarray:
        """Which tracks are trusted to be moving obstacles, shape (n,), bool."""
        return (self.scans >= CONFIRMED_AFTER) & (self.pace > CONFIRMED_SPEED) & (self.motion > CONFIRMED_MOTION)

    @cached_property
    def settled(self) -> np.ndarray:
        """Which tracks are old enough for their speeds to be known, shape (n,), bool."""
        return self.scans >= SETTLED_AFTER

    @cached_property
    def creeping(self) -> np.ndarray:
        """Which tracks move too slowly to be told from what stands by single hits, shape (n,), bool."""
        age = self.time - self.since
        noise = NOISE + NOISE_PER_RANGE * np.hypot(*(self.position - self.origin).T)
        least = CREEPING_SPEED + CREEPING_NOISE * noise / np.clip(age, 1e-9, DRIFT_TIME)
        least += np.where(self.motion > CREEPING_MOTION, 0.0, CREEPING_SWING * np.abs(self.swing))
        return ~self.confirmed & (age >= CREEPING_AFTER) & (np.hypot(*self.drift.T) > least)

    @cached_property
    def foreseen(self) -> np.ndarray:
        """Which tracks are avoided at their predicted positions, shape (n,), bool."""
        return self.confirmed | self.creeping

    @cached_property
    def trusted(self) -> np.ndarray:
        """Which tracks move as they are known to, shape (n,), bool."""
        return self.confirmed & self.settled

    @cached_property
    def sources(self) -> tuple[np.ndarray, np.ndarray]:
        """Places from which something may come, shape (k, 3), as `hits`, and the track of each, (k,); -1 for none.

        Beside those listed that of each trusted track that is not in view, a disc at its predicted position.
        """
        lost, still = np.flatnonzero(self.trusted & (self.seen < self.time)), (self.standing, self.occlusions)
        discs = np.column_stack((self.position, self.radius))[lost]
        owner = np.concatenate((self.owner, np.full(sum(map(len, still)), -1), lost))
        return np.vstack((self.hits, *still, discs)), owner

    @cached_property
    def expected_velocity(self) -> np.ndarray:
        """The velocities by which the tracks are predicted, shape (n, 2), m/s."""
        return np.where(self.confirmed[:, None], self.velocity, self.drift)


def updated(
    tracks: Tracks, scan: LaserScan, judged: Judged, pose: np.ndarray, parameters: DynamicObstacleParameters
) -> tuple[Tracks, np.ndarray]:
    """The tracks after one more scan, and the motion state of each beam as they show it, shape (n,).

    Each cluster continues the track that is predicted nearest to it, or begins one. The centre of a continued track is
    where a disc of its radius fits the hits best, so that a partly occluded obstacle does not seem to slow down. If the
    radius estimate changes, the centre is shifted along the line of sight, which is not motion.

    Args:
        scan: the latest, in S.
        judged: of its beams.
        pose: (x, y, yaw) of S in W when it was taken.
        parameters: max_speed, max_radius, caution.
    """
    rows, points, owner = _updated(
        Rows._make([getattr(tracks, name) for name in Rows._fields]),
        (tracks.time, tracks.origin),
        scan.beams,
        judged,
        (float(pose[0]), float(pose[1]), float(pose[2])),
        (scan.time, scan.angle_min),
        (parameters.max_speed, parameters.max_radius),
    )
    doubtful = judged.motion != STATIC
    after = Tracks(
        time=scan.time,
        origin=pose[:2].copy(),
        hits=grown(points[doubtful], 0.0),
        owner=owner[doubtful],
        **rows._asdict(),
    )
    if parameters.guarded:
        standing = grown(points[judged.may_start & ~doubtful], 0.0)
        after = replaced(after, standing=standing, occlusions=occlusion_points(scan, pose))
    motion = np.where(judged.may_start & (judged.motion == STATIC), STANDING, judged.motion)
    if len(after):
        tracked = owner >= 0
        motion[tracked & doubtful & after.confirmed[owner]] = DYNAMIC
        motion[tracked & after.creeping[owner]] = UNKNOWN  # an obstacle to plan around, and not to remember
    return after, motion


@kernel
def _updated(tracks, last, beams, judged, pose, now, limits):
    """The loop of `updated`: the `Rows` of the tracks, where each beam ends, and the track that it belongs to, or -1.

    Args:
        tracks: their `Rows`.
        last: time of the last scan, s, and where it was taken.
        beams, judged: `Beams` of the scan, and what they hit.
        pose: (x, y, yaw) of the scan.
        now: its time, s, and its first bearing, rad.
        limits: max_speed and max_radius.
    """
    (x, y, yaw), (time, angle_min), (max_speed, max_radius), place = pose, now, limits, np.array(pose[:2])
    n, known = len(judged.motion), len(tracks.radius)
    points = placed_ends(beams.directions, beams.distances, np.ones(n, np.bool_), x, y, math.cos(yaw), math.sin(yaw))
    found = clusters(beams, judged.motion != STATIC, judged.may_start, max_radius)
    discs, whole = np.empty((len(found), 3)), np.empty(len(found), np.bool_)
    for c in range(len(found)):
        discs[c, 0], discs[c, 1], discs[c, 2], whole[c] = first_disc(beams, found[c], points, place, max_radius)
    before = predicted_rows(tracks, time - last[0])
    partner = partners(discs, before.position, _gates(before, time))
    lost = np.ones(known, np.bool_)
    lost[partner[partner >= 0]] = False
    for k in range(known):
        absent = before.scans[k] <= CONFIRMED_AFTER
        absent = absent or seen_past(beams, (x, y, yaw + angle_min), before.position[k])
        lost[k] &= time - before.seen[k] < (FORGOTTEN_NEW if absent else FORGOTTEN_AFTER)
    kept = np.flatnonzero(lost)  # though this scan does not show them
    rows, owner = chosen_rows(before, np.concatenate((kept, partner))), np.full(n, -1)
    for c in range(len(found)):
        row, k, (first, count) = len(kept) + c, partner[c], found[c]
        run = (first + np.arange(count)) % n
        owner[run] = row
        if k < 0:
            rows.position[row], rows.radius[row], rows.scans[row] = discs[c, :2], discs[c, 2], 1
            rows.seen[row], rows.since[row] = time, time
            rows.variance[row, 0], rows.variance[row, 2] = FIRST_SPREAD**2, (FIRST_SPEED_SHARE * max_speed) ** 2
            continue
        cluster = Cluster(points[run], least_distance(beams.distances, found[c]), discs[c, 2], whole[c])
        _continue(rows, row, tracks.position[k], cluster, (last[1], place), (time, time - last[0]), limits)
        rows.motion[row] += GAIN * (np.mean(judged.came[run]) - rows.motion[row])
    return rows, points, owner


class Cluster(NamedTuple):
    """A cluster of hits: where they are, the least range, the radius of the disc that they show, and if all of it."""

    points: np.ndarray
    distance: float
    radius: float
    whole: bool


@kernel
def _continue(rows, k, last, cluster, origins, times, limits):
    """Correct the predicted row of a track that a cluster continues.

    Args:
        rows, k: number k of them.
        last: where the track was at the last scan.
        cluster: of this scan.
        origins: where the lidar was then, and is.
        times: now, and since the last scan, s.
        limits: max_speed and max_radius.
    """
    (before, place), (time, step), radius, position = origins, times, rows.radius[k], rows.position[k]
    if cluster.whole:
        kept = radius + GAIN * (cluster.radius - radius)
    else:
        kept = min(max(fitted_radius(cluster.points, position, radius, RADIUS_WEIGHT), SMALLEST_RADIUS), limits[1])
    away = position - place
    shift = (kept - radius) / max(math.hypot(away[0], away[1]), 1e-9) * away
    predicted = position + shift
    noise = NOISE + NOISE_PER_RANGE * cluster.distance
    p, c, v = rows.variance[k]
    gain_p, gain_v = p / (p + noise * noise), c / (p + noise * noise)
    miss = fitted_center(cluster.points, predicted, kept) - predicted
    position, velocity = predicted + gain_p * miss, rows.velocity[k] + gain_v * miss
    velocity *= min(1.0, limits[0] / max(math.hypot(velocity[0], velocity[1]), 1e-9))
    gain = min(step / min(max(time - rows.since[k], step), DRIFT_TIME), 1.0)
    for i in range(2):
        went = position[i] - last[i] - shift[i] if cluster.whole else 0.0  # it may be a wall behind a gap
        rows.drift[k, i] += gain * (went / step - rows.drift[k, i])
        rows.position[k, i], rows.velocity[k, i] = position[i], velocity[i]
    rows.swing[k] += gain * (_turned(last, before, place) / step - rows.swing[k])
    rows.variance[k, 0], rows.variance[k, 1] = (1.0 - gain_p) * p, (1.0 - gain_p) * c
    rows.variance[k, 2] = v - gain_v * c
    rows.pace[k] = max(math.hypot(velocity[0], velocity[1]), rows.pace[k] - PACE_DECAY * step)
    rows.radius[k], rows.seen[k] = kept, time
    rows.scans[k] += 1


@kernel
def _turned(place, before, now):
    """The angle by which the line of sight to a place (2,) turns as the lidar moves between positions (2,), rad."""
    a, b, c, d = place[0] - before[0], place[1] - before[1], place[0] - now[0], place[1] - now[1]
    return math.atan2(a * d - b * c, a * c + b * d)


@kernel
def _gates(rows, time):
    """How far from the prediction of each track a cluster may continue it, shape (n,), m."""
    gates = GATE + GATE_SPEED * (time - rows.seen)
    return np.minimum(gates + np.where(rows.scans < CONFIRMED_AFTER, GATE_NEW, 0.0), GATE_WIDEST)
