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
def _open(angle, near, distance, way):
    """Whether a way (m) along a bearing keeps a distance from hits (n, 3), x, y and how far now, or leads off them."""
    ux, uy = math.cos(angle), math.sin(angle)
    for k in range(len(near)):
        x, y, now = near[k]
        along = min(max(x * ux + y * uy, 0.0), way)
        if math.hypot(x - along * ux, y - along * uy) < min(distance, now) - 1e-9:
            return False
        if math.hypot(x - way * ux, y - way * uy) < min(distance, now + OFF * way):
            return False
    return True


@kernel
def free_heading(x, y, ux, uy, hits, sizes):
    """The unit vector (ux, uy) if it is free, else the nearest free one within FREE_HEADING_RANGE, or itself.

    Ranges are noisy, and the nearest of many hits has the largest error. Once a hit lies within the certificate's
    distance of a robot beside a wall, it may come no nearer to that hit. A few degrees off the wall the space may be
    free, but the guiding vector does not lead there: the robot would stop.

    Args:
        x, y: of the robot, W, m.
        ux, uy: unit vector.
        hits: shape (n, 2), as used by the certificate, W, m.
        sizes: the robot's radius, and the distance that the certificate keeps from hits, m.
    """
    way, distance = OPEN_WAY * sizes[0], sizes[1]
    near, count = np.empty((len(hits), 3)), 0
    for k in range(len(hits)):
        dx, dy = hits[k, 0] - x, hits[k, 1] - y
        if abs(dx) < distance + way and abs(dy) < distance + way and math.hypot(dx, dy) < distance + way:
            put(near, count, (dx, dy, math.hypot(dx, dy)))
            count += 1
    near, angle = near[:count], math.atan2(uy, ux)
    if _open(angle, near, distance, way):
        return ux, uy
    for k in range(1, int(FREE_HEADING_RANGE / STEP) + 1):
        for step in (STEP, -STEP):
            turned = angle + k * step
            if _open(turned, near, distance, way) and _open(turned + step, near, distance, way):
                return math.cos(turned), math.sin(turned)
    return ux, uy
