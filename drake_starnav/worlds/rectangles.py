"""Covers the solid cells of a grid with few rectangles."""

import numpy as np
from numba import njit
from scipy import ndimage

SHELL = 3
"""Solid cells farther than this from the passable ones are out of sight, cells."""


def solid_rectangles(solid: np.ndarray, places: np.ndarray | None = None) -> np.ndarray:
    """Few rectangles whose union bounds the passable cells exactly as all solid cells do.

    Every solid cell at a passable one is covered, and no passable cell; rectangles may overlap. What is out of
    reach and sight is covered where this saves rectangles: solid cells behind others, and pockets.

    Args:
        solid: shape (ny, nx), bool. What lies beyond the grid is not covered.
        places: shape (k, 2), rows and columns of passable cells: what is joined to none over edges is out of reach.

    Returns:
        Shape (n, 4), int: first row, first column, end row, end column; the ends are exclusive.
    """
    solid = np.asarray(solid, dtype=bool)
    if places is not None:
        labels, _ = ndimage.label(~solid)
        solid = ~np.isin(labels, labels[tuple(places.T)])
    at_passable = ndimage.binary_dilation(~solid, ndimage.generate_binary_structure(2, 1))
    shell = ndimage.binary_dilation(~solid, np.ones((3, 3)), iterations=SHELL)
    behind, _ = ndimage.label(solid & ~shell)
    rim = np.concatenate((behind[0], behind[-1], behind[:, 0], behind[:, -1]))
    outside = np.isin(behind, np.unique(rim[rim > 0]))
    return _cover(solid & at_passable, solid & ~outside)


@njit(cache=True)
def _cover(required: np.ndarray, allowed: np.ndarray) -> np.ndarray:
    """Rectangles of allowed cells that cover all required ones, greedily, in the order of rows.

    At each required cell that is not covered yet the row of allowed cells through it grows up and down, and the
    column through it left and right; the one of the two that covers more stays.
    """
    ny, nx = required.shape
    open_ = required.copy()
    found = [(0, 0, 0, 0)][:0]
    for i in range(ny):
        for j in range(nx):
            if not open_[i, j]:
                continue
            best, best_count = (i, j, i + 1, j + 1), 0
            for rows_first in (True, False):
                i0, j0, i1, j1 = i, j, i + 1, j + 1
                for step in (0, 1):
                    if rows_first == (step == 0):
                        while j0 > 0 and allowed[i0:i1, j0 - 1].all():
                            j0 -= 1
                        while j1 < nx and allowed[i0:i1, j1].all():
                            j1 += 1
                    else:
                        while i0 > 0 and allowed[i0 - 1, j0:j1].all():
                            i0 -= 1
                        while i1 < ny and allowed[i1, j0:j1].all():
                            i1 += 1
                count = open_[i0:i1, j0:j1].sum()
                if count > best_count:
                    best, best_count = (i0, j0, i1, j1), count
            open_[best[0] : best[2], best[1] : best[3]] = False
            found.append(best)
    rectangles = np.empty((len(found), 4), np.int64)
    for k in range(len(found)):
        for n in range(4):
            rectangles[k, n] = found[k][n]
    return rectangles
