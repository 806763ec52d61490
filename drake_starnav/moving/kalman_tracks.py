"""Moving obstacles as discs: a Kalman filter of constant velocity for each cluster. Lengths are of persons: nature."""

import math
from dataclasses import field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.lidar.laser_scan import DYNAMIC, STANDING, STATIC, UNKNOWN, LaserScan, place_ends
from drake_starnav.moving.clusters import (
    SMALLEST_RADIUS,
    estimate_disc,
    find_clusters,
    find_least_distance,
    fit_center,
    fit_radius,
    match_tracks,
)
from drake_starnav.moving.occupancy_history import BeamMotion
from drake_starnav.moving.parameters import DynamicObstacleParameters
from drake_starnav.moving.prediction import (
    Rows,
    add_radius,
    find_occlusion_points,
    is_seen_past,
    predict_rows,
    select_rows,
)
from drake_starnav.utils.snapshot import replace_fields, snapshot

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
        scan_count: shape (n,), how many scans have seen each.
        last_seen: shape (n,), when it was seen last, s.
        moving_share: shape (n,), share of its beams that hit what was free before, smoothed.
        recent_top_speed: shape (n,), its greatest speed of late, m/s: who turns back seems to stand for a moment.
        first_seen: shape (n,), when it was seen first, s.
        mean_velocity: shape (n, 2), its mean velocity of late, m/s: less noisy than `velocity`, and late.
        aspect_rate: shape (n,), mean rate at which the lidar's own motion shows it from another side, rad/s.
        origin: shape (2,), where the lidar was, W, m.
        hits: shape (k, 3), the hits of the last scan that are not certainly static: x, y, and the radius within which
            what was there may be by now.
        possible_starters: shape (l, 3), static hits on objects that might start to move; none unless `guarded`.
        hit_track: shape (k,), the track that each hit belongs to; -1 for none.
        predicted_trajectories: shape (n, k, 2), where each is predicted to be, now and every `PREDICTION_STEP` from now
            on.
        occlusion_discs: shape (m, 3), places at the edges of occluded areas, from which something may come; none unless
            `guarded`.
    """

    time: float = -math.inf
    position: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    velocity: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    radius: np.ndarray = field(default_factory=lambda: np.zeros(0))
    variance: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    scan_count: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    last_seen: np.ndarray = field(default_factory=lambda: np.zeros(0))
    moving_share: np.ndarray = field(default_factory=lambda: np.zeros(0))
    recent_top_speed: np.ndarray = field(default_factory=lambda: np.zeros(0))
    first_seen: np.ndarray = field(default_factory=lambda: np.zeros(0))
    mean_velocity: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    aspect_rate: np.ndarray = field(default_factory=lambda: np.zeros(0))
    origin: np.ndarray = field(default_factory=lambda: np.zeros(2))
    hits: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    hit_track: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    possible_starters: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    predicted_trajectories: np.ndarray = field(default_factory=lambda: np.zeros((0, 1, 2)))
    occlusion_discs: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))

    def __len__(self) -> int:
        return len(self.radius)

    @cached_property
    def is_confirmed(self) -> np.ndarray:
        """Which tracks are trusted to be moving obstacles, shape (n,), bool."""
        return (
            (self.scan_count >= CONFIRMED_AFTER)
            & (self.recent_top_speed > CONFIRMED_SPEED)
            & (self.moving_share > CONFIRMED_MOTION)
        )

    @cached_property
    def is_settled(self) -> np.ndarray:
        """Which tracks are old enough for their speeds to be known, shape (n,), bool."""
        return self.scan_count >= SETTLED_AFTER

    @cached_property
    def is_creeping(self) -> np.ndarray:
        """Which tracks move too slowly to be told from what stands by single hits, shape (n,), bool."""
        age = self.time - self.first_seen
        noise = NOISE + NOISE_PER_RANGE * np.hypot(*(self.position - self.origin).T)
        least_speed = CREEPING_SPEED + CREEPING_NOISE * noise / np.clip(age, 1e-9, DRIFT_TIME)
        least_speed += np.where(self.moving_share > CREEPING_MOTION, 0.0, CREEPING_SWING * np.abs(self.aspect_rate))
        return ~self.is_confirmed & (age >= CREEPING_AFTER) & (np.hypot(*self.mean_velocity.T) > least_speed)

    @cached_property
    def is_predicted(self) -> np.ndarray:
        """Which tracks are avoided at their predicted positions, shape (n,), bool."""
        return self.is_confirmed | self.is_creeping

    @cached_property
    def is_trusted(self) -> np.ndarray:
        """Which tracks move as they are known to, shape (n,), bool."""
        return self.is_confirmed & self.is_settled

    @cached_property
    def emergence_discs(self) -> tuple[np.ndarray, np.ndarray]:
        """Places from which something may come, shape (k, 3), as `hits`, and the track of each, (k,); -1 for none.

        Beside those listed that of each trusted track that is not in view, a disc at its predicted position.
        """
        lost_tracks = np.flatnonzero(self.is_trusted & (self.last_seen < self.time))
        standing_discs = (self.possible_starters, self.occlusion_discs)
        discs = np.column_stack((self.position, self.radius))[lost_tracks]
        hit_track = np.concatenate((self.hit_track, np.full(sum(map(len, standing_discs)), -1), lost_tracks))
        return np.vstack((self.hits, *standing_discs, discs)), hit_track

    @cached_property
    def expected_velocity(self) -> np.ndarray:
        """The velocities by which the tracks are predicted, shape (n, 2), m/s."""
        return np.where(self.is_confirmed[:, None], self.velocity, self.mean_velocity)


def update_tracks(
    tracks: Tracks, scan: LaserScan, beam_motion: BeamMotion, pose: np.ndarray, parameters: DynamicObstacleParameters
) -> tuple[Tracks, np.ndarray]:
    """The tracks after one more scan, and the motion state of each beam as they show it, shape (n,).

    Each cluster continues the track that is predicted nearest to it, or begins one. The centre of a continued track is
    where a disc of its radius fits the hits best, so that a partly occluded obstacle does not seem to slow down. If the
    radius estimate changes, the centre is shifted along the line of sight, which is not motion.

    Args:
        scan: the latest, in S.
        beam_motion: of its beams.
        pose: (x, y, yaw) of S in W when it was taken.
        parameters: max_speed, max_radius, caution.
    """
    rows, points, hit_track = _update_rows(
        Rows._make([getattr(tracks, name) for name in Rows._fields]),
        (tracks.time, tracks.origin),
        scan.beams,
        beam_motion,
        (float(pose[0]), float(pose[1]), float(pose[2])),
        (scan.time, scan.angle_min),
        (parameters.max_speed, parameters.max_radius),
    )
    is_doubtful = beam_motion.motion != STATIC
    next_tracks = Tracks(
        time=scan.time,
        origin=pose[:2].copy(),
        hits=add_radius(points[is_doubtful], 0.0),
        hit_track=hit_track[is_doubtful],
        **rows._asdict(),
    )
    if parameters.guarded:
        possible_starters = add_radius(points[beam_motion.may_start & ~is_doubtful], 0.0)
        next_tracks = replace_fields(
            next_tracks, possible_starters=possible_starters, occlusion_discs=find_occlusion_points(scan, pose)
        )
    reported_motion = np.where(beam_motion.may_start & (beam_motion.motion == STATIC), STANDING, beam_motion.motion)
    if len(next_tracks):
        has_track = hit_track >= 0
        reported_motion[has_track & is_doubtful & next_tracks.is_confirmed[hit_track]] = DYNAMIC
        creeps = has_track & next_tracks.is_creeping[hit_track]
        reported_motion[creeps] = UNKNOWN  # an obstacle to plan around, and not to remember
    return next_tracks, reported_motion


@kernel
def _update_rows(tracks, last_scan, beams, beam_motion, pose, scan_start, limits):
    """The loop of `update_tracks`: the tracks' `Rows`, where each beam ends, and the track that it belongs to, or -1.

    Args:
        tracks: their `Rows`.
        last_scan: time of the last scan, s, and where it was taken.
        beams, beam_motion: `Beams` of the scan, and what they hit.
        pose: (x, y, yaw) of the scan.
        scan_start: its time, s, and its first bearing, rad.
        limits: max_speed and max_radius.
    """
    (x, y, yaw), (time, angle_min), (max_speed, max_radius) = pose, scan_start, limits
    sensor_position = np.array(pose[:2])
    n, track_count = len(beam_motion.motion), len(tracks.radius)
    points = place_ends(beams.directions, beams.distances, np.ones(n, np.bool_), x, y, math.cos(yaw), math.sin(yaw))
    clusters_found = find_clusters(beams, beam_motion.motion != STATIC, beam_motion.may_start, max_radius)
    cluster_discs, is_whole = np.empty((len(clusters_found), 3)), np.empty(len(clusters_found), np.bool_)
    for c in range(len(clusters_found)):
        cluster_discs[c, 0], cluster_discs[c, 1], cluster_discs[c, 2], is_whole[c] = estimate_disc(
            beams, clusters_found[c], points, sensor_position, max_radius
        )
    predicted_rows = predict_rows(tracks, time - last_scan[0])
    matched_track = match_tracks(
        cluster_discs, predicted_rows.position, _compute_association_gates(predicted_rows, time)
    )
    is_remembered = np.ones(track_count, np.bool_)
    is_remembered[matched_track[matched_track >= 0]] = False
    for k in range(track_count):
        is_absent = predicted_rows.scan_count[k] <= CONFIRMED_AFTER
        is_absent = is_absent or is_seen_past(beams, (x, y, yaw + angle_min), predicted_rows.position[k])
        is_remembered[k] &= time - predicted_rows.last_seen[k] < (FORGOTTEN_NEW if is_absent else FORGOTTEN_AFTER)
    remembered_rows = np.flatnonzero(is_remembered)  # though this scan does not show them
    rows, hit_track = select_rows(predicted_rows, np.concatenate((remembered_rows, matched_track))), np.full(n, -1)
    for c in range(len(clusters_found)):
        row, k, (first_beam, beam_count) = len(remembered_rows) + c, matched_track[c], clusters_found[c]
        beams_of_cluster = (first_beam + np.arange(beam_count)) % n
        hit_track[beams_of_cluster] = row
        if k < 0:
            rows.position[row], rows.radius[row], rows.scan_count[row] = cluster_discs[c, :2], cluster_discs[c, 2], 1
            rows.last_seen[row], rows.first_seen[row] = time, time
            rows.variance[row, 0], rows.variance[row, 2] = FIRST_SPREAD**2, (FIRST_SPEED_SHARE * max_speed) ** 2
            continue
        cluster = Cluster(
            points[beams_of_cluster],
            find_least_distance(beams.distances, clusters_found[c]),
            cluster_discs[c, 2],
            is_whole[c],
        )
        _correct_row(
            rows, row, tracks.position[k], cluster, (last_scan[1], sensor_position), (time, time - last_scan[0]), limits
        )
        rows.moving_share[row] += GAIN * (
            np.mean(beam_motion.newly_occupied[beams_of_cluster]) - rows.moving_share[row]
        )
    return rows, points, hit_track


class Cluster(NamedTuple):
    """A cluster of hits: where they are, the least range, the radius of the disc that they show, and if all of it."""

    points: np.ndarray
    distance: float
    radius: float
    is_whole: bool


@kernel
def _correct_row(rows, k, last_position, cluster, sensor_positions, scan_times, limits):
    """Correct the predicted row of a track that a cluster continues.

    Args:
        rows, k: number k of them.
        last_position: where the track was at the last scan.
        cluster: of this scan.
        sensor_positions: where the lidar was then, and is.
        scan_times: now, and since the last scan, s.
        limits: max_speed and max_radius.
    """
    previous_sensor, sensor_position = sensor_positions
    time, step = scan_times
    radius = rows.radius[k]
    position = rows.position[k]
    if cluster.is_whole:
        next_radius = radius + GAIN * (cluster.radius - radius)
    else:
        next_radius = min(max(fit_radius(cluster.points, position, radius, RADIUS_WEIGHT), SMALLEST_RADIUS), limits[1])
    sight_line = position - sensor_position
    shift = (next_radius - radius) / max(math.hypot(sight_line[0], sight_line[1]), 1e-9) * sight_line
    predicted_position = position + shift
    noise = NOISE + NOISE_PER_RANGE * cluster.distance
    p, p_v, v = rows.variance[k]
    gain_p, gain_v = p / (p + noise * noise), p_v / (p + noise * noise)
    innovation = fit_center(cluster.points, predicted_position, next_radius) - predicted_position
    position, velocity = predicted_position + gain_p * innovation, rows.velocity[k] + gain_v * innovation
    velocity *= min(1.0, limits[0] / max(math.hypot(velocity[0], velocity[1]), 1e-9))
    gain = min(step / min(max(time - rows.first_seen[k], step), DRIFT_TIME), 1.0)
    for i in range(2):
        displacement = (
            position[i] - last_position[i] - shift[i] if cluster.is_whole else 0.0
        )  # it may be a wall behind a gap
        rows.mean_velocity[k, i] += gain * (displacement / step - rows.mean_velocity[k, i])
        rows.position[k, i], rows.velocity[k, i] = position[i], velocity[i]
    rows.aspect_rate[k] += gain * (
        _measure_turn_of_sight(last_position, previous_sensor, sensor_position) / step - rows.aspect_rate[k]
    )
    rows.variance[k, 0], rows.variance[k, 1] = (1.0 - gain_p) * p, (1.0 - gain_p) * p_v
    rows.variance[k, 2] = v - gain_v * p_v
    rows.recent_top_speed[k] = max(math.hypot(velocity[0], velocity[1]), rows.recent_top_speed[k] - PACE_DECAY * step)
    rows.radius[k], rows.last_seen[k] = next_radius, time
    rows.scan_count[k] += 1


@kernel
def _measure_turn_of_sight(target, previous_sensor, sensor):
    """The angle by which the line of sight to a place (2,) turns as the lidar moves between positions (2,), rad."""
    a = target[0] - previous_sensor[0]
    b = target[1] - previous_sensor[1]
    c = target[0] - sensor[0]
    d = target[1] - sensor[1]
    return math.atan2(a * d - b * c, a * c + b * d)


@kernel
def _compute_association_gates(rows, time):
    """How far from the prediction of each track a cluster may continue it, shape (n,), m."""
    gates = GATE + GATE_SPEED * (time - rows.last_seen)
    return np.minimum(gates + np.where(rows.scan_count < CONFIRMED_AFTER, GATE_NEW, 0.0), GATE_WIDEST)
