"""Past a wall that is too near: the bearing nearest to the guiding vector along which the certificate allows motion."""

import math

import numpy as np

from drake_starnav.geometry.compiled import kernel, put

FREE_HEADING_RANGE = 0.8
"""Largest turn of the guiding vector to a free bearing, rad."""
OPEN_WAY = 0.08
"""A bearing is free if nothing is too near on the robot's way along it up to this distance, in its radii."""
OFF = 0.15
"""What is too near now is to be farther at the end of that way by this share of it: its surface may hide more ahead."""
STEP = math.radians(2.0)
"""Spacing of the bearings tried; a free one counts only if the next is free too: otherwise noise may close it again."""


@kernel
def _is_way_open(bearing, hits_near, distance, way_length):
    """Whether a way (m) along a bearing keeps a distance from hits (n, 3), x, y and how far now, or leads off them."""
    ux, uy = math.cos(bearing), math.sin(bearing)
    for k in range(len(hits_near)):
        x, y, hit_distance = hits_near[k]
        along_way = min(max(x * ux + y * uy, 0.0), way_length)
        if math.hypot(x - along_way * ux, y - along_way * uy) < min(distance, hit_distance) - 1e-9:
            return False
        if math.hypot(x - way_length * ux, y - way_length * uy) < min(distance, hit_distance + OFF * way_length):
            return False
    return True


@kernel
def find_free_heading(x, y, ux, uy, hits, radius, distance):
    """The unit vector (ux, uy) if it is free, else the nearest free one within FREE_HEADING_RANGE, or itself.

    Ranges are noisy, and the nearest of many hits has the largest error. Once a hit lies within the certificate's
    distance of a robot beside a wall, it may come no nearer to that hit. A few degrees off the wall the space may be
    free, but the guiding vector does not lead there: the robot would stop.

    Args:
        x, y: of the robot, W, m.
        ux, uy: unit vector.
        hits: shape (n, 2), as used by the certificate, W, m.
        radius: of the robot, m.
        distance: that the certificate keeps from hits, m.
    """
    way_length = OPEN_WAY * radius
    hits_near, near_count = np.empty((len(hits), 3)), 0
    for k in range(len(hits)):
        dx, dy = hits[k, 0] - x, hits[k, 1] - y
        if (
            abs(dx) < distance + way_length
            and abs(dy) < distance + way_length
            and math.hypot(dx, dy) < distance + way_length
        ):
            put(hits_near, near_count, (dx, dy, math.hypot(dx, dy)))
            near_count += 1
    hits_near, bearing = hits_near[:near_count], math.atan2(uy, ux)
    if _is_way_open(bearing, hits_near, distance, way_length):
        return ux, uy
    for k in range(1, int(FREE_HEADING_RANGE / STEP) + 1):
        for turn_step in (STEP, -STEP):
            tried_bearing = bearing + k * turn_step
            if _is_way_open(tried_bearing, hits_near, distance, way_length) and _is_way_open(
                tried_bearing + turn_step, hits_near, distance, way_length
            ):
                return math.cos(tried_bearing), math.sin(tried_bearing)
    return ux, uy
