"""How far a footprint is from surfaces that were hit, and from what they hide.

Two convex sets are disjoint if and only if the normal of an edge of one of them separates them; the gap along that
normal is a lower bound of their distance.
"""

import math

import numpy as np
from numba import njit

from drake_starnav.geometry.polyline import point_to_segment_squared

ESCAPE_CLEARANCE = 0.002
"""A move that begins within the margin may come no nearer than this, m."""


@njit(cache=True)
def keeps_clear(poses, surfaces, polygons, sizes):
    """Whether poses (n, 3) keep the margin, or the distance that the first one has, to all surfaces and the unknown.

    Args:
        poses: of the samples, W.
        surfaces: `Chords`.
        polygons: `Polygons`.
        sizes: the margin, the radius of the disc that holds the footprint, and within which distance of the scan's
            place that disc is clear of what lies beyond the known hits; m.
    """
    margin, radius, room = sizes
    count, center = len(poses), surfaces.center
    moved = np.zeros(count)  # no point of the footprint has moved farther
    for i in range(count):
        away = math.hypot(poses[i, 0] - center[0], poses[i, 1] - center[1])
        if away > room:
            return False
        if i > 0:
            way = math.hypot(poses[i, 0] - poses[i - 1, 0], poses[i, 1] - poses[i - 1, 1])
            moved[i] = moved[i - 1] + way + radius * abs(poses[i, 2] - poses[i - 1, 2])
    apart = math.hypot(poses[0, 0] - center[0], poses[0, 1] - center[1]) + radius + margin + moved[-1]
    for j in range(len(surfaces.ends)):
        ends = surfaces.ends[j]
        away = point_to_segment_squared(center[0], center[1], ends[0], ends[1], ends[2], ends[3])
        if away > apart * apart:  # what a chord hides is farther away than the chord
            continue
        needed, i = margin, 0
        while True:
            gap = _gap(poses[i], ends, surfaces.shades[j], center, polygons, needed + moved[-1])
            if i == 0 and gap < needed:
                needed = max(gap - 1e-9, ESCAPE_CLEARANCE)
            if gap < needed:
                return False
            reached = moved[i] + (gap - needed)  # not less than moved[i]
            if reached >= moved[-1]:
                break
            i = np.searchsorted(moved, reached, side="right")
    return True


@njit(cache=True)
def _gap(pose, ends, shades, center, polygons, enough):
    """Lower bound of the distance of a footprint at a pose from a chord (4,) and what it hides, m, up to `enough`."""
    cosine, sine = math.cos(pose[2]), math.sin(pose[2])
    ax, ay = _in_frame(ends[0] - pose[0], ends[1] - pose[1], cosine, sine)
    bx, by = _in_frame(ends[2] - pose[0], ends[3] - pose[1], cosine, sine)
    cx, cy = _in_frame(center[0] - pose[0], center[1] - pose[1], cosine, sine)
    chord = ax, ay, bx, by
    rays = (ax - cx, ay - cy, bx - cx, by - cy) if shades else (0.0, 0.0, 0.0, 0.0)
    least, start = np.inf, 0
    for end in polygons.ends:
        least = min(least, _part_gap(chord, rays, polygons, start, end, enough))
        start = end
    return least


@njit(cache=True)
def _in_frame(x, y, cosine, sine):
    """A vector in the frame that is turned by an angle of this cosine and sine."""
    return cosine * x + sine * y, cosine * y - sine * x


@njit(cache=True)
def _part_gap(chord, rays, polygons, start, end, enough):
    """`_gap` of the polygon of these vertices, in the robot's frame."""
    ax, ay, bx, by = chord
    best = -np.inf
    for e in range(start, end):
        best = max(best, _along(polygons.normals[e, 0], polygons.normals[e, 1], chord, rays) - polygons.offsets[e])
        if best >= enough:
            return best
    for dx, dy in ((bx - ax, by - ay), (rays[0], rays[1]), (rays[2], rays[3])):
        size = math.sqrt(dx * dx + dy * dy)
        if size < 1e-12:
            continue
        nx, ny = -dy / size, dx / size
        low, high = np.inf, -np.inf
        for k in range(start, end):
            reach = nx * polygons.vertices[k, 0] + ny * polygons.vertices[k, 1]
            low, high = min(low, reach), max(high, reach)
        best = max(best, _along(nx, ny, chord, rays) - high, _along(-nx, -ny, chord, rays) + low)
    return best


@njit(cache=True)
def _along(nx, ny, chord, rays):
    """Least extent of a chord and the rays behind it along a normal, m; minus infinity if the rays lead back."""
    if nx * rays[0] + ny * rays[1] < -1e-12 or nx * rays[2] + ny * rays[3] < -1e-12:
        return -np.inf
    return min(nx * chord[0] + ny * chord[1], nx * chord[2] + ny * chord[3])
