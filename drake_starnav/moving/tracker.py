"""From one scan to the next: static obstacles, moving ones, and their motion."""

import dataclasses
from collections.abc import Sequence
from dataclasses import field
from typing import NamedTuple

import numpy as np

from drake_starnav.lidar.deskew import deskew_scan
from drake_starnav.lidar.laser_scan import DYNAMIC, STATIC, LaserScan
from drake_starnav.moving.kalman_tracks import Rows, Tracks, update_tracks
from drake_starnav.moving.occupancy_history import OccupancyHistory
from drake_starnav.moving.parameters import DynamicObstacleParameters
from drake_starnav.moving.prediction import (
    PREDICTED_TIME,
    add_radius,
    find_view_edges,
    is_seen_free,
    predict_trajectories,
)
from drake_starnav.moving.surfaces import find_large_surfaces
from drake_starnav.utils.snapshot import replace_fields, snapshot

_BLIND = LaserScan(0.0, -1.0, 1.0, 0.0, 1.0, np.full(3, np.nan), lost_beams=True)
"""A scan of lost beams only, which carries no information."""
LISTS = ("hits", "hit_track", "possible_starters", "predicted_trajectories", "occlusion_discs")
"""What `Tracks` hold beside `Rows`."""


class TrackedObstacles(NamedTuple):
    """The moving obstacles as of the last scan.

    Attributes:
        tracks: of the last scan.
        age: time since that scan, s.
        parameters: what is declared about moving obstacles.
    """

    tracks: Tracks
    age: float
    parameters: DynamicObstacleParameters


@snapshot
class TrackerState:
    """The tracker's state after a scan. Immutable.

    Attributes:
        grid: when the cells around the robot were hit and seen free; None before the first scan.
        tracks: the moving obstacles.
        scan: the latest, de-skewed, with the motion of each hit.
        pose: (x, y, yaw) of S in W at that scan.
    """

    grid: OccupancyHistory | None = None
    tracks: Tracks = field(default_factory=Tracks)
    scan: LaserScan = _BLIND
    pose: np.ndarray = field(default_factory=lambda: np.zeros(3))


def track(
    previous_state: TrackerState,
    scan: LaserScan,
    pose: np.ndarray,
    parameters: DynamicObstacleParameters,
    range_deviation: float = 0.0,
) -> TrackerState:
    """The state after one more scan.

    Args:
        previous_state: the state until then; it is not changed.
        scan: the latest, in the sensor frame S; a rolling one is de-skewed.
        pose: (x, y, yaw) of S in W when it was taken.
        parameters: what is declared.
        range_deviation: declared standard deviation of the range error, m.
    """
    if scan.time_increment and previous_state.grid is not None:
        scan = deskew_scan(scan, previous_state.pose, previous_state.scan.time, pose)
    grid = previous_state.grid or OccupancyHistory.make_around(pose[:2], scan.range_max)
    on_large_surface = find_large_surfaces(scan, 2.0 * parameters.max_radius, range_deviation)
    beam_motion = grid.classify_beams(scan, pose, on_large_surface, parameters)
    tracks, reported_motion = update_tracks(previous_state.tracks, scan, beam_motion, pose, parameters)
    farthest_distance = tracks.radius + np.hypot(*tracks.expected_velocity.T) * PREDICTED_TIME
    static_hits = scan.points_at(scan.distances, scan.hits & (beam_motion.motion == STATIC), pose)
    walls = np.vstack((grid.find_walls(scan.time, tracks.position, farthest_distance), static_hits))
    trajectories = predict_trajectories(tracks.position, tracks.expected_velocity, tracks.radius, walls)
    tracks = replace_fields(tracks, predicted_trajectories=trajectories)
    scan = replace_fields(scan, motion=reported_motion)
    return TrackerState(
        grid.add_scan(scan, pose, on_large_surface & (beam_motion.motion != DYNAMIC)), tracks, scan, pose
    )


def join_tracks(states: Sequence[TrackerState], parameters: DynamicObstacleParameters) -> Tracks:
    """The tracks of several lidars as of the newest scan; those of a single lidar as they are.

    Each lidar tracks what it sees, also what another sees. What it saw earlier may have moved since then, no farther
    than an obstacle comes in that time. What is hidden from all comes out across the edges of what one does not see,
    where no other sees them free, or those of its view, where another looks and does not see them free.
    """
    if len(states) == 1:
        return states[0].tracks
    sighted_states = [state for state in states if state.grid is not None]
    if not sighted_states:
        return states[0].tracks
    time, tracks_of_lidars, row_count = max(state.tracks.time for state in sighted_states), [], 0
    for state in sighted_states:
        occlusion_discs = _find_hidden_edges(
            state, [other_state for other_state in sighted_states if other_state is not state], parameters
        )
        tracks = dataclasses.replace(state.tracks, occlusion_discs=occlusion_discs)
        tracks_of_lidars.append(_predict_tracks(time, tracks, parameters.max_speed, row_count))
        row_count += len(tracks)
    columns = {
        name: np.concatenate([getattr(tracks, name) for tracks in tracks_of_lidars]) for name in (*Rows._fields, *LISTS)
    }
    return Tracks(time=time, origin=tracks_of_lidars[0].origin, **columns)


def _predict_tracks(time: float, tracks: Tracks, max_speed: float, first_row: int) -> Tracks:
    """The tracks of a lidar at a later time, s, where the first of them becomes this row of all."""
    elapsed_time = time - tracks.time
    added_radius, displacement = max_speed * elapsed_time, tracks.expected_velocity * elapsed_time
    return dataclasses.replace(
        tracks,
        time=time,
        position=tracks.position + displacement,
        predicted_trajectories=tracks.predicted_trajectories + displacement[:, None],
        last_seen=tracks.last_seen + elapsed_time,
        hits=add_radius(tracks.hits, added_radius),
        possible_starters=add_radius(tracks.possible_starters, added_radius),
        occlusion_discs=add_radius(tracks.occlusion_discs, added_radius),
        hit_track=np.where(tracks.hit_track < 0, -1, tracks.hit_track + first_row),
    )


def _find_hidden_edges(
    tracker_state: TrackerState, other_states: Sequence[TrackerState], parameters: DynamicObstacleParameters
) -> np.ndarray:
    """Edges of what neither a lidar nor the others see, places with their radius, shape (n, 3), for `join_tracks`."""
    if not parameters.guarded:
        return tracker_state.tracks.occlusion_discs
    occlusion_discs = tracker_state.tracks.occlusion_discs
    view_edge_discs = find_view_edges(tracker_state.scan, tracker_state.pose)
    hidden_occlusions, hidden_edges = np.ones(len(occlusion_discs), bool), np.zeros(len(view_edge_discs), bool)
    for other_state in other_states:
        added_radius = parameters.max_speed * abs(tracker_state.tracks.time - other_state.tracks.time)
        hidden_occlusions &= ~is_seen_free(other_state.scan, other_state.pose, occlusion_discs, added_radius)[0]
        hidden_edges |= ~is_seen_free(other_state.scan, other_state.pose, view_edge_discs, added_radius)[1]
    return np.vstack((occlusion_discs[hidden_occlusions], view_edge_discs[hidden_edges]))
