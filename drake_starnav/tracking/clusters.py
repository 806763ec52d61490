"""Clusters of hits that may be of one moving obstacle, and the discs that fit them."""

import math

import numpy as np
from numba import njit

from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.tracking.surfaces import joined, runs, scan_chord

FEWEST_BEAMS = 2
"""Clusters of fewer hits are not tracked."""
PARTING_HEIGHT = 0.08
"""A peak of the range by more than this, m, separates the hits before it from those after it."""
SMALLEST_RADIUS = 0.08
"""Smallest radius of an obstacle, m."""
FIT_ROUNDS = 4
FIT_PRIOR = 0.05
"""Rounds of the fit of a disc to hits, and the weight of the predicted centre in it, in hits."""


def clusters(scan: LaserScan, doubtful: np.ndarray, may_start: np.ndarray, largest: float) -> list[np.ndarray]:
    """Runs of connected hits that may be of one moving obstacle: beam numbers, in order.

    Where two discs touch or overlap, the range has a peak between them: there the run is split. Of a run that is still
    too wide, the hits that certainly stand are left out.

    Args:
        scan: in S.
        doubtful, may_start: which beams hit what does not certainly stand, or is small enough to move, shape (n,).
        largest: radius of the largest obstacle that moves, m.
    """
    narrow, wide = [], np.zeros(len(doubtful), bool)
    for run in _split(scan, doubtful | may_start):
        if scan_chord(scan, run) <= 2.0 * largest:
            narrow.append(run)
        else:
            wide[run] = True
    narrow += [run for run in _split(scan, doubtful & wide) if scan_chord(scan, run) <= 2.0 * largest]
    return [run for run in narrow if len(run) >= FEWEST_BEAMS]


def _split(scan: LaserScan, chosen: np.ndarray) -> list[np.ndarray]:
    continues = joined(scan.distances, scan.hits, scan.angle_increment, scan.full_circle)
    return [part for run in runs(chosen & scan.hits, continues) for part in _parts(run, scan.distances[run])]


def _parts(run: np.ndarray, distance: np.ndarray) -> list[np.ndarray]:
    if len(run) < 2 * FEWEST_BEAMS:
        return [run]
    left, right = np.minimum.accumulate(distance), np.minimum.accumulate(distance[::-1])[::-1]
    height = distance - np.maximum(left, right)
    peak = int(np.argmax(height))
    if height[peak] < PARTING_HEIGHT:
        return [run]
    after = peak + 1
    return _parts(run[:after], distance[:after]) + _parts(run[after:], distance[after:])


def first_disc(
    scan: LaserScan, run: np.ndarray, points: np.ndarray, place: np.ndarray, largest: float
) -> tuple[float, float, float, bool]:
    """Centre (x, y) and radius of a disc as a cluster alone shows it, m, and whether both its sides are in view.

    A disc at least distance d that spans the angle 2 alpha has radius d sin(alpha) / (1 - sin(alpha)). A side is
    out of view where something nearer hides it, or where it would be out of the lidar's range.
    """
    n = len(scan.ranges)
    nearest = float(scan.distances[run].min())
    sine = min(math.sin(min(0.5 * len(run) * scan.angle_increment, 1.2)), 0.85)
    radius = min(max(nearest * sine / (1.0 - sine), SMALLEST_RADIUS), largest)
    middle = points[(len(run) - 1) // 2] + points[len(run) // 2] - 2.0 * place
    towards = middle / max(math.hypot(*middle), 1e-9)
    x, y = place + (nearest + radius) * towards
    before, after = (run[0] - 1) % n, (run[-1] + 1) % n
    distance = scan.distances
    bare = distance[before] > distance[run[0]] and distance[after] > distance[run[-1]]
    whole = bool(bare and nearest + radius < scan.range_max)
    return float(x), float(y), radius, whole


def partners(discs: list[tuple[float, float, float, bool]], places: np.ndarray, gates: np.ndarray) -> dict[int, int]:
    """Track -> cluster, the nearest pairs first.

    No track, predicted at a place of (n, 2), continues with a disc as from `first_disc` beyond its gate; W, m.
    """
    pairs = []
    for c, (x, y, _, _) in enumerate(discs):
        for k, (place, gate) in enumerate(zip(places, gates, strict=True)):
            apart = math.hypot(x - place[0], y - place[1])
            if apart < gate:
                pairs.append((apart, c, k))
    partner: dict[int, int] = {}
    for _, c, k in sorted(pairs):
        if c not in partner.values():
            partner.setdefault(k, c)
    return partner


@njit(cache=True)
def fitted_radius(points, start, radius, weight):
    """The radius of the disc that fits points on its boundary, by Gauss-Newton from a centre and a radius.

    The start counts as much as FIT_PRIOR hits, the radius as much as `weight` of them: a short arc says little.
    """
    x, y, r = start[0], start[1], radius
    for _ in range(FIT_ROUNDS):
        normal = np.diag(np.array((FIT_PRIOR, FIT_PRIOR, weight)))
        right = np.array((FIT_PRIOR * (start[0] - x), FIT_PRIOR * (start[1] - y), weight * (radius - r)))
        for k in range(len(points)):
            dx, dy = x - points[k, 0], y - points[k, 1]
            away = max(math.hypot(dx, dy), 1e-6)
            row = np.array((dx / away, dy / away, -1.0))
            normal += np.outer(row, row)
            right -= (away - r) * row
        step = np.linalg.solve(normal, right)
        x, y, r = x + step[0], y + step[1], r + step[2]
    return r


@njit(cache=True)
def fitted_center(points, start, radius):
    """The centre of the disc of a given radius that fits points on its boundary, by Gauss-Newton from `start`."""
    x, y = start[0], start[1]
    for _ in range(FIT_ROUNDS):
        a = b = 0.0
        c = d = FIT_PRIOR
        e = 0.0
        a += FIT_PRIOR * (start[0] - x)
        b += FIT_PRIOR * (start[1] - y)
        for k in range(len(points)):
            dx, dy = x - points[k, 0], y - points[k, 1]
            away = max(math.hypot(dx, dy), 1e-6)
            ux, uy = dx / away, dy / away
            c += ux * ux
            d += uy * uy
            e += ux * uy
            a -= ux * (away - radius)
            b -= uy * (away - radius)
        det = c * d - e * e
        x += (d * a - e * b) / det
        y += (c * b - e * a) / det
    return np.array((x, y))
