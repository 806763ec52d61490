"""What a robot covers of the floor: a disc, a convex polygon, or a union of a few convex polygons."""

import functools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import shapely

from drake_starnav.errors import StarnavError, shown
from drake_starnav.geometry.compiled import kernel, leaf
from drake_starnav.geometry.se2 import transform_points
from drake_starnav.utils.snapshot import snapshot

SAMPLING = 0.032
"""Largest distance between two samples of a motion, in cover radii; of slender bodies in thirds of the radius. The
discs that cover a polygon are wider than the polygon by no more than this share of half its width."""
MOST_DISCS = 12
"""Most discs that cover a part; one that is longer is covered by wider discs."""
LEAST_SIZE = 0.01
"""A footprint is at least this wide, m."""
LARGEST_SIZE = 5.0
"""No corner of a footprint is farther from the axis, m."""
IN_LINE = 1e-3
"""A corner so near to the hull of the others counts as in line with its neighbours, m; the hull is the footprint."""
ROUNDING = 1e-6
"""A footprint that sticks out no farther still lies inside another one, m."""
TINY = 1e-12
"""What is no farther from an edge lies on it, m."""
_ROUND = 64  # segments of a quarter of a circle


class Polygons(NamedTuple):
    """Convex polygons as compiled functions take them, in the robot's frame, m.

    Attributes:
        vertices: of all polygons, counterclockwise, shape (n, 2).
        normals: outward, of the edge that begins at each vertex, shape (n, 2).
        offsets: shape (n,); a polygon is where normals @ point <= offsets.
        ends: where the vertices of each polygon end, shape (p,).
    """

    vertices: np.ndarray
    normals: np.ndarray
    offsets: np.ndarray
    ends: np.ndarray


class Body(NamedTuple):
    """A footprint as compiled functions take it, m.

    Attributes:
        polygons: its parts; none: a disc about the origin.
        radius, lever: as of `Footprint`.
    """

    polygons: Polygons
    radius: float
    lever: float


@snapshot
class Footprint:
    """What a robot covers of the floor, in its frame: the origin is where it turns about, x is ahead; m. Immutable.

    Attributes:
        parts: convex polygons, each counterclockwise of shape (n, 2); none: a disc about the origin.
        cover: centres of discs that together cover it, shape (k, 2).
        cover_radius: of these discs. Where a disc of this radius does not pass, the robot hardly does either.
        radius: of the least disc about the origin that contains it.
    """

    parts: tuple[np.ndarray, ...]
    cover: np.ndarray
    cover_radius: float
    radius: float

    @property
    def is_disc(self) -> bool:
        """Whether it stays where it is when the robot turns."""
        return not self.parts

    @property
    def lever(self) -> float:
        """By how much more than the origin a point of it moves for each radian of a turn, m; 0 for a disc."""
        return 0.0 if self.is_disc else self.radius

    @property
    def sampling(self) -> float:
        """No point of it may move farther between two samples of a motion, m."""
        return SAMPLING * max(self.cover_radius, self.radius / 3.0)

    @functools.cached_property
    def inscribed(self) -> float:
        """Radius of the largest disc about the origin inside one of its parts, m; 0 if the origin is in none."""
        return max(-float(measure_point_distance(0.0, 0.0, self.body)), 0.0)

    @functools.cached_property
    def polygons(self) -> Polygons:
        """The parts for compiled functions; of a disc none."""
        if self.is_disc:
            return Polygons(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0), np.zeros(0, np.int64))
        edges = [np.roll(part, -1, axis=0) - part for part in self.parts]
        normals = [np.column_stack((e[:, 1], -e[:, 0])) / np.hypot(*e.T)[:, None] for e in edges]
        offsets = [(n * part).sum(axis=1) for n, part in zip(normals, self.parts, strict=True)]
        part_ends = np.cumsum([len(part) for part in self.parts])
        return Polygons(np.vstack(self.parts), np.vstack(normals), np.concatenate(offsets), part_ends)

    @functools.cached_property
    def body(self) -> Body:
        """All of it for compiled functions."""
        return Body(self.polygons, float(self.radius), float(self.lever))

    @property
    def outline(self) -> np.ndarray:
        """The boundary of its convex hull, counterclockwise, shape (n, 2); of a disc 48 points."""
        if self.is_disc:
            angle = np.linspace(0.0, 2.0 * math.pi, 48, endpoint=False)
            return self.radius * np.column_stack((np.cos(angle), np.sin(angle)))
        return _find_hull(np.vstack(self.parts))


@leaf
def find_top_speed(speed, turning, lever):
    """No point of a footprint of a `lever` (m) is faster than this at speeds (m/s) and turning rates (rad/s), m/s."""
    return np.abs(speed) + lever * np.abs(turning)


@kernel
def transform_point(x, y, frame):
    """A place in the frame at (x, y, cosine and sine of the yaw); all three in one outer frame, m."""
    dx, dy = x - frame[0], y - frame[1]
    return frame[2] * dx + frame[3] * dy, frame[2] * dy - frame[3] * dx


@kernel
def measure_gap_to_disc(frame, body, x, y, radius, least):
    """How far a `Body` at a frame is from a disc about (x, y), m, or `least` if that is less."""
    near_distance = least + radius + body.radius
    if near_distance >= 0.0 and (x - frame[0]) ** 2 + (y - frame[1]) ** 2 >= near_distance * near_distance:
        return least
    x, y = transform_point(x, y, frame)
    return min(least, measure_point_distance(x, y, body) - radius)


@kernel
def measure_point_distance(x, y, body):
    """How far a `Body` is from a place in its frame, m; negative inside, by a part's depth."""
    part_ends, least = body.polygons.ends, np.inf
    for k in range(max(len(part_ends), 1)):
        start, end = part_ends[k - 1] if k > 0 else 0, part_ends[k] if len(part_ends) else 0
        least = min(least, measure_part_distance(x, y, body, start, end)[0])
    return least


@kernel
def measure_part_distance(x, y, body, start, end):
    """How far one part of a `Body` is from a place, m, negative within it; and the direction from it; in its frame.

    The part is the polygon of these vertices, or the disc if there are none.
    """
    if start == end:
        size = math.sqrt(x * x + y * y)
        return size - body.radius, x / max(size, TINY), y / max(size, TINY)
    polygons, depth, nx, ny = body.polygons, -np.inf, 0.0, 0.0
    for k in range(start, end):
        distance_along = polygons.normals[k, 0] * x + polygons.normals[k, 1] * y - polygons.offsets[k]
        if distance_along > depth:
            depth, nx, ny = distance_along, polygons.normals[k, 0], polygons.normals[k, 1]
    if depth <= TINY:
        return depth, nx, ny
    squared, previous_corner = np.inf, polygons.vertices[end - 1]
    for k in range(start, end):
        next_corner = polygons.vertices[k]
        ex, ey = next_corner[0] - previous_corner[0], next_corner[1] - previous_corner[1]
        t = min(max(((x - previous_corner[0]) * ex + (y - previous_corner[1]) * ey) / (ex * ex + ey * ey), 0.0), 1.0)
        dx, dy = x - previous_corner[0] - t * ex, y - previous_corner[1] - t * ey
        if dx * dx + dy * dy < squared:
            squared, nx, ny = dx * dx + dy * dy, dx, dy
        previous_corner = next_corner
    depth = math.sqrt(squared)
    return depth, nx / depth, ny / depth


def as_footprint(robot: Footprint | float) -> Footprint:
    """A footprint; of a number the disc of that radius, m."""
    return robot if isinstance(robot, Footprint) else disc(robot)


@functools.lru_cache(maxsize=64)
def disc(radius: float) -> Footprint:
    """A disc about the origin, m."""
    return Footprint((), np.zeros((1, 2)), float(radius), float(radius))


@functools.lru_cache(maxsize=64)
def footprint(corners: tuple) -> Footprint:
    """The footprint of one convex polygon, or of a union of them, from tuples of (x, y), m.

    Args:
        corners: ((x, y), ...), or (((x, y), ...), ...), in either order.

    Raises:
        StarnavError: they are no convex polygons, or too small to be a robot.
    """
    parts = tuple(_is_convex(part) for part in (corners if isinstance(corners[0][0], Sequence) else (corners,)))
    boxes = [_find_box(part) for part in parts]
    counts = [_fit_discs(length, width) for _, _, length, width in boxes]
    narrow = max(math.hypot(0.5 * box[2] / k, 0.5 * box[3]) for box, k in zip(boxes, counts, strict=True))
    cover = []
    for (middle, box_direction, length, width), _ in zip(boxes, counts, strict=True):
        k = max(math.ceil(length / (2.0 * math.sqrt(max(narrow**2 - 0.25 * width**2, 1e-12))) - 1e-9), 1)
        cover.append(middle + box_direction * (length * ((np.arange(k) + 0.5) / k - 0.5))[:, None])
    radius = float(np.hypot(*np.vstack(parts).T).max())
    return Footprint(parts, np.vstack(cover), narrow, radius)


def measure_protrusion(shape: Footprint, points: np.ndarray, margin: float = 0.0) -> float:
    """By how much all that is nearer than `margin` to the hull of points (n, 2) sticks out of a footprint, m.

    What spans a notch may stick out farthest between its corners: to 0.1 mm.
    """
    if shape.is_disc:
        return max(float(np.hypot(*points.T).max()) + margin - shape.radius, 0.0)
    body, hull = find_covered_area(shape, np.zeros(3)), shapely.MultiPoint(points).convex_hull
    rest = shapely.difference(hull.buffer(margin, quad_segs=_ROUND), body)
    if rest.is_empty:
        return 0.0
    lower_bound = float(shapely.distance(shapely.points(shapely.get_coordinates(rest)), body).max())
    upper_bound = lower_bound + ROUNDING
    while not body.buffer(upper_bound, quad_segs=_ROUND).covers(rest):
        lower_bound, upper_bound = upper_bound, 2.0 * upper_bound
    while upper_bound - lower_bound > 1e-4:
        middle = 0.5 * (lower_bound + upper_bound)
        is_covered = body.buffer(middle, quad_segs=_ROUND).covers(rest)
        lower_bound, upper_bound = (lower_bound, middle) if is_covered else (middle, upper_bound)
    return lower_bound


def find_covered_area(shape: Footprint, pose: np.ndarray) -> shapely.Geometry:
    """The area that a robot covers at a pose (x, y, yaw); a disc as a polygon of 48 corners."""
    return shapely.union_all(
        [shapely.Polygon(transform_points(pose, part)) for part in shape.parts or (shape.outline,)]
    )


def is_overlapping(one: Footprint, pose: np.ndarray, other: Footprint, other_pose: np.ndarray) -> bool:
    """Whether two robots at poses (x, y, yaw) touch."""
    return bool(find_covered_area(one, pose).intersects(find_covered_area(other, other_pose)))


def measure_least_width(shape: shapely.Geometry) -> float:
    """The width of the least rectangle around a geometry, m."""
    return _find_box(shapely.get_coordinates(shape))[3]


def _is_convex(corners: Sequence) -> np.ndarray:
    points = np.array(corners, dtype=float)
    if points.ndim != 2 or points.shape[1:] != (2,) or len(points) < 3 or not np.isfinite(points).all():
        part = shown([list(corner) for corner in corners])
        raise StarnavError(f"footprint has the part {part}; allowed: three or more corners [x, y], finite, m")
    reach = float(np.hypot(*points.T).max())
    if reach > LARGEST_SIZE:
        raise StarnavError(
            f"footprint {points.tolist()} reaches {reach:g} m from the axis; allowed: at most {LARGEST_SIZE:g} m, of "
            "corners in metres"
        )
    if not shapely.MultiPoint(points).convex_hull.area > 0.0:
        raise StarnavError(f"footprint {points.tolist()} has all corners in line; allowed: corners of an area")
    hull = _find_hull(points)
    if _find_box(hull)[3] < LEAST_SIZE:
        raise StarnavError(f"footprint {points.tolist()} is too narrow; allowed: at least {LEAST_SIZE:g} m wide")
    depth = shapely.distance(shapely.points(points), shapely.LinearRing(hull))
    if depth.max() > IN_LINE or not shapely.Polygon(points).is_valid:
        inside_text = f": {points[depth.argmax()].tolist()} lies {1e3 * depth.max():.3g} mm inside its hull"
        raise StarnavError(
            f"footprint {points.tolist()} is not convex{inside_text if depth.max() > IN_LINE else ''}; allowed: a "
            "convex polygon, or a list of convex polygons"
        )
    return hull


def _find_hull(points: np.ndarray) -> np.ndarray:
    """The convex hull counterclockwise, shape (n, 2), without corners in line."""
    hull = shapely.MultiPoint(points).convex_hull
    if not isinstance(hull, shapely.Polygon):
        return points
    return shapely.get_coordinates(shapely.orient_polygons(hull.simplify(1e-9)))[:-1]


def _find_box(polygon: np.ndarray) -> tuple[np.ndarray, np.ndarray, float, float]:
    """The least rectangle around a polygon: middle, unit vector along its longer side, length and width, m."""
    corners = shapely.get_coordinates(shapely.oriented_envelope(shapely.MultiPoint(polygon)))[:4]
    if len(corners) < 4:
        return polygon.mean(axis=0), np.array((1.0, 0.0)), 0.0, 0.0
    sides = corners[1:3] - corners[0:2]
    lengths = np.hypot(*sides.T)
    longer = int(lengths.argmax())
    long_direction = sides[longer] / lengths[longer]
    return corners.mean(axis=0), long_direction, float(lengths[longer]), float(lengths[1 - longer])


def _fit_discs(length: float, width: float) -> int:
    for k in range(1, MOST_DISCS):
        if math.hypot(0.5 * length / k, 0.5 * width) < (1.0 + SAMPLING) * 0.5 * width:
            return k
    return MOST_DISCS
