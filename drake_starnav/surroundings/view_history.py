"""The views that the certificate remembers, with their poses, and which of them still count."""

import math
from collections.abc import Sequence
from functools import cached_property
from itertools import compress
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.geometry.se2 import Place, transform_points
from drake_starnav.lidar.field_of_view import TURN
from drake_starnav.lidar.laser_scan import Beams, LaserScan
from drake_starnav.surroundings.chords import BINS, Chords, measure_visible_ranges
from drake_starnav.surroundings.margins import VIEW_TURN, ViewRetention
from drake_starnav.surroundings.view import View
from drake_starnav.utils.snapshot import snapshot

VIEW_SPACING, MOST_VIEWS = 0.125, 32
"""Past views are this many radii of the robot apart, or turned; at most this many of each lidar are kept."""


class Odometer(NamedTuple):
    """How far the robot has come since it began.

    Attributes:
        way: m.
        turn: sum of all turns, in either direction, rad.
    """

    way: float = 0.0
    turn: float = 0.0

    def advance(self, previous_pose: np.ndarray, pose: np.ndarray) -> "Odometer":
        """Return the odometer after a step from one pose (x, y, yaw) to another."""
        x, y, yaw = (pose - previous_pose).tolist()
        return Odometer(self.way + math.hypot(x, y), self.turn + abs(math.remainder(yaw, TURN)))


@snapshot
class InitialFreeDisc:
    """A disc about the robot's initial pose that holds no obstacle but those that are seen from there.

    Attributes:
        visible_ranges: radius of the disc in each bearing bin, shape (BINS,), m.
    """

    visible_ranges: np.ndarray

    @staticmethod
    def of_radius(radius: float) -> "InitialFreeDisc":
        """Return a whole disc of this radius, m."""
        return InitialFreeDisc(np.full(BINS, radius))

    @cached_property
    def beams(self) -> Beams:
        """The disc as the beams of a lidar that hit nothing."""
        farthest_range, lost_ranges = float(self.visible_ranges.max()), np.full(BINS, math.nan)
        free = self.visible_ranges
        return LaserScan(
            0.0, 0.0, TURN / BINS, 0.0, max(farthest_range, 1e-9), lost_ranges, lost_beams=True, free=free
        ).beams

    def cut_by(self, chords: Chords, pose: tuple[float, float, float]) -> "InitialFreeDisc":
        """Return the disc about a pose (x, y, yaw) in W without what lies at or behind the surfaces among chords."""
        end_points, radius = chords.ends[chords.is_surface], float(self.visible_ranges.max())
        return InitialFreeDisc(np.minimum(self.visible_ranges, measure_visible_ranges(end_points, pose, radius)))


class ViewHistory(NamedTuple):
    """Views with their poses in the current frame, the newest first; the last one may be the initial free disc.

    Attributes:
        views: in the frames in which they were made.
        rows: of each (x, y, yaw) of the lidar, with the bearing of the first bin, W; the time, s; and `Odometer` then;
            shape (n, 6).
    """

    views: tuple[View | InitialFreeDisc, ...] = ()
    rows: np.ndarray = np.zeros((0, 6))

    @staticmethod
    def of_one_time(
        views: Sequence[View | InitialFreeDisc], poses: Sequence[Place], time: float, odometer: Odometer
    ) -> "ViewHistory":
        """Return views that were taken at one time, s, from poses (x, y, yaw) of the lidars, W."""
        return ViewHistory(tuple(views), np.array([(*pose, time, *odometer) for pose in poses]))

    @property
    def poses(self) -> np.ndarray:
        """Pose (x, y, yaw) of each, shape (n, 3), W."""
        return self.rows[:, :3]

    @property
    def times(self) -> np.ndarray:
        """Time of each, shape (n,), s."""
        return self.rows[:, 3]

    def followed_by(self, older: "ViewHistory") -> "ViewHistory":
        """Return these views, then older ones."""
        return ViewHistory(self.views + older.views, np.concatenate((self.rows, older.rows)))

    def select(self, indices: np.ndarray) -> "ViewHistory":
        """Return the views of some indices."""
        return ViewHistory(tuple([self.views[k] for k in indices.tolist()]), self.rows[indices])

    def transformed(self, frame: np.ndarray) -> "ViewHistory":
        """Return the views in another frame, in which the origin of this one is at the pose `frame` (x, y, yaw)."""
        poses = np.column_stack((transform_points(frame, self.rows[:, :2]), self.rows[:, 2] + frame[2]))
        return self._replace(rows=np.hstack((poses, self.rows[:, 3:])))


def forget_stale_views(
    past: ViewHistory,
    latest: ViewHistory,
    odometer: Odometer,
    position: tuple[float, float],
    time: float,
    retention: ViewRetention,
) -> ViewHistory:
    """Return the views that still count after a scan.

    Args:
        past: those that counted at the scan before.
        latest: those of that scan, one of each lidar.
        odometer: of the robot now.
        position: of the robot now, W, m.
        time: now, s.
        retention: which count.
    """
    views, (x, y) = latest.views + past.views, position
    has_lost_beams = any(not view.beams.complete for view in latest.views)
    least = time - retention.age, odometer.way - retention.way, odometer.turn - retention.turn
    lengths = retention.reach, retention.spacing
    has_disc = bool(views) and isinstance(views[-1], InitialFreeDisc)
    counts, rows = _select_views(latest.rows, past.rows, (has_disc, has_lost_beams), (x, y), least, lengths)
    return ViewHistory(tuple(compress(views, counts.tolist())), rows)


@kernel
def _select_views(latest, past, flags, position, least, lengths):
    """Return which views still count, and their rows; arguments as of `forget_stale_views`, views by their rows.

    `flags` are whether the last one is the initial free disc, and whether views from one place count, too, since each
    saw what others lost; `least` time, s, way, m, and turn, rad, count, and `lengths` are reach and spacing, m.
    """
    has_disc, has_lost_beams = flags
    reach, spacing = lengths
    count = len(latest)
    rows = np.concatenate((latest, past))
    counts, older, end = np.ones(len(rows), np.bool_), 2 * count, len(rows) - has_disc
    if len(rows) > older > 0:
        if older == end or has_lost_beams or _are_apart(rows[count], rows[older], spacing):
            for k in range(older, end):
                counts[k] = has_lost_beams or _are_apart(rows[count], rows[k], spacing)
        else:  # the views before the latest are too near to those that are remembered
            counts[count:older] = False
    remaining = 0
    for k in range(len(rows)):
        x, y, _, time, way, turn = rows[k]
        is_fresh = time >= least[0] and way >= least[1] and turn >= least[2]
        counts[k] &= is_fresh and math.hypot(x - position[0], y - position[1]) < reach
        remaining += counts[k] and k < end
    while remaining > MOST_VIEWS * max(count, 1):  # of the two that differ least the older one is dropped
        least, superfluous = np.inf, end
        for i in range(count, end):
            for j in range(i + 1, end):
                if counts[i] and counts[j]:
                    distance, turn = _measure_pose_difference(rows[i], rows[j])
                    if distance / spacing + turn < least:  # a radian counts as much as the spacing
                        least, superfluous = distance / spacing + turn, j
        counts[superfluous] = False
        remaining -= 1
    return counts, rows[counts]


@kernel
def _are_apart(pose_1, pose_2, spacing):
    distance, turn_angle = _measure_pose_difference(pose_1, pose_2)
    return distance > spacing or turn_angle > VIEW_TURN


@kernel
def _measure_pose_difference(pose_1, pose_2):
    """Return the distance of two views, m, and the angle by which they are turned, rad."""
    turn_angle = pose_1[2] - pose_2[2]
    return math.hypot(pose_1[0] - pose_2[0], pose_1[1] - pose_2[1]), abs(turn_angle - TURN * round(turn_angle / TURN))
