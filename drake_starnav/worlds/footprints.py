"""What solids bar to a robot that drives on the floor: the shadow of their part between two heights."""

import itertools
import math

import numpy as np
from scipy.spatial import ConvexHull, QhullError

_SIDE_COUNT = 96  # sides of the polyhedra that stand for round solids: they are up to 0.05 % too wide


def make_convex_footprint(vertices: np.ndarray, low: float, high: float) -> np.ndarray | None:
    """The shadow on the floor of a convex solid's part between two heights, exactly.

    The solid is the convex hull of vertices (n, 3), m; its shadow is a convex polygon (k, 2), counterclockwise; None
    if nothing is between the heights, or no area.
    """
    z = vertices[:, 2]
    shadow_points = [vertices[(z >= low) & (z <= high), :2]]
    for height in (low, high):
        above, below = vertices[z > height], vertices[z < height]
        # Crossings of diagonals lie inside the section, those of edges are its corners: no need to know the edges.
        height_shares = (above[:, None, 2] - height) / (above[:, None, 2] - below[None, :, 2])
        edge_crossings = above[:, None, :2] + height_shares[..., None] * (below[None, :, :2] - above[:, None, :2])
        shadow_points.append(edge_crossings.reshape(-1, 2))
    shadow_corners = np.vstack(shadow_points)
    try:
        return shadow_corners[ConvexHull(shadow_corners).vertices] if len(shadow_corners) > 2 else None
    except QhullError:
        return None


def make_sphere_footprint(
    center: np.ndarray, radius: float, low: float, high: float
) -> tuple[float, float, float] | None:
    """The same of a sphere about a centre (3,), m: x, y and radius of a disc."""
    height_outside = max(low - center[2], center[2] - high, 0.0)
    return (center[0], center[1], math.sqrt(radius**2 - height_outside**2)) if height_outside < radius else None


def make_ball_vertices(semi_axes: np.ndarray) -> np.ndarray:
    """Corners of a polyhedron around an ellipsoid with semi-axes (3,) along x, y and z, m; shape (n, 3)."""
    bearing = 2.0 * np.pi / _SIDE_COUNT * np.arange(_SIDE_COUNT)
    elevation = np.linspace(-0.5 * np.pi, 0.5 * np.pi, _SIDE_COUNT // 2 + 1)[:, None]
    unit_sphere = np.stack(
        (np.cos(elevation) * np.cos(bearing), np.cos(elevation) * np.sin(bearing), np.sin(elevation) + 0.0 * bearing),
        axis=-1,
    )
    circle_factor = 1.0 / math.cos(np.pi / _SIDE_COUNT) ** 2  # a facet spans the same angle both ways
    return circle_factor * np.asarray(semi_axes) * unit_sphere.reshape(-1, 3)


def make_box_vertices(size: np.ndarray) -> np.ndarray:
    """Corners of a box about the origin of that size (3,) along x, y and z, m; shape (8, 3), z changing fastest."""
    return 0.5 * size * np.array(list(itertools.product((-1.0, 1.0), repeat=3)))


def make_cylinder_vertices(radius: float, length: float) -> np.ndarray:
    """Corners of a prism around a cylinder along z about the origin, m; shape (n, 3)."""
    bearing = 2.0 * np.pi / _SIDE_COUNT * np.arange(_SIDE_COUNT)
    ring_corners = radius / math.cos(np.pi / _SIDE_COUNT) * np.column_stack((np.cos(bearing), np.sin(bearing)))
    return np.vstack([np.column_stack((ring_corners, np.full(_SIDE_COUNT, side * length))) for side in (-0.5, 0.5)])
