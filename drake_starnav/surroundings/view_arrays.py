"""Views as arrays, for compiled functions: which of them cover a polygon."""

import math
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.geometry.footprint import Body, disc
from drake_starnav.geometry.se2 import find_pose_in_frame
from drake_starnav.lidar.field_of_view import TURN
from drake_starnav.surroundings.chords import BINS, ROUNDING
from drake_starnav.surroundings.view import View
from drake_starnav.surroundings.view_history import ViewHistory

WIDE_ANGLE = 1.5
"""A polygon that spans a wider angle, rad, may lie around the lidar of a view."""
NOWHERE = (math.nan,) * 3


class ViewArrays(NamedTuple):
    """`ViewHistory` for compiled functions, the newest first; W.

    Attributes:
        poses: (x, y, yaw) of each lidar, with the bearing of the first bin, shape (n, 3).
        visible_ranges: as of `View`, shape (n, BINS), m.
        body: of the robot at the newest view.
        robot_frames: x, y, and cosine and sine of the yaw of the robot at each `View`; NaN at the initial disc, shape
            (n, 4): nothing else stood where it did.
    """

    poses: np.ndarray
    visible_ranges: np.ndarray
    body: Body
    robot_frames: np.ndarray

    @staticmethod
    def of(history: ViewHistory) -> "ViewArrays":
        """Return the views of a history as arrays."""
        views = [view for view in history.views if isinstance(view, View)]
        footprint = views[0].params.footprint if views else disc(0.0)
        robots = [
            find_pose_in_frame(np.array(view.pose), view.robot_pose) if isinstance(view, View) else NOWHERE
            for view in history.views
        ]
        ranges = np.array([view.visible_ranges for view in history.views]).reshape(-1, BINS)
        poses = history.poses.copy()
        return ViewArrays(poses, ranges, footprint.body, _robot_frames(poses, np.array(robots).reshape(-1, 3)))


@kernel
def _robot_frames(poses, robots):
    """Return `ViewArrays.robot_frames` by the poses of views and, in their frames, of the robot, shape (n, 3)."""
    frames = np.empty((len(poses), 4))
    for k in range(len(poses)):
        (x, y, yaw), (dx, dy, turn) = poses[k], robots[k]
        cosine, sine = math.cos(yaw), math.sin(yaw)
        frames[k, 0], frames[k, 1] = x + dx * cosine - dy * sine, y + dx * sine + dy * cosine
        robot_yaw = yaw + turn
        robot_yaw -= TURN * round(robot_yaw / TURN)
        frames[k, 2], frames[k, 3] = math.cos(robot_yaw), math.sin(robot_yaw)
    return frames


@kernel
def view_covers(k, views, part, n):
    """Return whether view k saw all of a convex polygon, the first `n` of `part`: no hit is nearer on its bearings.

    Where the robot stood then, there was no obstacle either.
    """
    if body_covers(views.robot_frames[k], views.body, part, n, views.body.radius + ROUNDING)[0]:
        return True
    x, y, yaw = views.poses[k]
    farthest_distance, mx, my = 0.0, 0.0, 0.0
    for i in range(n):
        dx, dy = part[i, 0] - x, part[i, 1] - y
        farthest_distance, mx, my = max(farthest_distance, dx * dx + dy * dy), mx + dx, my + dy
    farthest_distance, left_angle, right_angle = math.sqrt(farthest_distance), 0.0, 0.0
    for i in range(n):
        dx, dy = part[i, 0] - x, part[i, 1] - y
        off_angle = math.atan2(mx * dy - my * dx, mx * dx + my * dy)
        left_angle, right_angle = max(left_angle, off_angle), min(right_angle, off_angle)
    visible_range, bin_angle = views.visible_ranges[k], TURN / BINS
    first_bin, last_bin = 0, BINS - 1
    if left_angle - right_angle < WIDE_ANGLE:  # else it may lie around the lidar
        bearing = math.atan2(my, mx) - yaw
        first_bin = int(math.floor((bearing + right_angle) / bin_angle + ROUNDING))  # not the bin that it only touches
        last_bin = max(int(math.floor((bearing + left_angle) / bin_angle - ROUNDING)), first_bin)
    for b in range(first_bin, last_bin + 1):  # noqa: SIM110 - Numba takes no generator
        if visible_range[b % BINS] < farthest_distance:
            return False
    return True


@kernel
def body_covers(frame, body, part, n, reach):
    """Return whether a body covers a polygon by one of its parts; else an edge that parts what it covers of it.

    The edge is its normal and offset, W; zeros: none. A polygon is not tested if its first corner is farther than
    `reach` from the body's origin, m.
    """
    (x, y, cosine, sine), (nx, ny, offset) = frame, (0.0, 0.0, 0.0)
    if not math.hypot(part[0, 0] - x, part[0, 1] - y) <= reach:
        return False, nx, ny, offset
    start, stops, is_inside = 0, body.polygons.ends, len(body.polygons.ends) == 0
    for i in range(n):
        is_inside = is_inside and math.hypot(part[i, 0] - x, part[i, 1] - y) <= body.radius + ROUNDING
    for end in stops:
        is_inside, cut = True, (0.0, 0.0, 0.0)
        for e in range(start, end):
            a, b = body.polygons.normals[e]
            a, b = cosine * a - sine * b, sine * a + cosine * b
            edge_offset, low, high = body.polygons.offsets[e] + a * x + b * y, np.inf, -np.inf
            for i in range(n):
                edge_distance = a * part[i, 0] + b * part[i, 1] - edge_offset
                low, high = min(low, edge_distance), max(high, edge_distance)
            is_inside = is_inside and high <= ROUNDING
            if low > -ROUNDING and high > ROUNDING:  # it is beside this part
                cut = 0.0, 0.0, 0.0
                break
            if high > ROUNDING:
                cut = a, b, edge_offset
        if is_inside:
            break
        nx, ny, offset = (nx, ny, offset) if nx != 0.0 or ny != 0.0 else cut
        start = end
    return is_inside, nx, ny, offset
