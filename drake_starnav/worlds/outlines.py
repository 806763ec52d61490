"""Outlines of the polygons that stand in worlds, each of shape (k, 2), counter-clockwise; and few for many cells."""

import numpy as np
from scipy import ndimage

from drake_starnav.geometry.compiled import kernel

WALL = 0.1
"""Thickness of walls in corridors and rooms, m."""
SHELL = 3
"""Solid cells farther than this from the passable ones are out of sight, cells."""


def make_rectangle(x_min: float, y_min: float, x_max: float, y_max: float) -> np.ndarray:
    """An axis-parallel rectangle, shape (4, 2), m."""
    return np.array([(x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max)])


def make_trap(length: float, depth: float, thickness: float, arms: int) -> np.ndarray:
    """A straight wall, an L or a U (0, 1 or 2 arms) as one polygon, shape (k, 2), m.

    The spine of that length lies along y with its middle in the origin; arms reach a depth along +x, the first from its
    lower end, the second from its upper end.
    """
    half = thickness / 2.0
    outer, inner = length / 2.0 + half, length / 2.0 - half
    if arms == 0:
        return make_rectangle(-half, -length / 2.0, half, length / 2.0)
    corners = [(-half, -outer), (depth, -outer), (depth, -inner), (half, -inner)]
    if arms == 1:
        corners += [(half, length / 2.0), (-half, length / 2.0)]
    else:
        corners += [(half, inner), (depth, inner), (depth, outer), (-half, outer)]
    return np.array(corners)


def place(outline: np.ndarray, position: np.ndarray | tuple[float, float], angle: float) -> np.ndarray:
    """The outline turned by `angle` (rad) about its origin, then moved by `position` (m), shape (k, 2)."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return outline @ np.array([[cosine, sine], [-sine, cosine]]) + np.asarray(position)


def find_solid_rectangles(solid: np.ndarray, places: np.ndarray | None = None) -> np.ndarray:
    """Few rectangles whose union bounds the passable cells exactly as all solid cells do.

    Every solid cell at a passable one is covered, and no passable cell; rectangles may overlap. What is out of
    reach and sight is covered where this saves rectangles: solid cells behind others, and pockets.

    Cells are of shape (ny, nx), bool; what is not joined over edges to one of the passable places (k, 2), rows and
    columns, is out of reach. Rectangles, shape (n, 4), are first row, first column, end row, end column; the ends are
    exclusive.
    """
    solid = np.asarray(solid, dtype=bool)
    if places is not None:
        labels, _ = ndimage.label(~solid)
        solid = ~np.isin(labels, labels[tuple(places.T)])
    at_passable = ndimage.binary_dilation(~solid, ndimage.generate_binary_structure(2, 1))
    shell = ndimage.binary_dilation(~solid, np.ones((3, 3)), iterations=SHELL)
    background_labels, _ = ndimage.label(solid & ~shell)
    rim = np.concatenate((background_labels[[0, -1]].ravel(), background_labels[:, [0, -1]].ravel()))
    is_outside = np.isin(background_labels, np.unique(rim[rim > 0]))
    return _cover(solid & at_passable, solid & ~is_outside)


@kernel
def _cover(required_cells: np.ndarray, allowed_cells: np.ndarray) -> np.ndarray:
    """Rectangles of allowed cells that cover all required ones, greedily, in the order of rows.

    At each required cell that is not covered yet the row of allowed cells through it grows up and down, and the
    column through it left and right; the one of the two that covers more stays.
    """
    ny, nx = required_cells.shape
    open_ = required_cells.copy()
    found_boxes = [(0, 0, 0, 0)][:0]
    for i in range(ny):
        for j in range(nx):
            if not open_[i, j]:
                continue
            best, best_count = (i, j, i + 1, j + 1), 0
            for rows_first in (True, False):
                i0, j0, i1, j1 = i, j, i + 1, j + 1
                for step in (0, 1):
                    if rows_first == (step == 0):
                        while j0 > 0 and allowed_cells[i0:i1, j0 - 1].all():
                            j0 -= 1
                        while j1 < nx and allowed_cells[i0:i1, j1].all():
                            j1 += 1
                    else:
                        while i0 > 0 and allowed_cells[i0 - 1, j0:j1].all():
                            i0 -= 1
                        while i1 < ny and allowed_cells[i1, j0:j1].all():
                            i1 += 1
                count = open_[i0:i1, j0:j1].sum()
                if count > best_count:
                    best, best_count = (i0, j0, i1, j1), count
            open_[best[0] : best[2], best[1] : best[3]] = False
            found_boxes.append(best)
    rectangles = np.empty((len(found_boxes), 4), np.int64)
    for k in range(len(found_boxes)):
        for n in range(4):
            rectangles[k, n] = found_boxes[k][n]
    return rectangles
