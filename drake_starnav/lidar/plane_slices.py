"""Slices of solids by a plane, as rows for `drake_starnav.lidar.raycast`.

Solids have two exact forms: solids of revolution and ellipsoids are (clipped) quadrics, whose slices are (clipped)
conics; polyhedra are convex faces, whose slices are segments. Hence the slice of a tilted cylinder is exact, an ellipse
clipped by its two end faces. A face within the plane is cut if the solid is below it, not if it is above.
"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.compiled import kernel, leaf
from drake_starnav.lidar.raycast import CIRCLE, COLUMNS, CONIC, SEGMENT

RESOLUTION = 1e-6
"""Rounding of a plane: of its unit normal, and of its distance from the origin in metres."""
EVERYWHERE = 0.0, 0.0, math.inf
"""A circle around all."""
SLAB, WIDE = 0.03, 100.0
"""Faces are kept that come this near to a plane, m, as a robot that pitches as it brakes cuts no others; and those that
reach farther than the second, m, as the ground does."""


@dataclass(frozen=True)
class Solids:
    """The shapes fixed to one frame F, in F.

    Attributes:
        quadrics: shape (n, 15): centre c (3), upper triangle of the matrix M (6), axis (3), low, high, cap radius:
            the surface (p-c)^T M (p-c) = 1 where low <= axis^T (p-c) <= high, closed by flat caps if their radius > 0.
        vertices: shape (v, 3), m.
        face_starts: shape (f + 1,), int; face k is the convex polygon `face_vertices[face_starts[k]:face_starts[k+1]]`.
        face_vertices: shape (sum,), int, indices of vertices.
    """

    quadrics: np.ndarray
    vertices: np.ndarray
    face_starts: np.ndarray
    face_vertices: np.ndarray


class _Conic(NamedTuple):
    """The curve d^T A d + 2 b^T d + c = 0 in a plane."""

    a00: float
    a01: float
    a11: float
    b0: float
    b1: float
    c: float


class _Axis(NamedTuple):
    """A quadric's axis in a plane: the projections of its centre, m, and of its direction, and the latter's length."""

    x: float
    y: float
    u0: float
    u1: float
    slope: float


class Slab(NamedTuple):
    """Solids with only those of their faces that planes near one may cut.

    Attributes:
        solids: with these faces, in their order.
        plane: rows of that one, as of `slice_solids`.
        far: distance of the farthest vertex of the other faces from its origin, m.
    """

    solids: Solids
    plane: tuple[list[float], ...]
    far: float

    @staticmethod
    def of(solids: Solids, plane: np.ndarray) -> "Slab":
        """The faces within SLAB of a plane (3, 3), and wide ones."""
        if not len(solids.face_vertices):
            return Slab(solids, tuple(plane.tolist()), 0.0)
        vertices_above, starts = solids.vertices - plane[2], solids.face_starts
        height = vertices_above @ np.cross(plane[0], plane[1])
        distance = np.sqrt((vertices_above * vertices_above).sum(axis=1))
        lowest = np.minimum.reduceat(height[solids.face_vertices], starts[:-1])
        highest, reach = (np.maximum.reduceat(x[solids.face_vertices], starts[:-1]) for x in (height, distance))
        is_near, sizes = (lowest <= SLAB) & (highest >= -SLAB) | (reach > WIDE), np.diff(starts)
        used, vertices = np.unique(solids.face_vertices[np.repeat(is_near, sizes)], return_inverse=True)
        starts = np.concatenate((starts[:1], np.cumsum(sizes[is_near])))
        kept_solids = replace(solids, vertices=solids.vertices[used], face_starts=starts, face_vertices=vertices)
        return Slab(kept_solids, tuple(plane.tolist()), float(reach.max(initial=0.0, where=~is_near)))

    def contains_cut_of(self, plane: np.ndarray) -> bool:
        """Whether it has all faces that a plane (3, 3) cuts: no vertex is higher over one than over the other by more.

        Of a vertex v the heights n (v - o) differ by at most |n' - n| |v - o| + |o' - o|, and normals by no more than
        the two vectors of the planes together.
        """
        differences = [math.dist(*both) for both in zip(self.plane, plane.tolist(), strict=True)]
        return (differences[0] + differences[1]) * self.far + differences[2] < SLAB


def slice_solids(solids: Solids, plane: np.ndarray, near: tuple[float, float, float] = EVERYWHERE) -> np.ndarray:
    """The slice of solids, as rows for `drake_starnav.lidar.raycast`.

    Args:
        solids: in a frame F.
        plane: shape (3, 3), in F: two orthonormal vectors that span the plane, and its origin, m. Coordinates in the
            plane are along the two vectors, from the origin.
        near: x, y and radius of a circle in the plane, m; shapes outside it are left out.
    """
    return _slice_faces_and_quadrics(
        plane, *near, solids.quadrics, solids.vertices, solids.face_starts, solids.face_vertices
    )


@kernel
def find_scan_planes(X_WF, X_WS_begin, X_WS, known):
    """The scan plane in each of m frames F.

    Args:
        X_WF: shape (m, 3, 4), poses of the frames, m.
        X_WS_begin, X_WS: shape (3, 4), poses of the sensor when a sweep begins and when it ends, m.
        known: shape (m, 4), keys of the previous call; NaN for none.

    Returns:
        keys (m, 4): the rounded normal and distance, at the end; planes (m, 3, 3), as `slice_solids` takes them; (x, y,
        yaw) of the sensor in each plane, (2, m, 3), at both; indices of the frames whose keys have changed.
    """
    keys, planes, poses = np.empty((len(X_WF), 4)), np.empty((len(X_WF), 3, 3)), np.empty((2, len(X_WF), 3))
    changed_planes, count = np.empty(len(X_WF), np.int64), 0
    for k in range(len(X_WF)):
        X, key = X_WF[k], keys[k]
        first, second, origin = planes[k, 0], planes[k, 1], planes[k, 2]
        for i in range(3):
            key[i] = np.round((X[0, i] * X_WS[0, 2] + X[1, i] * X_WS[1, 2] + X[2, i] * X_WS[2, 2]) / RESOLUTION)
            origin[i] = 0.0
            for j in range(3):
                origin[i] += X[j, i] * (X_WS[j, 3] - X[j, 3])
        length = math.sqrt(key[0] * key[0] + key[1] * key[1] + key[2] * key[2])
        n0, n1, n2 = key[0] / length, key[1] / length, key[2] / length
        key[3] = np.round((n0 * origin[0] + n1 * origin[1] + n2 * origin[2]) / RESOLUTION)
        # The first vector is F's x axis seen from above the plane, or its y axis where x is too steep.
        lean = -n0 if abs(n0) < 0.9 else -n1
        first[0], first[1], first[2] = lean * n0, lean * n1, lean * n2
        first[0 if abs(n0) < 0.9 else 1] += 1.0
        length = math.sqrt(_along(first, first))
        first[0], first[1], first[2] = first[0] / length, first[1] / length, first[2] / length
        second[0], second[1] = n1 * first[2] - n2 * first[1], n2 * first[0] - n0 * first[2]
        second[2] = n0 * first[1] - n1 * first[0]
        plane_offset = key[3] * RESOLUTION
        origin[0], origin[1], origin[2] = n0 * plane_offset, n1 * plane_offset, n2 * plane_offset
        for i in range(4):
            if key[i] != known[k, i]:
                changed_planes[count] = k
                count += 1
                break
        for X_S, pose in ((X_WS_begin, poses[0, k]), (X_WS, poses[1, k])):
            x = y = cosine = sine = 0.0
            for i in range(3):
                p, a = -origin[i], 0.0
                for j in range(3):
                    p += X[j, i] * (X_S[j, 3] - X[j, 3])
                    a += X[j, i] * X_S[j, 0]
                x += first[i] * p
                y += second[i] * p
                cosine += first[i] * a
                sine += second[i] * a
            pose[0], pose[1], pose[2] = x, y, math.atan2(sine, cosine)
    return keys, planes, poses, changed_planes[:count]


@leaf
def _along(point, axis, origin=(0.0, 0.0, 0.0)):
    """The coordinate of a point (3,) along an axis (3,): of a vector, from zero, the scalar product."""
    x, y, z = point[0] - origin[0], point[1] - origin[1], point[2] - origin[2]
    return x * axis[0] + y * axis[1] + z * axis[2]


@kernel
def _slice_faces_and_quadrics(plane, x, y, radius, quadrics, vertices, face_starts, face_vertices):
    """The rows (k, 14) of the slice of `Solids` by a plane (3, 3), of those that may lie within a circle."""
    a, b, normal = plane[0], plane[1], np.empty(3)
    normal[0], normal[1] = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2]
    normal[2] = a[0] * b[1] - a[1] * b[0]
    heights = np.empty(len(vertices))
    for k in range(len(vertices)):
        heights[k] = _along(vertices[k], normal, plane[2])
    crossing, cut = np.empty(len(face_starts) - 1, np.int64), 0
    for f in range(len(face_starts) - 1):
        above = 0
        for k in range(face_starts[f], face_starts[f + 1]):
            above += heights[face_vertices[k]] >= 0.0
        crossing[cut] = f
        cut += 0 < above < face_starts[f + 1] - face_starts[f]
    rows = np.zeros((3 * len(quadrics) + cut, COLUMNS))
    count = np.int64(0)  # a literal would compile its callees twice
    for k in range(len(quadrics)):
        count = _slice_quadric(quadrics[k], plane, normal, rows, count)
    for f in crossing[:cut]:
        first, last, found_count = face_starts[f], face_starts[f + 1], 0
        x1 = y1 = x2 = y2 = 0.0
        for k in range(first, last):
            i, j = face_vertices[k], face_vertices[k + 1 if k + 1 < last else first]
            if (heights[i] >= 0.0) == (heights[j] >= 0.0) or found_count == 2:
                continue
            if heights[i] > heights[j]:  # always upwards: two faces that share an edge get exactly the same point
                i, j = j, i
            share = heights[i] / (heights[i] - heights[j])
            a, b = vertices[i], vertices[j]
            point = a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), a[2] + share * (b[2] - a[2])
            x1, y1, x2, y2 = x2, y2, _along(point, plane[0], plane[2]), _along(point, plane[1], plane[2])
            found_count += 1
        if found_count == 2 and (x1 != x2 or y1 != y2):
            count = _put_segment(x1, y1, x2, y2, rows, count)
    kept_count = 0
    for k in range(count):
        if math.hypot(rows[k, 0] - x, rows[k, 1] - y) <= radius + rows[k, 2]:
            for column in range(COLUMNS if kept_count < k else 0):
                rows[kept_count, column] = rows[k, column]
            kept_count += 1
    return rows[:kept_count]


@leaf
def _put_segment(x1, y1, x2, y2, rows, count):
    """Write a segment between two points of the plane as a row; returns the new count of rows."""
    row = rows[count]
    row[0], row[1], row[2], row[3] = (x1 + x2) / 2.0, (y1 + y2) / 2.0, math.hypot(x2 - x1, y2 - y1) / 2.0, SEGMENT
    row[4], row[5], row[6], row[7] = x1, y1, x2, y2
    return count + 1


@leaf
def _multiply(q, v):
    """M v, with the upper triangle of M in a quadric's columns 3 to 8."""
    return (
        q[3] * v[0] + q[4] * v[1] + q[5] * v[2],
        q[4] * v[0] + q[6] * v[1] + q[7] * v[2],
        q[5] * v[0] + q[7] * v[1] + q[8] * v[2],
    )


@leaf
def _cut_quadric(q, plane, normal, height):
    """Return the conic of a quadric whose centre is so high above the plane, m, with d from the centre's projection."""
    e1, e2 = plane[0], plane[1]
    M1, M2 = _multiply(q, e1), _multiply(q, e2)  # of p - c = d - height normal
    c = height * height * _along(_multiply(q, normal), normal) - 1.0
    a00, a01, a11 = _along(M1, e1), _along(M1, e2), _along(M2, e2)
    return _Conic(a00, a01, a11, -height * _along(M1, normal), -height * _along(M2, normal), c)


@leaf
def _enclose_conic(conic):
    """Return the circle around a conic, its centre and radius, infinite if it is no ellipse, and what is inside.

    That is minus the least value of the quadratic form, not positive if the conic is empty; and whether it is a circle.
    """
    trace, determinant = conic.a00 + conic.a11, conic.a00 * conic.a11 - conic.a01 * conic.a01
    if not determinant > 1e-12 * trace * trace:
        return 0.0, 0.0, np.inf, np.inf, False
    cx = (conic.a01 * conic.b1 - conic.a11 * conic.b0) / determinant
    cy = (conic.a01 * conic.b0 - conic.a00 * conic.b1) / determinant
    size, spread = -(conic.c + conic.b0 * cx + conic.b1 * cy), math.hypot((conic.a00 - conic.a11) / 2.0, conic.a01)
    radius = math.sqrt(max(size * (trace / 2.0 + spread) / determinant, 0.0))
    return cx, cy, radius, size, spread <= 1e-12 * trace


@leaf
def _cut_across(conic, u0, u1):
    """Return the quadratic coefficient of a conic across a direction, and minus the place of its middle there."""
    across = conic.a00 * u1 * u1 - 2.0 * conic.a01 * u0 * u1 + conic.a11 * u0 * u0
    return across, (conic.b0 * u1 - conic.b1 * u0) / across


@kernel
def _slice_quadric(q, plane, normal, rows, count):
    """Write the conic d^T A d + 2 b^T d + c = 0 of one quadric, clipped to low <= m^T d <= high, and its end faces."""
    center, axis = q[0:3], q[9:12]
    height, lean = _along(center, normal, plane[2]), _along(axis, normal)
    conic = _cut_quadric(q, plane, normal, height)
    cx, cy, radius, size, is_circle = _enclose_conic(conic)
    x0, y0 = _along(center, plane[0], plane[2]), _along(center, plane[1], plane[2])
    m0, m1 = _along(axis, plane[0]), _along(axis, plane[1])
    low, high = q[12] + height * lean, q[13] + height * lean
    slope = math.hypot(m0, m1)
    if slope < 1e-12:
        if low > 0.0 or high < 0.0:
            return count
        m0 = m1 = slope = 0.0
        low, high = -np.inf, np.inf
    if size <= 0.0:
        return count
    middle = m0 * cx + m1 * cy
    if radius < np.inf and low <= middle - slope * radius and high >= middle + slope * radius:  # all of the ellipse
        row = rows[count]
        row[0], row[1], row[2], row[3] = x0 + cx, y0 + cy, radius, CIRCLE
        if not is_circle:
            row[3], row[12], row[13] = CONIC, -1.0, 1.0
            _put_conic(row, conic, cx, cy)
        return count + 1

    # Clipped: a box along the axis and across it. Clipped quadrics are round about their axis, so A is diagonal there.
    u0, u1 = m0 / slope, m1 / slope
    begin, end = low / slope, high / slope
    across, side = _cut_across(conic, u0, u1)
    half = 1.0 / math.sqrt(across)  # a horizontal cylinder, whose slice is at most as wide as itself
    if radius < np.inf:
        begin, end = max(begin, u0 * cx + u1 * cy - radius), min(end, u0 * cx + u1 * cy + radius)
        half = math.sqrt(size / across)
    if begin < end:
        row = rows[count]
        px, py = u0 * (begin + end) / 2.0 - u1 * side, u1 * (begin + end) / 2.0 + u0 * side
        row[0], row[1] = x0 + px, y0 + py
        row[2] = min(radius + math.hypot(px - cx, py - cy), math.hypot((end - begin) / 2.0, half)) + 1e-9
        row[3] = CONIC
        _put_conic(row, conic, px, py)
        row[10], row[11], row[12], row[13] = m0, m1, low - m0 * px - m1 * py, high - m0 * px - m1 * py
        count += 1
    if q[14] > 0.0:
        count = _slice_caps(q, height, lean, _Axis(x0, y0, u0, u1, slope), rows, count)
    return count


@kernel
def _slice_caps(q, height, lean, axis, rows, count):
    """Write the chords of the flat end faces of a quadric whose centre is so high above the plane, m, and whose axis
    leans on its normal."""
    cap, u0, u1 = q[14], axis.u0, axis.u1
    for bound in (q[12], q[13]):
        rise = height + bound * lean  # of the disc's centre above the plane
        chord_distance = rise / axis.slope  # from the disc's centre to the chord, within the disc
        if abs(chord_distance) < cap:
            half = math.sqrt(cap * cap - chord_distance * chord_distance)
            chord_along = bound * axis.slope + chord_distance * lean
            px, py = axis.x + chord_along * u0, axis.y + chord_along * u1
            count = _put_segment(px - half * u1, py + half * u0, px + half * u1, py - half * u0, rows, count)
    return count


@leaf
def _put_conic(row, conic, px, py):
    """Write the conic's coefficients for d measured from (px, py)."""
    g0, g1 = conic.a00 * px + conic.a01 * py, conic.a01 * px + conic.a11 * py
    row[4], row[5], row[6] = conic.a00, conic.a01, conic.a11
    row[7], row[8] = conic.b0 + g0, conic.b1 + g1
    row[9] = conic.c + (2.0 * conic.b0 + g0) * px + (2.0 * conic.b1 + g1) * py
