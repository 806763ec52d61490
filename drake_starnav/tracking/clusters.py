"""Clusters of hits that may be of one moving obstacle, and discs that fit them. Lengths are of persons: nature."""

import math

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.lidar.laser_scan import HIT
from drake_starnav.tracking.surfaces import continuing_beams, run_chord, runs

FEWEST_BEAMS = 2
"""Clusters of fewer hits are not tracked."""
PARTING_HEIGHT = 0.08
"""A peak of the range by more than this, m, separates the hits before it from those after it."""
SMALLEST_RADIUS = 0.08
"""Smallest radius of an obstacle, m."""
FIT_ROUNDS = 4
FIT_PRIOR = 0.05
"""Rounds of the fit of a disc to hits, and the weight of the predicted centre in it, in hits."""


@kernel
def clusters(beams, doubtful, may_start, largest):
    """Runs of connected hits that may be of one moving obstacle, as from `runs`.

    Where two discs touch or overlap, the range has a peak between them: there the run is split. Of a run that is still
    too wide, the hits that certainly stand are left out.

    Args:
        beams: of a scan.
        doubtful, may_start: which of them hit what does not certainly stand, or is small enough to move, shape (n,).
        largest: radius of the largest obstacle that moves, m.
    """
    n, hits = len(doubtful), beams.kinds & HIT != 0
    continues, wide = continuing_beams(beams, hits), np.zeros(n, np.bool_)
    out, found = np.empty((2 * n, 2), np.int64), 0
    for narrow_only, chosen in ((False, (doubtful | may_start) & hits), (True, doubtful & hits)):
        for first, count in _parted(beams.distances, runs(chosen & (wide | (not narrow_only)), continues)):
            if run_chord(beams.distances, beams.increment, first, count) > 2.0 * largest:
                for k in range(first, first + count):
                    wide[k % n] = True
            elif count >= FEWEST_BEAMS:
                out[found, 0], out[found, 1] = first, count
                found += 1
    return out[:found].copy()


@kernel
def _parted(distance, whole):
    """Runs (k, 2), split at the peaks of the range."""
    n = len(distance)
    out, found, waiting = np.empty((n, 2), np.int64), 0, [(0, 0)][:0]
    left, right = np.empty(n), np.empty(n)
    for first, count in whole:
        waiting.append((first, count))
        while waiting:
            begin, size = waiting.pop()
            highest, after = -np.inf, 0
            for i in range(size):
                d = distance[(begin + i) % n]
                left[i] = min(left[i - 1], d) if i else d
            for i in range(size - 1, -1, -1):
                d = distance[(begin + i) % n]
                right[i] = min(right[i + 1], d) if i < size - 1 else d
                if d - max(left[i], right[i]) >= highest:
                    highest, after = d - max(left[i], right[i]), i + 1
            if size >= 2 * FEWEST_BEAMS and highest >= PARTING_HEIGHT:
                waiting.append(((begin + after) % n, size - after))
                waiting.append((begin, after))
            else:
                out[found, 0], out[found, 1] = begin, size
                found += 1
    return out[:found]


@kernel
def first_disc(beams, run, points, place, largest):
    """Centre (x, y) and radius of a disc as a cluster alone shows it, m, and whether both its sides are in view.

    A disc at least distance d that spans the angle 2 alpha has radius d sin(alpha) / (1 - sin(alpha)). A side is
    out of view where something nearer hides it, or where it would be out of the lidar's range.

    Args:
        beams: of a scan taken at `place`, (x, y), m.
        run: the cluster, one of `clusters`.
        points: where each beam ends, shape (n, 2), m.
        largest: greatest radius, m.
    """
    distance, n, (first, count) = beams.distances, len(points), run
    nearest = least_distance(distance, run)
    sine = min(math.sin(min(0.5 * count * beams.increment, 1.2)), 0.85)
    radius = min(max(nearest * sine / (1.0 - sine), SMALLEST_RADIUS), largest)
    one, other = points[(first + (count - 1) // 2) % n], points[(first + count // 2) % n]
    mx, my = one[0] + other[0] - 2.0 * place[0], one[1] + other[1] - 2.0 * place[1]
    away = max(math.hypot(mx, my), 1e-9)
    x, y = place[0] + (nearest + radius) * (mx / away), place[1] + (nearest + radius) * (my / away)
    before, last, after = (first - 1) % n, (first + count - 1) % n, (first + count) % n
    bare = distance[before] > distance[first] and distance[after] > distance[last]
    return x, y, radius, bare and nearest + radius < beams.range_max


@kernel
def least_distance(distance, run):
    """The least distance of the beams of a run, m."""
    first, count = run
    least = np.inf
    for k in range(first, first + count):
        least = min(least, distance[k % len(distance)])
    return least


@kernel
def partners(discs, places, gates):
    """The track that each disc continues, the nearest pairs first, shape (c,); -1 for none.

    No track, predicted at a place of (n, 2), continues with a disc, x and y of (c, 2), beyond its gate; W, m.
    """
    tracks = len(places)
    apart, partner, taken = np.full(len(discs) * tracks, np.inf), np.full(len(discs), -1), np.zeros(tracks, np.bool_)
    for c in range(len(discs)):
        for k in range(tracks):
            away = math.hypot(discs[c, 0] - places[k, 0], discs[c, 1] - places[k, 1])
            if away < gates[k]:
                apart[c * tracks + k] = away
    for pair in np.argsort(apart, kind="mergesort"):
        c, k = pair // tracks, pair % tracks
        if apart[pair] < np.inf and partner[c] < 0 and not taken[k]:
            partner[c], taken[k] = k, True
    return partner


@kernel
def fitted_radius(points, start, radius, weight):
    """The radius of the disc that fits points on its boundary, by Gauss-Newton from a centre and a radius.

    The start counts as much as FIT_PRIOR hits, the radius as much as `weight` of them: a short arc says little.
    """
    x, y, r = start[0], start[1], radius
    normal, right, row = np.empty((3, 3)), np.empty(3), np.empty(3)
    for _ in range(FIT_ROUNDS):
        normal[:] = 0.0
        normal[0, 0], normal[1, 1], normal[2, 2] = FIT_PRIOR, FIT_PRIOR, weight
        right[0], right[1] = FIT_PRIOR * (start[0] - x), FIT_PRIOR * (start[1] - y)
        right[2] = weight * (radius - r)
        for k in range(len(points)):
            dx, dy = x - points[k, 0], y - points[k, 1]
            away = max(math.hypot(dx, dy), 1e-6)
            row[0], row[1], row[2] = dx / away, dy / away, -1.0
            for i in range(3):
                right[i] -= (away - r) * row[i]
                for j in range(3):
                    normal[i, j] += row[i] * row[j]
        step = np.linalg.solve(normal, right)
        x, y, r = x + step[0], y + step[1], r + step[2]
    return r


@kernel
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
