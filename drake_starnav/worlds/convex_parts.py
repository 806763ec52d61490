"""Cuts a simple polygon into convex pieces, the only prisms a collision engine knows.

Source: ear clipping (Meisters 1975), then merging across diagonals (Hertel and Mehlhorn 1983): at most four times
as many pieces as the fewest possible.
"""

import heapq
import math

import numpy as np
from numba import njit

from drake_starnav.errors import StarnavError, shown
from drake_starnav.geometry.polyline import simplified
from drake_starnav.worlds.world import FARTHEST

MOST_CORNERS = 20_000
"""Of a polygon: the time that cutting takes grows by the square of their number, and is a second for so many."""
EVEN = 1e-5
"""Corners no farther than this from the line between others count as straight, m; digitised outlines have many."""
_FLAT = 1e-12  # relative: a corner whose sine is smaller counts as straight
_EAR, _NO_EAR = -1, -2  # else the number of a corner that lies in the triangle


def convex_parts(polygon: np.ndarray) -> list[np.ndarray]:
    """Convex polygons that together cover a simple polygon, without overlap.

    Args:
        polygon: corners in either orientation, shape (k, 2), m. Repeated and straight corners are dropped, see `EVEN`.

    Returns:
        Counter-clockwise pieces, each of shape (n, 2); a convex polygon comes back whole.

    Raises:
        StarnavError: fewer than 3 corners or too many, corners that are not finite, no area, or edges that cross or
            touch.
    """
    corners = np.asarray(polygon, dtype=float)
    if corners.ndim != 2 or corners.shape[1] != 2 or len(corners) < 3 or not (abs(corners) <= FARTHEST).all():
        raise StarnavError(f"polygon is {shown(corners.tolist())}; allowed: at least 3 finite corners [x, y], m")
    if len(corners) > MOST_CORNERS:
        raise StarnavError(f"polygon has {len(corners)} corners; allowed: at most {MOST_CORNERS}")
    # about the first corner, so that a polygon far from the origin loses no digits
    origin = corners[0].copy()
    points = _without_straight_corners(corners - origin)
    if len(points) < 3:
        raise StarnavError(f"polygon {shown(corners.tolist())} has no area; allowed: corners not all on a line")
    points = evened(points)
    if fault := _fault(points):
        raise StarnavError(f"polygon {shown(corners.tolist())} {fault}; allowed: a simple polygon")
    if _area(points) < 0.0:
        points = points[::-1].copy()
    triangles = _clip_ears(points)
    if len(triangles) == 0:
        raise StarnavError("polygon has edges too close to one another to be cut; allowed: a simple polygon")
    return [points[piece] + origin for piece in _merge(points, triangles)]


def _fault(points: np.ndarray) -> str:
    """Why an outline is not a simple polygon, or an empty text."""
    return ("", "doubles back on itself", "meets itself")[_first_fault(points)]


@njit(cache=True)
def _cross(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> float:
    """Twice the signed area of the triangle a b c."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


@njit(cache=True)
def _turn(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> int:
    """1 if a b c turns left, -1 right, 0 straight on or straight back."""
    cross = _cross(a, b, c)
    scale = math.hypot(b[0] - a[0], b[1] - a[1]) * math.hypot(c[0] - b[0], c[1] - b[1])
    return 0 if abs(cross) <= _FLAT * scale else (1 if cross > 0.0 else -1)


def _area(points: np.ndarray) -> float:
    following = np.roll(points, -1, axis=0)
    return 0.5 * float(np.sum(points[:, 0] * following[:, 1] - points[:, 1] * following[:, 0]))


def _without_straight_corners(points: np.ndarray) -> np.ndarray:
    """The outline without corners that repeat the last one or lie on the way from the last to the next."""
    kept = list(points)
    k = 0
    while k < len(kept) and len(kept) > 2:
        a, b, c = kept[k - 1], kept[k], kept[(k + 1) % len(kept)]
        if _turn(a, b, c) == 0 and np.dot(b - a, c - b) >= 0.0:
            del kept[k]
            k = max(0, k - 1)
        else:
            k += 1
    return np.array(kept)


def evened(points: np.ndarray) -> np.ndarray:
    """The outline without corners that stick out by no more than `EVEN`; as it is, if hardly anything would be left.

    Args:
        points: corners of a polygon, shape (k, 2), m.
    """
    far = int(np.argmax(np.hypot(*(points - points[0]).T)))
    there, back = points[: far + 1], np.vstack((points[far:], points[:1]))
    kept = np.vstack((simplified(there, EVEN)[:-1], simplified(back, EVEN)[:-1]))
    return kept if len(kept) >= 3 else points


@njit(cache=True)
def _first_fault(points: np.ndarray) -> int:
    """2 if two edges cross or touch, except neighbours in their common corner; 1 if they lie on one another; else 0."""
    n = len(points)
    for i in range(n):
        a, b = points[i], points[(i + 1) % n]
        if _turn(points[i - 1], a, b) == 0:
            return 1
        left, right = min(a[0], b[0]), max(a[0], b[0])
        low, high = min(a[1], b[1]), max(a[1], b[1])
        for j in range(i + 2, n if i else n - 1):
            c, d = points[j], points[(j + 1) % n]
            if max(c[0], d[0]) < left or min(c[0], d[0]) > right or max(c[1], d[1]) < low or min(c[1], d[1]) > high:
                continue
            apart = _cross(a, b, c) * _cross(a, b, d) > 0.0 or _cross(c, d, a) * _cross(c, d, b) > 0.0
            if not apart:
                return 2
    return 0


@njit(cache=True)
def _clip_ears(points: np.ndarray) -> np.ndarray:
    """Triangles of a simple counter-clockwise polygon, as corner numbers counter-clockwise, shape (n - 2, 3).

    The next ear is always the one whose corner is least sharp, which keeps slivers away. What lies in the triangle of
    a corner that is no ear is noted, so that it is only looked at again once that is gone. None if no ear is found.
    """
    n = len(points)
    before, after = np.arange(n) - 1, np.arange(n) + 1
    before[0], after[n - 1] = n - 1, 0
    sine, state = np.empty(n), np.empty(n, np.int64)
    triangles = np.empty((n - 2, 3), np.int64)
    for k in range(n):
        sine[k], state[k] = _tip(points, k, before, after)
    first = 0
    for t in range(n - 3):
        best, k = -1, first
        for _ in range(n - t):
            if state[k] == _EAR and (best < 0 or sine[k] > sine[best]):
                best = k
            k = after[k]
        if best < 0:
            return triangles[:0]
        p, q = before[best], after[best]
        triangles[t] = (p, best, q)
        after[p], before[q] = q, p
        if best == first:
            first = q
        k = first
        for _ in range(n - t - 1):
            if k in (p, q) or state[k] == best:
                sine[k], state[k] = _tip(points, k, before, after)
            k = after[k]
    triangles[n - 3] = (first, after[first], after[after[first]])
    return triangles


@njit(cache=True)
def _tip(points: np.ndarray, tip: int, before: np.ndarray, after: np.ndarray) -> tuple[float, int]:
    """The sine of a corner, and `_EAR`, `_NO_EAR` or the number of a corner in its triangle."""
    a, b, c = points[before[tip]], points[tip], points[after[tip]]
    cross = _cross(a, b, c)
    sine = cross / (math.hypot(b[0] - a[0], b[1] - a[1]) * math.hypot(c[0] - b[0], c[1] - b[1]))
    if cross <= 0.0:
        return sine, _NO_EAR
    k = after[after[tip]]
    while k != before[tip]:
        p = points[k]
        if _cross(a, b, p) >= 0.0 and _cross(b, c, p) >= 0.0 and _cross(c, a, p) >= 0.0:
            return sine, k
        k = after[k]
    return sine, _EAR


def _merge(points: np.ndarray, triangles: np.ndarray) -> list[list[int]]:
    """The triangles joined across common edges as long as the pieces stay convex.

    An edge that cannot go now can never go: what a piece gains makes its corners no narrower. So each is tried once,
    in the order of the triangles. Edge 3 t + k leads from corner k of triangle t to the next.
    """
    start = [int(corner) for corner in triangles.ravel()]
    after = [edge + 1 if edge % 3 < 2 else edge - 2 for edge in range(len(start))]
    before = [edge - 1 if edge % 3 else edge + 2 for edge in range(len(start))]
    edges = {(start[edge], start[after[edge]]): edge for edge in range(len(start))}
    twin = [edges.get((start[after[edge]], start[edge]), -1) for edge in range(len(start))]
    gone, pieces = [False] * len(triangles), []
    for t in range(len(triangles)):
        if gone[t]:
            continue
        begin = 3 * t
        waiting = [(twin[edge] // 3, edge) for edge in range(3 * t, 3 * t + 3) if twin[edge] // 3 > t]
        heapq.heapify(waiting)
        while waiting:
            other, edge = heapq.heappop(waiting)
            back = twin[edge]
            if gone[other] or not all(
                _turn(points[start[before[one]]], points[start[one]], points[start[after[after_it]]]) >= 0
                for one, after_it in ((edge, after[back]), (back, after[edge]))
            ):
                continue
            gone[other], begin = True, after[edge]
            for new in (after[back], before[back]):
                if twin[new] // 3 > t:
                    heapq.heappush(waiting, (twin[new] // 3, new))
            for one, following in ((before[edge], after[back]), (before[back], after[edge])):
                after[one], before[following] = following, one
        piece, edge = [start[begin]], after[begin]
        while edge != begin:
            piece.append(start[edge])
            edge = after[edge]
        pieces.append(piece)
    return pieces
