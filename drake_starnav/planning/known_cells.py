"""Which cells of the cost-to-go are known: how many regions cover each, counted anew where a region changes."""

import math
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.planning.distance_grid import STRIDE
from drake_starnav.surroundings.region_union import RegionUnion, covers, find_samples_beside

BLOCK = 4
"""Cells along a block: most blocks that a region touches lie inside it, which is told at once."""
OFF = 0.5 * (STRIDE - 1) / STRIDE
"""Cell p has its middle at p + OFF, in cells."""


class KnownCells(NamedTuple):
    """How many regions cover the middles of cells of W. Immutable.

    Attributes:
        first: the block that comes first, for both axes, shape (2,); it begins with cell BLOCK * `first`.
        whole: how many regions cover all of a block, shape (I, J), uint16.
        part: how many cover a cell, but not all of its block, shape (BLOCK I, BLOCK J), uint16.
    """

    first: np.ndarray = np.zeros(2, np.int64)
    whole: np.ndarray = np.zeros((0, 0), np.uint16)
    part: np.ndarray = np.zeros((0, 0), np.uint16)

    def update_counts(self, cell: float, regions: RegionUnion, after: np.ndarray, bounds: np.ndarray) -> "KnownCells":
        """Return the counts after regions have changed.

        Args:
            cell: size of a cell, m.
            regions: those that have changed, as they were; of new ones, all samples are 0.
            after: their samples now, shape (n, M), m; 0 of those that are gone.
            bounds: corners of a box that holds the regions, shape (2, 2), W, m.
        """
        low, high = np.floor(bounds / (BLOCK * cell)).astype(np.int64) + ((0,), (1,))
        first = self.first if self.whole.size else low
        last = first + self.whole.shape
        low, high = np.minimum(low, first), np.maximum(high, last)
        border = np.stack((first - low, high - last), axis=1)
        out = KnownCells(low, np.pad(self.whole, border), np.pad(self.part, BLOCK * border))
        _recount(out, cell, regions.center, regions.bearing_0, regions.values, after)
        return out


@kernel
def _recount(known, cell, center, bearing_0, before, after):
    """Count anew, of each region, the blocks about those samples that have changed."""
    first, whole, part = known
    samples, side, half = after.shape[1], BLOCK * cell, math.sqrt(0.5) * (BLOCK - 1) * cell + 1e-9
    turn, middle = 2.0 * math.pi / samples, 0.5 * (BLOCK - 1) * cell
    for k in range(len(center)):
        left, right, bottom, top = np.inf, -np.inf, np.inf, -np.inf
        for m in range(samples):
            if before[k, m] != after[k, m]:
                for n in range(m - 1, m + 2):
                    u, v = math.cos(bearing_0[k] + n * turn), math.sin(bearing_0[k] + n * turn)
                    for r in (before[k, m], after[k, m]):
                        left, right = min(left, r * u), max(right, r * u)
                        bottom, top = min(bottom, r * v), max(top, r * v)
        if left > right:
            continue
        x, y = center[k, 0] / side - first[0], center[k, 1] / side - first[1]
        for i in range(max(int(x + left / side - 1.0), 0), min(int(x + right / side + 2.0), whole.shape[0])):
            for j in range(max(int(y + bottom / side - 1.0), 0), min(int(y + top / side + 2.0), whole.shape[1])):
                x0, y0 = ((i + first[0]) * BLOCK + OFF) * cell, ((j + first[1]) * BLOCK + OFF) * cell
                dx, dy = x0 + middle - center[k, 0], y0 + middle - center[k, 1]
                away = math.hypot(dx, dy)
                at, _ = find_samples_beside(bearing_0[k], samples, dx, dy)
                width = int(1.1 * half / away / turn) + 1 if away > 2.0 * half else samples // 2
                differs, least, most, least_now, most_now = False, np.inf, 0.0, np.inf, 0.0
                for n in range(at - width, at + width + 2):
                    r, r_now = before[k, n % samples], after[k, n % samples]
                    differs |= r != r_now
                    least, most = min(least, r), max(most, r)
                    least_now, most_now = min(least_now, r_now), max(most_now, r_now)
                if not differs or max(most, most_now) < away - half:
                    continue
                was_whole, is_whole = least > away + half, least_now > away + half
                whole[i, j] += np.int64(is_whole) - np.int64(was_whole)
                for a in range(0 if was_whole and is_whole else BLOCK):
                    for b in range(BLOCK):
                        u, v = x0 + a * cell, y0 + b * cell
                        if most > 0.0 and not was_whole and covers(center, bearing_0, before, k, u, v, 0.0):
                            part[i * BLOCK + a, j * BLOCK + b] -= 1
                        if most_now > 0.0 and not is_whole and covers(center, bearing_0, after, k, u, v, 0.0):
                            part[i * BLOCK + a, j * BLOCK + b] += 1
