"""Moving obstacles as discs: a Kalman filter of constant velocity for each cluster. Lengths are of persons: nature."""

import math
from dataclasses import field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from drake_starnav.lidar.laser_scan import DYNAMIC, STANDING, STATIC, UNKNOWN, LaserScan
from drake_starnav.moving.clusters import SMALLEST_RADIUS, estimate_discs, find_clusters, fit_center, fit_radius
from drake_starnav.moving.occupancy_history import BeamMotion
from drake_starnav.moving.parameters import DynamicObstacleParameters
from drake_starnav.moving.prediction import add_radius, find_occlusion_points
from drake_starnav.utils.snapshot import replace_fields, snapshot

AGILITY = 0.7
"""Random change of velocity that is expected, per root of time, m/s/sqrt(s)."""
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


class Rows(NamedTuple):
    """The attributes of `Tracks` that have a row for each track."""

    position: np.ndarray
    velocity: np.ndarray
    radius: np.ndarray
    variance: np.ndarray
    scan_count: np.ndarray
    last_seen: np.ndarray
    moving_share: np.ndarray
    recent_top_speed: np.ndarray
    first_seen: np.ndarray
    mean_velocity: np.ndarray
    aspect_rate: np.ndarray

    def select(self, indices: np.ndarray) -> "Rows":
        """Return copies of some rows, by their indices (k,)."""
        return Rows(*(column[indices] for column in self))


class Clusters(NamedTuple):
    """Clusters of hits, each with the disc that it shows by itself.

    Attributes:
        beams, points: of each the indices of its beams, shape (k,), and its hits, shape (k, 2), W, m.
        moving_share: share of its beams that hit what was free before, shape (c,).
        center, radius: of the disc, shape (c, 2) and (c,), W, m.
        distance: the least range, shape (c,), m.
        is_whole: whether both sides of the disc are in view, shape (c,), bool.
    """

    beams: list[np.ndarray]
    points: list[np.ndarray]
    moving_share: np.ndarray
    center: np.ndarray
    radius: np.ndarray
    distance: np.ndarray
    is_whole: np.ndarray

    @staticmethod
    def of(
        scan: LaserScan, beam_motion: BeamMotion, points: np.ndarray, sensor_position: np.ndarray, max_radius: float
    ) -> "Clusters":
        """Return those of a scan that was taken at a place (2,), whose beams end at points (n, 2), W, m."""
        runs = find_clusters(scan, beam_motion.motion != STATIC, beam_motion.may_start, max_radius)
        beams = [(first_beam + np.arange(beam_count)) % len(points) for first_beam, beam_count in runs.tolist()]
        moving_share = np.array([beam_motion.newly_occupied[each].mean() for each in beams])
        discs = estimate_discs(scan.beams, runs, points, np.array(sensor_position), max_radius)
        return Clusters(beams, [points[each] for each in beams], moving_share, *discs)

    def select(self, indices: np.ndarray) -> "Clusters":
        """Return some of them, by their indices (k,)."""
        beams, points = [self.beams[c] for c in indices], [self.points[c] for c in indices]
        return Clusters(beams, points, *(column[indices] for column in self[2:]))


def update_tracks(
    tracks: Tracks, scan: LaserScan, beam_motion: BeamMotion, pose: np.ndarray, parameters: DynamicObstacleParameters
) -> tuple[Tracks, np.ndarray]:
    """The tracks after one more scan, and the motion state of each beam as they show it, shape (n,).

    Args:
        tracks: after the scan before.
        scan: the latest, in S.
        beam_motion: of its beams.
        pose: (x, y, yaw) of S in W when it was taken.
        parameters: max_speed, max_radius, caution.
    """
    points = scan.points_at(scan.distances, np.ones(len(scan.ranges), bool), pose)
    clusters = Clusters.of(scan, beam_motion, points, pose[:2], parameters.max_radius)
    rows, hit_track = update_rows(tracks, clusters, scan, pose, parameters), np.full(len(points), -1)
    for track, beams in enumerate(clusters.beams, len(rows.radius) - len(clusters.beams)):
        hit_track[beams] = track
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
    return next_tracks, report_motion(next_tracks, hit_track, beam_motion)


def report_motion(tracks: Tracks, hit_track: np.ndarray, beam_motion: BeamMotion) -> np.ndarray:
    """Return the motion state of each beam, shape (n,), by the track that it belongs to, (n,), -1 for none."""
    motion = beam_motion.motion
    reported_motion = np.where(beam_motion.may_start & (motion == STATIC), STANDING, motion)
    if len(tracks):
        has_track = hit_track >= 0
        reported_motion[has_track & (motion != STATIC) & tracks.is_confirmed[hit_track]] = DYNAMIC
        creeps = has_track & tracks.is_creeping[hit_track]
        reported_motion[creeps] = UNKNOWN  # an obstacle to plan around, and not to remember
    return reported_motion


def update_rows(
    tracks: Tracks, clusters: Clusters, scan: LaserScan, pose: np.ndarray, parameters: DynamicObstacleParameters
) -> Rows:
    """Return the rows of tracks that are remembered, though the scan does not show them, then one for each cluster.

    A cluster continues the track that is predicted nearest to it, or begins one. Arguments as of `update_tracks`.
    """
    predicted_rows = predict_rows(Rows(*(getattr(tracks, name) for name in Rows._fields)), scan.time - tracks.time)
    gates = compute_association_gates(predicted_rows, scan.time)
    matched_tracks = match_tracks(clusters.center, predicted_rows.position, gates)
    continued_clusters = np.flatnonzero(matched_tracks >= 0)
    continued_tracks = matched_tracks[continued_clusters]
    rows = begin_rows(clusters, scan.time, parameters.max_speed)
    continued_rows = continue_rows(
        predicted_rows.select(continued_tracks),
        clusters.select(continued_clusters),
        tracks,
        tracks.position[continued_tracks],
        scan.time,
        pose[:2],
        parameters,
    )
    for column, continued_column in zip(rows, continued_rows, strict=True):
        column[continued_clusters] = continued_column
    remembered_rows = predicted_rows.select(find_remembered_tracks(predicted_rows, matched_tracks, scan, pose))
    return Rows(*map(np.concatenate, zip(remembered_rows, rows, strict=True)))


def predict_rows(rows: Rows, duration: float) -> Rows:
    """Return the rows after a time, s."""
    p, c, v = rows.variance.T
    variance = (p + 2.0 * duration * c + duration * duration * v, c + duration * v, v + AGILITY**2 * duration)
    return rows._replace(position=rows.position + rows.velocity * duration, variance=np.column_stack(variance))


def compute_association_gates(rows: Rows, time: float) -> np.ndarray:
    """Return how far from the prediction of each track a cluster may continue it, shape (n,), m."""
    gates = GATE + GATE_SPEED * (time - rows.last_seen)
    return np.minimum(gates + np.where(rows.scan_count < CONFIRMED_AFTER, GATE_NEW, 0.0), GATE_WIDEST)


def match_tracks(centers: np.ndarray, predicted_places: np.ndarray, gates: np.ndarray) -> np.ndarray:
    """Return the track that each cluster continues, the nearest pairs first, shape (c,); -1 for none.

    No track, predicted at a place of (n, 2), continues with a cluster of centres (c, 2) that is beyond its gate; W, m.
    """
    offsets = centers[:, None] - predicted_places
    distances, matched_tracks = np.hypot(offsets[..., 0], offsets[..., 1]), np.full(len(centers), -1)
    near_clusters, near_tracks = np.nonzero(distances < gates)
    for pair in np.argsort(distances[near_clusters, near_tracks], kind="stable"):
        c, k = near_clusters[pair], near_tracks[pair]
        if matched_tracks[c] < 0 and k not in matched_tracks:
            matched_tracks[c] = k
    return matched_tracks


def find_remembered_tracks(rows: Rows, matched_tracks: np.ndarray, scan: LaserScan, pose: np.ndarray) -> np.ndarray:
    """Return the indices of the predicted rows that no cluster continues, but that are kept for a while.

    That is shorter if the scan, at a pose of S in W, does not look at their places, or sees past them.
    """
    distance, beam = scan.polar(rows.position, pose)
    nearest_beam = (beam + 0.5).astype(int)
    if scan.full_circle:
        nearest_beam %= len(scan.ranges)
    in_view = nearest_beam < len(scan.ranges)
    is_absent = ~in_view | (scan.distances[np.where(in_view, nearest_beam, 0)] > distance)
    is_absent |= rows.scan_count <= CONFIRMED_AFTER
    is_remembered = scan.time - rows.last_seen < np.where(is_absent, FORGOTTEN_NEW, FORGOTTEN_AFTER)
    is_remembered[matched_tracks[matched_tracks >= 0]] = False
    return np.flatnonzero(is_remembered)


def begin_rows(clusters: Clusters, time: float, max_speed: float) -> Rows:
    """Return the rows of tracks that begin with clusters, at a time, s, of obstacles no faster than `max_speed`."""
    zeros, zero_vectors = np.zeros(len(clusters.radius)), np.zeros_like(clusters.center)
    variance = np.column_stack((zeros + FIRST_SPREAD**2, zeros, zeros + (FIRST_SPEED_SHARE * max_speed) ** 2))
    return Rows(
        position=clusters.center.copy(),
        velocity=zero_vectors,
        radius=clusters.radius.copy(),
        variance=variance,
        scan_count=np.ones(len(zeros), np.int64),
        last_seen=zeros + time,
        moving_share=zeros.copy(),
        recent_top_speed=zeros.copy(),
        first_seen=zeros + time,
        mean_velocity=zero_vectors.copy(),
        aspect_rate=zeros,
    )


class DiscFit(NamedTuple):
    """Discs of n tracks, fitted to hits: centre (n, 2), radius (n,), and by how much the centres are shifted along the
    line of sight as the radius changes, which is not motion, (n, 2); m."""

    center: np.ndarray
    radius: np.ndarray
    shift: np.ndarray


def fit_discs(rows: Rows, clusters: Clusters, sensor_position: np.ndarray, max_radius: float) -> DiscFit:
    """Fit the discs of predicted tracks to the hits of n clusters that continue them, seen from a place (2,), W, m.

    The centre is where a disc of the track's radius fits best, so that a partly occluded obstacle does not seem to slow
    down.
    """
    radius = rows.radius + GAIN * (clusters.radius - rows.radius)
    for k in np.flatnonzero(~clusters.is_whole):
        fitted_radius = fit_radius(clusters.points[k], rows.position[k], rows.radius[k], RADIUS_WEIGHT)
        radius[k] = min(max(fitted_radius, SMALLEST_RADIUS), max_radius)
    sight_line = rows.position - sensor_position
    shift = ((radius - rows.radius) / np.maximum(np.hypot(*sight_line.T), 1e-9))[:, None] * sight_line
    center = [fit_center(*each) for each in zip(clusters.points, rows.position + shift, radius, strict=True)]
    return DiscFit(np.reshape(center, (-1, 2)), radius, shift)


def correct_motion(rows: Rows, fit: DiscFit, distance: np.ndarray, max_speed: float) -> Rows:
    """Return rows with position, velocity and variance of a Kalman filter that measures discs at distances (n,), m."""
    noise = NOISE + NOISE_PER_RANGE * distance
    p, p_v, v = rows.variance.T
    gain_p, gain_v = p / (p + noise * noise), p_v / (p + noise * noise)
    predicted_position = rows.position + fit.shift
    innovation = fit.center - predicted_position
    velocity = rows.velocity + gain_v[:, None] * innovation
    velocity *= np.minimum(1.0, max_speed / np.maximum(np.hypot(*velocity.T), 1e-9))[:, None]
    variance = np.column_stack(((1.0 - gain_p) * p, (1.0 - gain_p) * p_v, v - gain_v * p_v))
    return rows._replace(
        position=predicted_position + gain_p[:, None] * innovation, velocity=velocity, variance=variance
    )


def continue_rows(
    rows: Rows,
    clusters: Clusters,
    last_tracks: Tracks,
    last_position: np.ndarray,
    time: float,
    sensor_position: np.ndarray,
    parameters: DynamicObstacleParameters,
) -> Rows:
    """Return the predicted rows of n tracks, corrected by the n clusters that continue them.

    The scan was taken at a time, s, from a place (2,). Of `last_tracks`, these were at places (n, 2); W, m.
    """
    duration = time - last_tracks.time
    fit = fit_discs(rows, clusters, sensor_position, parameters.max_radius)
    corrected_rows = correct_motion(rows, fit, clusters.distance, parameters.max_speed)
    drift_gain = np.minimum(duration / np.minimum(np.maximum(time - rows.first_seen, duration), DRIFT_TIME), 1.0)
    displacement = corrected_rows.position - last_position - fit.shift
    displacement[~clusters.is_whole] = 0.0  # it may be a wall behind a gap
    turning_rates = _measure_turns_of_sight(last_position, last_tracks.origin, sensor_position) / duration
    return corrected_rows._replace(
        radius=fit.radius,
        scan_count=rows.scan_count + 1,
        last_seen=np.full_like(rows.last_seen, time),
        moving_share=rows.moving_share + GAIN * (clusters.moving_share - rows.moving_share),
        recent_top_speed=np.maximum(
            np.hypot(*corrected_rows.velocity.T), rows.recent_top_speed - PACE_DECAY * duration
        ),
        mean_velocity=rows.mean_velocity + drift_gain[:, None] * (displacement / duration - rows.mean_velocity),
        aspect_rate=rows.aspect_rate + drift_gain * (turning_rates - rows.aspect_rate),
    )


def _measure_turns_of_sight(targets: np.ndarray, previous_sensor: np.ndarray, sensor: np.ndarray) -> np.ndarray:
    """Return the angles by which the lines of sight to places (n, 2) turn as the lidar moves, shape (n,), rad."""
    (a, b), (c, d) = (targets - previous_sensor).T, (targets - sensor).T
    return np.array([math.atan2(*sides) for sides in zip(a * d - b * c, a * c + b * d, strict=True)])
