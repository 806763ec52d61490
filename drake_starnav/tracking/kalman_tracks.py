"""Moving obstacles as discs with velocities: a Kalman filter of constant velocity for each cluster of hits."""

import dataclasses
import math
from dataclasses import field

import numpy as np

from drake_starnav.lidar.laser_scan import DYNAMIC, STATIC, LaserScan
from drake_starnav.tracking.clusters import SMALLEST_RADIUS, clusters, first_disc, fitted_center, fitted_radius
from drake_starnav.tracking.occlusions import occlusion_points
from drake_starnav.tracking.parameters import DynamicObstacleParameters
from drake_starnav.tracking.prediction import predicted_trajectories
from drake_starnav.utils.snapshot import snapshot

RADIUS_GAIN = 0.2
MOTION_GAIN = 0.2
"""Shares by which a track's radius, and its share of moving beams, follow the latest cluster."""
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
    hits: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    owner: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    standing: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    predicted_trajectories: np.ndarray = field(default_factory=lambda: np.zeros((0, 1, 2)))
    occlusions: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))

    def __len__(self) -> int:
        return len(self.radius)

    @property
    def confirmed(self) -> np.ndarray:
        """Which tracks are trusted to be moving obstacles, shape (n,), bool."""
        return (self.scans >= CONFIRMED_AFTER) & (self.pace > CONFIRMED_SPEED) & (self.motion > CONFIRMED_MOTION)

    @property
    def settled(self) -> np.ndarray:
        """Which tracks are old enough for their speeds to be known, shape (n,), bool."""
        return self.scans >= SETTLED_AFTER

    def at(self, time: float) -> np.ndarray:
        """Where the centres will be at a time (s) if none of them changes its velocity, shape (n, 2)."""
        return self.position + self.velocity * (time - self.time)


def updated(
    tracks: Tracks,
    scan: LaserScan,
    motion: np.ndarray,
    may_start: np.ndarray,
    pose: np.ndarray,
    parameters: DynamicObstacleParameters,
    walls: np.ndarray,
) -> Tracks:
    """The tracks after one more scan.

    Each cluster continues the track that is predicted nearest to it, or begins one. The centre of a continued track is
    where a disc of its radius fits the hits best, so that a partly occluded obstacle does not seem to slow down. If the
    radius estimate changes, the centre is shifted along the line of sight, which is not motion.

    Args:
        tracks: before.
        scan: the latest, in S.
        motion, may_start: shape (n,), as from `OccupancyHistory`.
        pose: (x, y, yaw) of S in W when it was taken.
        parameters: max_speed, max_radius, caution.
        walls: shape (m, 2), points on static obstacles, W, m.
    """
    before = _predicted(tracks, scan.time)
    runs = clusters(scan, motion, parameters)
    everything = np.ones(len(motion), bool)
    points = scan.points_at(scan.distances, everything, pose)
    first = [first_disc(scan, run, points[run], pose[:2], parameters.max_radius) for run in runs]
    partner = _partners(first, before)
    spread = FIRST_SPEED_SHARE * parameters.max_speed
    rows, owner_of_beam = [], np.full(len(motion), -1)
    for k in range(len(before)):
        absent = before.scans[k] <= CONFIRMED_AFTER or _seen_past(scan, pose, before.position[k])
        if k not in partner and scan.time - before.seen[k] < (FORGOTTEN_NEW if absent else FORGOTTEN_AFTER):
            rows.append(_row(before, k))
    for c, run in enumerate(runs):
        x, y, seen_radius, whole = first[c]
        share = float(np.mean(motion[run] == DYNAMIC))
        owner_of_beam[run] = len(rows)
        k = next((k for k, cluster in partner.items() if cluster == c), -1)
        if k < 0:
            rows.append((x, y, 0.0, 0.0, seen_radius, FIRST_SPREAD**2, 0.0, spread**2, 1, scan.time, 0.0, 0.0))
            continue
        if whole:
            kept = before.radius[k] + RADIUS_GAIN * (seen_radius - before.radius[k])
        else:
            fitted = fitted_radius(points[run], before.position[k], before.radius[k], RADIUS_WEIGHT)
            kept = min(max(fitted, SMALLEST_RADIUS), parameters.max_radius)
        away = before.position[k] - pose[:2]
        before.position[k] += (kept - before.radius[k]) / max(math.hypot(*away), 1e-9) * away
        center = fitted_center(points[run], before.position[k], kept)
        noise = NOISE + NOISE_PER_RANGE * float(scan.distances[run].min())
        state, variance = _corrected(before, k, center, noise, parameters.max_speed)
        smoothed = before.motion[k] + MOTION_GAIN * (share - before.motion[k])
        pace = max(math.hypot(state[2], state[3]), before.pace[k] - PACE_DECAY * (scan.time - tracks.time))
        rows.append((*state, kept, *variance, before.scans[k] + 1, scan.time, smoothed, pace))
    table = np.array(rows, dtype=float).reshape(-1, 12)
    doubtful = motion != STATIC
    position, velocity, radius = table[:, 0:2].copy(), table[:, 2:4].copy(), table[:, 4].copy()
    return Tracks(
        time=scan.time,
        position=position,
        velocity=velocity,
        radius=radius,
        variance=table[:, 5:8].copy(),
        scans=table[:, 8].astype(np.int64),
        seen=table[:, 9].copy(),
        motion=table[:, 10].copy(),
        pace=table[:, 11].copy(),
        hits=points[doubtful],
        owner=owner_of_beam[doubtful],
        standing=points[may_start & ~doubtful],
        predicted_trajectories=predicted_trajectories(position, velocity, radius, walls),
        occlusions=occlusion_points(scan, pose) if parameters.guarded else np.zeros((0, 2)),
    )


def _seen_past(scan: LaserScan, pose: np.ndarray, place: np.ndarray) -> bool:
    """Whether the beam nearest to a place (2,) in W ended behind it, or the scan did not look there."""
    dx, dy = place - pose[:2]
    beam = ((math.atan2(dy, dx) - pose[2] - scan.angle_min) % (2.0 * math.pi)) / scan.angle_increment
    k = int(beam + 0.5) % len(scan.ranges) if scan.full_circle else int(beam + 0.5)
    return k >= len(scan.ranges) or bool(scan.distances[k] > math.hypot(dx, dy))


def _row(tracks: Tracks, k: int) -> tuple[float, ...]:
    return (
        *tracks.position[k],
        *tracks.velocity[k],
        tracks.radius[k],
        *tracks.variance[k],
        tracks.scans[k],
        tracks.seen[k],
        tracks.motion[k],
        tracks.pace[k],
    )


def _predicted(tracks: Tracks, time: float) -> Tracks:
    """The tracks at the time of the next scan."""
    if not len(tracks):
        return tracks
    dt = time - tracks.time
    p, c, v = tracks.variance.T
    variance = np.column_stack((p + 2.0 * dt * c + dt * dt * v, c + dt * v, v + AGILITY**2 * dt))
    return dataclasses.replace(tracks, time=time, position=tracks.at(time), variance=variance)


def _partners(discs: list[tuple[float, float, float, bool]], tracks: Tracks) -> dict[int, int]:
    """Track -> cluster, the nearest pairs first."""
    pairs = []
    for c, (x, y, _, _) in enumerate(discs):
        for k in range(len(tracks)):
            apart = math.hypot(x - tracks.position[k, 0], y - tracks.position[k, 1])
            gate = GATE + GATE_SPEED * (tracks.time - tracks.seen[k])
            if apart < min(gate + (GATE_NEW if tracks.scans[k] < CONFIRMED_AFTER else 0.0), GATE_WIDEST):
                pairs.append((apart, c, k))
    partner: dict[int, int] = {}
    taken: set[int] = set()
    for _, c, k in sorted(pairs):
        if c not in taken and k not in partner:
            partner[k] = c
            taken.add(c)
    return partner


def _corrected(
    tracks: Tracks, k: int, center: np.ndarray, noise: float, max_speed: float
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """State (x, y, vx, vy) and variances of a predicted track once its centre was measured; no faster than declared."""
    p, c, v = tracks.variance[k]
    total = p + noise * noise
    gain_p, gain_v = p / total, c / total
    miss = center - tracks.position[k]
    position, velocity = tracks.position[k] + gain_p * miss, tracks.velocity[k] + gain_v * miss
    velocity *= min(1.0, max_speed / max(math.hypot(*velocity), 1e-9))
    return (*position, *velocity), ((1.0 - gain_p) * p, (1.0 - gain_p) * c, v - gain_v * c)
