"""Hits as chords: the stretches of surface between neighbouring hits, and what they hide from the lidar."""

import math
from typing import NamedTuple

import numpy as np

from drake_starnav.lidar.field_of_view import FieldOfView
from drake_starnav.regions.bearing_hits import CONNECTED_CHORD

FILLED = 0.003
"""So near to each other are the places that stand for a surface behind a robot, and so large are their cells, m: a
corner that keeps 7 mm, the least margin of polygons, from places at most 12 mm apart gets to no surface between."""


class Chords(NamedTuple):
    """Surfaces that scans have hit, and what the last one could not see behind them; W, m.

    Attributes:
        ends: shape (k, 4): x, y of both ends; the same twice for a hit without a neighbour on its surface.
        shades: shape (k,), whether all that lies behind the chord, as seen from `center`, counts as occupied, too.
        center: of the last scan, shape (2,).
    """

    ends: np.ndarray
    shades: np.ndarray
    center: np.ndarray


def chords(hits: np.ndarray, newest: int, behind: np.ndarray, center: np.ndarray) -> Chords:
    """Hits of the last scans as chords.

    Args:
        hits: shape (n, 2), W, m; of each scan in the order of its beams, the last scan's at the end.
        newest: index of the first hit of the last scan, which alone shades.
        behind: hits of earlier scans, which no later one has looked for, shape (m, 2), W, m.
        center: of the last scan, shape (2,), W, m.
    """
    latest = hits[newest:] - center
    order = np.argsort(np.arctan2(latest[:, 1], latest[:, 0]), kind="stable")
    earlier = _joined(hits[:newest], False)
    last = _joined(hits[newest:][order], True)
    lone = np.hstack((behind, behind))
    shades = np.zeros(len(earlier) + len(lone) + len(last), np.bool_)
    shades[len(earlier) + len(lone) :] = True
    return Chords(np.vstack((earlier, lone, last)), shades, np.array(center, dtype=float))


def hits_behind(behind: np.ndarray, ends: np.ndarray, view: FieldOfView, pose: np.ndarray, reach: float) -> np.ndarray:
    """Surfaces near a robot on which its lidar does not look, as places thinned out, shape (m, 2), W, m.

    Args:
        behind: those before the scan, shape (k, 2), W, m.
        ends: of chords that earlier scans have hit, shape (n, 4), W, m.
        view: of the scan.
        pose: (x, y, yaw) of the lidar at the scan, W.
        reach: farther places are forgotten, m.
    """
    near = np.hypot(*(ends[:, :2] - pose[:2]).T) < reach + CONNECTED_CHORD
    known = np.vstack((behind, _filled(ends[near])))
    away = known - pose[:2]
    bearing = np.arctan2(away[:, 1], away[:, 0]) - pose[2] - view.angle_min
    unseen = np.mod(bearing, 2.0 * math.pi) > view.span
    known = known[unseen & (np.hypot(*away.T) < reach)]
    return known[thinned(known, FILLED)]


def thinned(places: np.ndarray, cell: float) -> np.ndarray:
    """Indices of the first of some places (n, 2) in each cell of a size (m), in order."""
    cells = np.floor(places / cell).astype(np.int64)
    _, first = np.unique(cells @ (1 << 32, 1), return_index=True)
    return np.sort(first)


def _filled(ends: np.ndarray) -> np.ndarray:
    """Places on chords (n, 4), at most FILLED apart on each, both ends included, shape (m, 2)."""
    along = ends[:, 2:] - ends[:, :2]
    steps = np.ceil(np.hypot(*along.T) / FILLED).astype(np.int64)
    chord = np.repeat(np.arange(len(ends)), steps + 1)
    step = np.arange(len(chord)) - np.repeat(np.cumsum(steps + 1) - steps - 1, steps + 1)
    return ends[chord, :2] + (step / np.maximum(steps[chord], 1))[:, None] * along[chord]


def _joined(points: np.ndarray, circular: bool) -> np.ndarray:
    """Chords between successive points (n, 2) on one surface, and points without such a neighbour; shape (k, 4)."""
    after = np.roll(points, -1, axis=0)
    linked = ((after - points) ** 2).sum(axis=1) < CONNECTED_CHORD * CONNECTED_CHORD
    linked[-1:] &= circular
    alone = ~(linked | np.roll(linked, 1))
    return np.hstack((points, np.where(linked[:, None], after, points)))[linked | alone]
