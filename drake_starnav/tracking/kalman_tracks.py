"""Moving obstacles as discs with velocities: a Kalman filter of constant velocity for each cluster of hits."""

import dataclasses
import math
from dataclasses import field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from drake_starnav.lidar.laser_scan import DYNAMIC, STATIC, UNKNOWN, LaserScan
from drake_starnav.tracking.clusters import (
    SMALLEST_RADIUS,
    clusters,
    first_disc,
    fitted_center,
    fitted_radius,
    partners,
)
from drake_starnav.tracking.parameters import DynamicObstacleParameters
from drake_starnav.tracking.prediction import occlusion_points, predicted_trajectories, seen_past
from drake_starnav.utils.snapshot import snapshot

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
"""A track counts after so many scans, if it has been faster than this, m/s, and a larger share of its beams moved."""
AGILITY = 0.7
"""Random change of velocity that is expected, per root of time, m/s/sqrt(s)."""
SETTLED_AFTER = 10
"""The speed of a track is known after so many scans."""
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
noise over that time. Unless a larger share than this of its beams hit what was free before, it must drift by so many
metres more for each radian by which it is seen from another side: what is no disc seems to move then."""
FORGOTTEN_AFTER = 0.8
FORGOTTEN_NEW = 0.15
"""A track that is not seen is forgotten after this time, s; one that never counted, or is not where it should be,
sooner."""


class Track(NamedTuple):
    """One of the `Tracks`, whose attributes of these names it has the elements of."""

    position: np.ndarray
    velocity: np.ndarray
    radius: float
    variance: np.ndarray
    scans: int
    seen: float
    motion: float
    pace: float
    since: float
    drift: np.ndarray
    swing: float


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
        hits: shape (k, 2), the hits of the last scan that are not certainly static.
        standing: shape (l, 2), static hits on objects that might start to move; none unless `guarded`.
        owner: shape (k,), the track that each hit belongs to; -1 for none.
        predicted_trajectories: shape (n, k, 2), the predicted trajectory of each, now and every `PREDICTION_STEP` from
            now on.
        occlusions: shape (m, 2), places at the edges of occluded areas, from which something may come; none unless
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
    hits: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    owner: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    standing: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    predicted_trajectories: np.ndarray = field(default_factory=lambda: np.zeros((0, 1, 2)))
    occlusions: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))

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
    def expected_velocity(self) -> np.ndarray:
        """With which the tracks are predicted, shape (n, 2), m/s."""
        return np.where(self.confirmed[:, None], self.velocity, self.drift)

    def at(self, time: float) -> np.ndarray:
        """Where the centres will be at a time (s) if none of them changes its velocity, shape (n, 2)."""
        return self.position + self.velocity * (time - self.time)


class Beams(NamedTuple):
    """What `OccupancyHistory` tells of the beams of a scan, each of shape (n,): STATIC, UNKNOWN or DYNAMIC, which hit
    what was not here before, and which hit something small enough to move."""

    motion: np.ndarray
    came: np.ndarray
    may_start: np.ndarray


def updated(
    tracks: Tracks,
    scan: LaserScan,
    beams: Beams,
    pose: np.ndarray,
    parameters: DynamicObstacleParameters,
    walls: np.ndarray,
) -> tuple[Tracks, np.ndarray]:
    """The tracks after one more scan, and the motion state of each beam as they show it, shape (n,).

    Each cluster continues the track that is predicted nearest to it, or begins one. The centre of a continued track is
    where a disc of its radius fits the hits best, so that a partly occluded obstacle does not seem to slow down. If the
    radius estimate changes, the centre is shifted along the line of sight, which is not motion.

    Args:
        scan: the latest, in S.
        pose: (x, y, yaw) of S in W when it was taken.
        parameters: max_speed, max_radius, caution.
        walls: shape (m, 2), points on static obstacles, W, m.
    """
    before = _predicted(tracks, scan.time)
    doubtful = beams.motion != STATIC
    runs = clusters(scan, doubtful, beams.may_start, parameters.max_radius)
    everything = np.ones(len(doubtful), bool)
    points = scan.points_at(scan.distances, everything, pose)
    discs = [first_disc(scan, run, points[run], pose[:2], parameters.max_radius) for run in runs]
    partner = partners(discs, before.position, _gates(before))
    owner = {cluster: k for k, cluster in partner.items()}
    spread = FIRST_SPEED_SHARE * parameters.max_speed
    rows: list[Track] = []
    owner_of_beam = np.full(len(doubtful), -1)
    for k in range(len(before)):
        absent = before.scans[k] <= CONFIRMED_AFTER or seen_past(scan, pose, before.position[k])
        if k not in partner and scan.time - before.seen[k] < (FORGOTTEN_NEW if absent else FORGOTTEN_AFTER):
            rows.append(Track._make(getattr(before, name)[k] for name in Track._fields))
    for c, run in enumerate(runs):
        owner_of_beam[run] = len(rows)
        if c in owner:
            share = float(np.mean(beams.came[run]))
            cluster = Cluster(points[run], float(scan.distances[run].min()), share, *discs[c])
            rows.append(_continued(tracks, before, owner[c], cluster, pose, parameters))
            continue
        x, y, radius, _ = discs[c]
        first = np.array((FIRST_SPREAD**2, 0.0, spread**2))
        still = np.zeros(2)
        rows.append(Track(np.array((x, y)), still, radius, first, 1, scan.time, 0.0, 0.0, scan.time, still, 0.0))
    after = Tracks(
        time=scan.time,
        origin=pose[:2].copy(),
        hits=points[doubtful],
        owner=owner_of_beam[doubtful],
        standing=points[beams.may_start & ~doubtful] if parameters.guarded else np.zeros((0, 2)),
        occlusions=occlusion_points(scan, pose) if parameters.guarded else np.zeros((0, 2)),
        **{name: np.array([row[i] for row in rows]) for i, name in enumerate(Track._fields) if rows},
    )
    ways = predicted_trajectories(after.position, after.expected_velocity, after.radius, walls)
    motion = beams.motion.copy()
    if rows:
        tracked = owner_of_beam >= 0
        motion[tracked & doubtful & after.confirmed[owner_of_beam]] = DYNAMIC
        motion[tracked & after.creeping[owner_of_beam]] = UNKNOWN  # an obstacle to plan around, and not to remember
    return dataclasses.replace(after, predicted_trajectories=ways), motion


class Cluster(NamedTuple):
    """A cluster of hits: where they are, the least range, the share of them that came, and the disc they show."""

    points: np.ndarray
    distance: float
    share: float
    x: float
    y: float
    radius: float
    whole: bool


def _continued(
    tracks: Tracks, before: Tracks, k: int, cluster: Cluster, pose: np.ndarray, parameters: DynamicObstacleParameters
) -> Track:
    """Track k once a cluster has shown it again; `before` are the tracks predicted for the time of the scan."""
    time, step = before.time, before.time - tracks.time
    if cluster.whole:
        kept = before.radius[k] + GAIN * (cluster.radius - before.radius[k])
    else:
        fitted = fitted_radius(cluster.points, before.position[k], before.radius[k], RADIUS_WEIGHT)
        kept = min(max(fitted, SMALLEST_RADIUS), parameters.max_radius)
    away = before.position[k] - pose[:2]
    shift = (kept - before.radius[k]) / max(math.hypot(*away), 1e-9) * away
    center = fitted_center(cluster.points, before.position[k] + shift, kept)
    noise = NOISE + NOISE_PER_RANGE * cluster.distance
    position, velocity, variance = _corrected(before, k, shift, center, noise, parameters.max_speed)
    gain = min(step / min(max(time - before.since[k], step), DRIFT_TIME), 1.0)
    went = position - tracks.position[k] - shift if cluster.whole else 0.0  # it may be a wall behind a gap
    turned = _turned(tracks.position[k], tracks.origin, pose[:2])
    return Track(
        position,
        velocity,
        kept,
        variance,
        scans=before.scans[k] + 1,
        seen=time,
        motion=before.motion[k] + GAIN * (cluster.share - before.motion[k]),
        pace=max(math.hypot(*velocity), before.pace[k] - PACE_DECAY * step),
        since=before.since[k],
        drift=before.drift[k] + gain * (went / step - before.drift[k]),
        swing=before.swing[k] + gain * (turned / step - before.swing[k]),
    )


def _turned(place: np.ndarray, before: np.ndarray, now: np.ndarray) -> float:
    """The angle by which the line of sight to a place (2,) turns as the lidar moves between positions (2,), rad."""
    (a, b), (c, d) = place - before, place - now
    return math.atan2(a * d - b * c, a * c + b * d)


def _predicted(tracks: Tracks, time: float) -> Tracks:
    if not len(tracks):
        return tracks
    dt = time - tracks.time
    p, c, v = tracks.variance.T
    variance = np.column_stack((p + 2.0 * dt * c + dt * dt * v, c + dt * v, v + AGILITY**2 * dt))
    return dataclasses.replace(tracks, time=time, position=tracks.at(time), variance=variance)


def _gates(tracks: Tracks) -> np.ndarray:
    """How far from the prediction of each track a cluster may continue it, shape (n,), m."""
    gates = GATE + GATE_SPEED * (tracks.time - tracks.seen)
    return np.minimum(gates + np.where(tracks.scans < CONFIRMED_AFTER, GATE_NEW, 0.0), GATE_WIDEST)


def _corrected(
    tracks: Tracks, k: int, shift: np.ndarray, center: np.ndarray, noise: float, max_speed: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position, velocity and variances of a predicted track, shifted, once its centre was measured; no faster than
    declared."""
    p, c, v = tracks.variance[k]
    total = p + noise * noise
    gain_p, gain_v = p / total, c / total
    predicted = tracks.position[k] + shift
    miss = center - predicted
    position, velocity = predicted + gain_p * miss, tracks.velocity[k] + gain_v * miss
    velocity *= min(1.0, max_speed / max(math.hypot(*velocity), 1e-9))
    return position, velocity, np.array(((1.0 - gain_p) * p, (1.0 - gain_p) * c, v - gain_v * c))
