"""Cuts a simple polygon into convex pieces, the only prisms a collision engine knows.

Source: constrained Delaunay triangles, merged across diagonals (Hertel and Mehlhorn 1983): at most four times as many
pieces as the fewest possible.
"""

from itertools import pairwise

import numpy as np
import shapely

from drake_starnav.errors import StarnavError, shown
from drake_starnav.worlds.world import FARTHEST

MOST_CORNERS = 20_000
"""Corners that a polygon may have: these take about a second to cut."""
EVEN = 1e-5
"""Corners no farther than this from the line between others count as straight, m; digitised outlines have many."""

Corner = tuple[float, float]


def split_into_convex_parts(polygon: np.ndarray) -> list[np.ndarray]:
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
    outline = shapely.Polygon(simplify_outline(corners - origin))
    if not outline.is_valid or outline.area < EVEN * EVEN:
        fault = "no area" if outline.is_valid else shapely.is_valid_reason(outline)
        raise StarnavError(f"polygon {shown(corners.tolist())} has {fault.lower()}; allowed: a simple polygon")
    triangles = shapely.constrained_delaunay_triangles(outline).normalize().geoms
    return [np.array(piece) + origin for piece in _merge_pieces([list(t.exterior.coords[-2::-1]) for t in triangles])]


def simplify_outline(points: np.ndarray) -> np.ndarray:
    """The outline (k, 2), m, without corners that stick out by no more than `EVEN`; itself if hardly any would stay."""
    simple_ring = shapely.LinearRing(points).simplify(EVEN, preserve_topology=False)
    kept_points = shapely.get_coordinates(simple_ring)[:-1]
    return kept_points if len(kept_points) >= 3 else points


def _merge_pieces(pieces: list[list[Corner]]) -> list[list[Corner]]:
    """Counter-clockwise convex pieces joined across common edges as long as they stay convex.

    An edge that cannot go now can never go: what a piece gains makes its corners no narrower. So each is tried once.
    """
    edge_owners = {edge: k for k, piece in enumerate(pieces) for edge in pairwise((*piece, piece[0]))}
    merged_into = list(range(len(pieces)))

    def piece_at(edge: tuple[Corner, Corner]) -> int:
        k = edge_owners[edge]
        while merged_into[k] != k:
            k = merged_into[k]
        return k

    for a, b in list(edge_owners):
        if (b, a) not in edge_owners or a > b:
            continue
        this_piece, other_piece = piece_at((a, b)), piece_at((b, a))
        # from b to a, from a to b
        left_piece = _rotate_loop_to(pieces[this_piece], a)
        right_piece = _rotate_loop_to(pieces[other_piece], b)
        if _is_left_turn(left_piece[-2], a, right_piece[1]) and _is_left_turn(right_piece[-2], b, left_piece[1]):
            pieces[this_piece], merged_into[other_piece] = left_piece + right_piece[1:-1], this_piece
    return [piece for k, piece in enumerate(pieces) if merged_into[k] == k]


def _rotate_loop_to(piece: list[Corner], corner: Corner) -> list[Corner]:
    """The same loop, with this corner last."""
    k = piece.index(corner) + 1
    return piece[k:] + piece[:k]


def _is_left_turn(a: Corner, b: Corner, c: Corner) -> bool:
    """Whether a b c turns left or goes straight on."""
    (ux, uy), (vx, vy) = np.subtract(b, a), np.subtract(c, b)
    return bool(ux * vy - uy * vx >= -1e-12 * np.hypot(ux, uy) * np.hypot(vx, vy))
