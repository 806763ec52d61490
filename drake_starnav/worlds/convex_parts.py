"""Cuts a simple polygon into convex pieces, the only prisms a collision engine knows.

Source: ear clipping (Meisters 1975), then merging across diagonals (Hertel and Mehlhorn 1983): at most four times
as many pieces as the fewest possible.
"""

import numpy as np

from drake_starnav.errors import StarnavError, shown

_FLAT = 1e-12  # relative: a corner whose sine is smaller counts as straight


def convex_parts(polygon: np.ndarray) -> list[np.ndarray]:
    """Convex polygons that together cover a simple polygon, without overlap.

    Args:
        polygon: corners in either orientation, shape (k, 2), m. Repeated and straight corners are dropped.

    Returns:
        Counter-clockwise pieces, each of shape (n, 2); a convex polygon comes back whole.

    Raises:
        StarnavError: fewer than 3 corners, corners that are not finite, no area, or edges that cross or touch.
    """
    corners = np.asarray(polygon, dtype=float)
    if corners.ndim != 2 or corners.shape[1] != 2 or len(corners) < 3 or not np.isfinite(corners).all():
        raise StarnavError(f"polygon is {shown(corners.tolist())}; allowed: at least 3 finite corners [x, y]")
    # about the first corner, so that a polygon far from the origin loses no digits
    origin = corners[0].copy()
    points = _without_straight_corners(corners - origin)
    if len(points) < 3:
        raise StarnavError(f"polygon {shown(corners.tolist())} has no area; allowed: corners not all on a line")
    _check_simple(points, corners)
    if _area(points) < 0.0:
        points = points[::-1]
    pieces = _merge(points, _clip_ears(points))
    return [points[piece] + origin for piece in pieces]


def _cross(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> float:
    """Twice the signed area of the triangle a b c."""
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def _turn(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> int:
    """1 if a b c turns left, -1 right, 0 straight on or straight back."""
    cross = _cross(a, b, c)
    scale = np.hypot(*(b - a)) * np.hypot(*(c - b))
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


def _check_simple(points: np.ndarray, corners: np.ndarray) -> None:
    """Raise if two edges cross or touch, except neighbours in their common corner."""
    n = len(points)
    for i in range(n):
        a, b = points[i], points[(i + 1) % n]
        if _turn(points[i - 1], a, b) == 0:
            raise StarnavError(f"polygon {shown(corners.tolist())} doubles back on itself; allowed: a simple polygon")
        for j in range(i + 2, n if i else n - 1):
            if _touch(a, b, points[j], points[(j + 1) % n]):
                raise StarnavError(f"polygon {shown(corners.tolist())} meets itself; allowed: a simple polygon")


def _touch(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> bool:
    """Whether the closed segments a b and c d have a point in common."""
    if (np.maximum(a, b) < np.minimum(c, d)).any() or (np.maximum(c, d) < np.minimum(a, b)).any():
        return False
    apart = _cross(a, b, c) * _cross(a, b, d) > 0.0 or _cross(c, d, a) * _cross(c, d, b) > 0.0
    return not apart


def _clip_ears(points: np.ndarray) -> list[list[int]]:
    """Triangles, as corner numbers counter-clockwise, of a simple counter-clockwise polygon."""
    ring = list(range(len(points)))
    triangles = []
    while len(ring) > 3:
        ear = _roundest_ear(points, ring)
        triangles.append([ring[ear - 1], ring[ear], ring[(ear + 1) % len(ring)]])
        del ring[ear]
    return [*triangles, ring]


def _roundest_ear(points: np.ndarray, ring: list[int]) -> int:
    """The place in the ring of the ear whose corner is least sharp, which keeps slivers away."""
    best, best_sine = -1, -np.inf
    for k in range(len(ring)):
        before, tip, after = ring[k - 1], ring[k], ring[(k + 1) % len(ring)]
        a, b, c = points[before], points[tip], points[after]
        cross = _cross(a, b, c)
        sine = cross / (np.hypot(*(b - a)) * np.hypot(*(c - b)))
        if cross <= 0.0 or sine <= best_sine:
            continue
        others = points[[n for n in ring if n not in (before, tip, after)]]
        inside = np.ones(len(others), bool)
        for p, q in ((a, b), (b, c), (c, a)):
            inside &= (q[0] - p[0]) * (others[:, 1] - p[1]) - (q[1] - p[1]) * (others[:, 0] - p[0]) >= 0.0
        if not inside.any():
            best, best_sine = k, sine
    if best < 0:
        raise StarnavError("polygon has edges too close to one another to be cut; allowed: a simple polygon")
    return best


def _merge(points: np.ndarray, pieces: list[list[int]]) -> list[list[int]]:
    """The pieces joined across common edges as long as they stay convex."""
    merged = True
    while merged:
        merged = False
        for i in range(len(pieces)):
            for j in range(i + 1, len(pieces)):
                union = _union_if_convex(points, pieces[i], pieces[j])
                if union:
                    pieces = [*pieces[:i], union, *pieces[i + 1 : j], *pieces[j + 1 :]]
                    merged = True
                    break
            if merged:
                break
    return pieces


def _union_if_convex(points: np.ndarray, one: list[int], other: list[int]) -> list[int] | None:
    for k in range(len(one)):
        a, b = one[k], one[(k + 1) % len(one)]
        if a not in other or other[other.index(a) - 1] != b:
            continue
        # one: ... a -> b ..., other: ... b -> a ...; walk one from b round to a, then other from a round to b
        start = other.index(a)
        union = one[k + 1 :] + one[: k + 1] + [other[(start + n) % len(other)] for n in range(1, len(other) - 1)]
        n = len(union)
        convex = all(_turn(points[union[i - 1]], points[union[i]], points[union[(i + 1) % n]]) >= 0 for i in range(n))
        return union if convex else None
    return None
