"""Past a wall that is too near: the bearing nearest to the guiding vector along which the certificate allows motion."""

import math

from numba import njit

from drake_starnav.surroundings.region_union import covers

FREE_HEADING_RANGE = 0.8
"""Largest turn of the guiding vector to a free bearing, rad."""
OPEN_WAY = 0.08
"""A bearing is free if the certified region contains the robot's path along it up to this distance, in its radii."""
SAMPLES = 4
"""Points on that path that are checked."""
STEP = math.radians(2.0)
"""Spacing of the bearings tried; a free one counts only if the next is free too: otherwise noise may close it again."""


@njit(cache=True)
def _open(x, y, angle, star, most):
    """Whether the star contains the way from (x, y) along a bearing up to a distance, m."""
    center, bearing_0, values = star
    ux, uy = math.cos(angle), math.sin(angle)
    for k in range(1, SAMPLES + 1):
        way = most * k / SAMPLES
        if not covers(center, bearing_0, values, 0, x + way * ux, y + way * uy, 0.0):
            return False
    return True


@njit(cache=True)
def free_heading(x, y, ux, uy, star, radius):
    """The unit vector (ux, uy) if it is free, else the nearest free one within FREE_HEADING_RANGE, or itself.

    Ranges are noisy, and the nearest of many hits has the largest error. Once a hit lies within the certificate's
    distance of a robot beside a wall, no motion along that wall is certified. A few degrees off the wall the space may
    be free, but the guiding vector does not lead there: the robot would stop. `star` is center,
    bearing_0 and values of the certified region as a union of one region, `radius` the robot's, m.
    """
    angle, way = math.atan2(uy, ux), OPEN_WAY * radius
    if _open(x, y, angle, star, way):
        return ux, uy
    for k in range(1, int(FREE_HEADING_RANGE / STEP) + 1):
        for step in (STEP, -STEP):
            turned = angle + k * step
            if _open(x, y, turned, star, way) and _open(x, y, turned + step, star, way):
                return math.cos(turned), math.sin(turned)
    return ux, uy
