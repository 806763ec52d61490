"""Outlines of the polygons that stand in generated worlds, each of shape (k, 2), counter-clockwise."""

import numpy as np

WALL = 0.1
"""Thickness of walls in corridors and rooms, m."""


def rectangle(x_min: float, y_min: float, x_max: float, y_max: float) -> np.ndarray:
    """An axis-parallel rectangle, shape (4, 2), m."""
    return np.array([(x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max)])


def trap(length: float, depth: float, thickness: float, arms: int) -> np.ndarray:
    """A straight wall, an L or a U (0, 1 or 2 arms) as one polygon, shape (k, 2), m.

    The spine of that length lies along y with its middle in the origin; arms reach a depth along +x, the first from its
    lower end, the second from its upper end.
    """
    half = thickness / 2.0
    outer, inner = length / 2.0 + half, length / 2.0 - half
    if arms == 0:
        return rectangle(-half, -length / 2.0, half, length / 2.0)
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
