"""From one scan to the next: static obstacles, moving ones, and their motion."""

import dataclasses
from collections.abc import Sequence
from dataclasses import field
from typing import NamedTuple

import numpy as np

from drake_starnav.lidar.deskew import deskewed
from drake_starnav.lidar.laser_scan import DYNAMIC, LaserScan
from drake_starnav.tracking.kalman_tracks import Tracks, updated
from drake_starnav.tracking.occupancy_history import OccupancyHistory
from drake_starnav.tracking.parameters import DynamicObstacleParameters
from drake_starnav.tracking.prediction import Rows, grown, seen_free, view_edges
from drake_starnav.tracking.surfaces import on_large_surfaces
from drake_starnav.utils.snapshot import replaced, snapshot

_BLIND = LaserScan(0.0, -1.0, 1.0, 0.0, 1.0, np.full(3, np.nan), lost_beams=True)
"""A scan of lost beams only, which carries no information."""
LISTS = ("hits", "owner", "standing", "occlusions")
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
class Tracked:
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
    before: Tracked,
    scan: LaserScan,
    pose: np.ndarray,
    parameters: DynamicObstacleParameters,
    range_deviation: float = 0.0,
) -> Tracked:
    """The state after one more scan.

    Args:
        before: the state until then; it is not changed.
        scan: the latest, in the sensor frame S; a rolling one is de-skewed.
        pose: (x, y, yaw) of S in W when it was taken.
        parameters: what is declared.
        range_deviation: declared standard deviation of the range error, m.
    """
    if scan.time_increment and before.grid is not None:
        scan = deskewed(scan, before.pose, before.scan.time, pose)
    grid = before.grid or OccupancyHistory.about(pose[:2], scan.range_max)
    large = on_large_surfaces(scan, 2.0 * parameters.max_radius, range_deviation)
    judged = grid.judged(scan, pose, large, parameters)
    tracks, reported = updated(before.tracks, scan, judged, pose, parameters)
    scan = replaced(scan, motion=reported)
    return Tracked(grid.updated(scan, pose, large & (judged.motion != DYNAMIC)), tracks, scan, pose)


def joint_tracks(states: Sequence[Tracked], parameters: DynamicObstacleParameters) -> Tracks:
    """The tracks of several lidars as of the newest scan; those of a single lidar as they are.

    Each lidar tracks what it sees, also what another sees. What it saw earlier may have moved since then, no farther
    than an obstacle comes in that time. What is hidden from all comes out across the edges of what one does not see,
    where no other sees them free, or those of its view, where another looks and does not see them free.
    """
    if len(states) == 1:
        return states[0].tracks
    seen = [each for each in states if each.grid is not None]
    if not seen:
        return states[0].tracks
    time, parts, rows = max(each.tracks.time for each in seen), [], 0
    for each in seen:
        hidden = _hidden(each, [other for other in seen if other is not each], parameters)
        tracks = dataclasses.replace(each.tracks, occlusions=hidden)
        parts.append(_at(time, tracks, parameters.max_speed, rows))
        rows += len(tracks)
    fields = {name: np.concatenate([getattr(part, name) for part in parts]) for name in (*Rows._fields, *LISTS)}
    return Tracks(time=time, origin=parts[0].origin, **fields)


def _at(time: float, tracks: Tracks, max_speed: float, first: int) -> Tracks:
    """The tracks of a lidar at a later time, s, where the first of them becomes this row of all."""
    ago = time - tracks.time
    spread, moved = max_speed * ago, tracks.expected_velocity * ago
    return dataclasses.replace(
        tracks,
        time=time,
        position=tracks.position + moved,
        seen=tracks.seen + ago,
        hits=grown(tracks.hits, spread),
        standing=grown(tracks.standing, spread),
        occlusions=grown(tracks.occlusions, spread),
        owner=np.where(tracks.owner < 0, -1, tracks.owner + first),
    )


def _hidden(tracked: Tracked, others: Sequence[Tracked], parameters: DynamicObstacleParameters) -> np.ndarray:
    """Edges of what neither a lidar nor the others see, places with their radius, shape (n, 3), for `joint_tracks`."""
    if not parameters.guarded:
        return tracked.tracks.occlusions
    shadows, edges = tracked.tracks.occlusions, view_edges(tracked.scan, tracked.pose)
    open_shadows, open_edges = np.ones(len(shadows), bool), np.zeros(len(edges), bool)
    for other in others:
        slack = parameters.max_speed * abs(tracked.tracks.time - other.tracks.time)
        open_shadows &= ~seen_free(other.scan, other.pose, shadows, slack)[0]
        open_edges |= ~seen_free(other.scan, other.pose, edges, slack)[1]
    return np.vstack((shadows[open_shadows], edges[open_edges]))
