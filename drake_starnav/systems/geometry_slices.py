"""What a scan plane cuts out of the shapes of a SceneGraph, as rows for `drake_starnav.raycast`.

Shapes are read once per geometry version into two exact forms: solids of revolution and ellipsoids as (clipped)
quadrics, whose slices are (clipped) conics, and everything flat-faced as convex faces, whose slices are segments.
So a tipped cylinder's slice is exact, an ellipse cut by its two end faces.

Slices are kept in the frame F that the shapes move with (the world frame for anchored ones), and computed anew only
when the scan plane has moved relative to F. The plane is rounded first (its normal to 1e-6, its distance from F's
origin to 1e-6 m), so that trembling does not re-slice and the result does not depend on what was sliced before.

A face within the plane is cut when the solid is below it, not when it is above.
"""

import contextlib
import math
import tempfile
import warnings
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numba import njit
from pydrake.geometry import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    FrameId,
    GeometryId,
    GeometryVersion,
    HalfSpace,
    Mesh,
    MeshcatCone,
    QueryObject,
    ReadObjToTriangleSurfaceMesh,
    Role,
    SceneGraphInspector,
    Shape,
    Sphere,
)
from pydrake.math import RigidTransform

from drake_starnav.errors import StarnavError
from drake_starnav.raycast import CIRCLE, COLUMNS, CONIC, SEGMENT, Fan, ShapeBins, cast_grid, cast_groups

_RESOLUTION = 1e-6  # of the rounded plane: unit normal, and metres
_SECTORS = 36  # of a rolling sweep; within one the sensor stands still
_HALF_SPACE_EXTENT = 1e5  # m; a half space is cut as a square face of this half-width
_BOX_CORNERS = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
_BOX_FACES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


@dataclass(frozen=True)
class Solids:
    """The shapes that move with one frame F, in F.

    Attributes:
        quadrics: shape (n, 15): centre c (3), upper triangle of the matrix M (6), axis (3), low, high, cap radius:
            the surface (p-c)^T M (p-c) = 1 where low <= axis^T (p-c) <= high, closed by flat caps if their radius > 0.
        vertices: shape (v, 3), m.
        face_starts: shape (f + 1,), int; face k is the convex polygon `face_vertices[face_starts[k]:face_starts[k+1]]`.
        face_vertices: shape (sum,), int, indices of vertices.
    """

    quadrics: np.ndarray
    vertices: np.ndarray
    face_starts: np.ndarray
    face_vertices: np.ndarray


def read_solids(inspector: SceneGraphInspector, role: Role, exclude: Collection[FrameId] = ()) -> dict[FrameId, Solids]:
    """All shapes of a role, by the frame they move with; the world frame always comes first.

    Args:
        inspector: of the scene.
        role: shapes without it are invisible.
        exclude: frames whose shapes are left out.

    Raises:
        StarnavError: a mesh cannot be read.
    """
    parts: dict[FrameId, _Parts] = {inspector.world_frame_id(): _Parts()}
    deformable = set(inspector.GetAllDeformableGeometryIds())
    for geometry in sorted(inspector.GetAllGeometryIds(role), key=GeometryId.get_value):
        frame = inspector.GetFrameId(geometry)
        if frame in exclude:
            continue
        if geometry in deformable:
            warnings.warn(f"lidar: deformable {inspector.GetName(geometry)} is ignored", stacklevel=2)
            continue
        into = parts.setdefault(frame, _Parts())
        into.add(inspector.GetShape(geometry), inspector.GetPoseInFrame(geometry), inspector.GetName(geometry))
    return {frame: part.solids() for frame, part in parts.items()}


def slice_solids(solids: Solids, plane: np.ndarray) -> np.ndarray:
    """What a plane cuts out of solids, as rows for `drake_starnav.raycast`.

    Args:
        solids: in a frame F.
        plane: shape (3, 3), in F: two orthonormal vectors that span the plane, and its origin, m. Coordinates in the
            plane are along the two vectors, from the origin.
    """
    return _slice(plane, solids.quadrics, solids.vertices, solids.face_starts, solids.face_vertices)


class SceneSlices:
    """The slices of a scene, kept from scan to scan; it belongs to one Context.

    It only remembers: the result of `cast` depends on its arguments alone.
    """

    def __init__(self, role: Role, exclude: Collection[FrameId] = ()) -> None:
        """
        Args:
            role: shapes without it are invisible.
            exclude: frames whose shapes are left out.
        """
        self._role = role
        self._exclude = frozenset(exclude)
        self._version = GeometryVersion()
        self._solids: dict[FrameId, Solids] = {}
        self._keys = np.zeros((0, 4))
        self._moving_rows: list[np.ndarray] = []
        self._anchored = self._moving = ShapeBins.grouped([])

    def __deepcopy__(self, memo: dict) -> "SceneSlices":
        return SceneSlices(self._role, self._exclude)  # a copied Context fills its own

    def cast(
        self,
        query: QueryObject,
        X_WS: RigidTransform,
        fan: Fan,
        range_max: float,
        X_WS_begin: RigidTransform | None = None,
    ) -> np.ndarray:
        """The true distance along each beam.

        Args:
            query: of the scene.
            X_WS: pose of the sensor frame S; its x-y plane is the scan plane.
            fan: the beams.
            range_max: shapes farther than this may be ignored, m.
            X_WS_begin: pose when the sweep of the beams began; None when all measure at once. Between the two the
                sensor moves evenly within the scan plane of `X_WS`, and everything else stands still.

        Returns:
            shape (n,), m, `+inf` where nothing is hit.
        """
        inspector = query.inspector()
        if not inspector.geometry_version().IsSameAs(self._version, self._role):
            self._read(inspector)
        X_WF = np.empty((len(self._solids), 3, 4))
        X_WF[0] = np.eye(3, 4)
        for k, frame in enumerate(self._solids):
            if k > 0:
                X_WF[k] = query.GetPoseInWorld(frame).GetAsMatrix34()
        matrix = X_WS.GetAsMatrix34()
        keys, planes = _planes(X_WF, matrix)
        self._refresh(keys, planes, range_max)
        ranges = np.full(len(fan.directions), np.inf)
        end = _planar_poses(X_WF, matrix, planes)
        if X_WS_begin is None:
            self._cast(end, fan, ranges, range_max)
            return ranges
        begin = _planar_poses(X_WF, X_WS_begin.GetAsMatrix34(), planes)
        change = end - begin
        change[:, 2] = (change[:, 2] + math.pi) % (2.0 * math.pi) - math.pi
        edges = np.linspace(0, len(ranges), min(len(ranges), _SECTORS) + 1).astype(int)
        for first, last in zip(edges[:-1], edges[1:], strict=True):
            poses = begin + change * ((first + last) / (2 * len(ranges)))
            sector = Fan(fan.angle_min + first * fan.increment, fan.increment, fan.directions[first:last])
            self._cast(poses, sector, ranges[first:last], range_max)
        return ranges

    def _cast(self, poses: np.ndarray, fan: Fan, ranges: np.ndarray, range_max: float) -> None:
        cast_grid(self._anchored, poses[0], fan, ranges, range_max)
        if len(self._moving.rows):
            cast_groups(self._moving, poses[1:], fan, ranges, range_max)

    def _read(self, inspector: SceneGraphInspector) -> None:
        self._solids = read_solids(inspector, self._role, self._exclude)
        self._keys = np.full((len(self._solids), 4), np.nan)
        self._moving_rows = [np.zeros((0, COLUMNS))] * (len(self._solids) - 1)
        self._version = GeometryVersion(inspector.geometry_version())

    def _refresh(self, keys: np.ndarray, planes: np.ndarray, range_max: float) -> None:
        stale = np.flatnonzero((keys != self._keys).any(axis=1))
        if not len(stale):
            return
        solids = list(self._solids.values())
        for k in stale:
            rows = slice_solids(solids[k], planes[k])
            if k == 0:
                self._anchored = ShapeBins.grid(rows, range_max / 2.0)
            else:
                self._moving_rows[k - 1] = rows
        if stale[-1] > 0:
            self._moving = ShapeBins.grouped(self._moving_rows)
        self._keys = keys


class _Parts:
    """Collects the shapes of one frame."""

    def __init__(self) -> None:
        self.quadrics: list[np.ndarray] = []
        self.vertices: list[np.ndarray] = []
        self.faces: list[np.ndarray] = []
        self.count = 0

    def solids(self) -> Solids:
        starts = np.zeros(len(self.faces) + 1, dtype=np.int64)
        np.cumsum([len(face) for face in self.faces], out=starts[1:])
        return Solids(
            quadrics=np.array(self.quadrics, dtype=float).reshape(-1, 15),
            vertices=np.vstack([*self.vertices, np.zeros((0, 3))]),
            face_starts=starts,
            face_vertices=np.concatenate([*self.faces, np.zeros(0, dtype=np.int64)]).astype(np.int64),
        )

    def add(self, shape: Shape, X_FG: RigidTransform, name: str) -> None:
        if isinstance(shape, Sphere):
            self._add_quadric(X_FG, np.full(3, shape.radius()))
        elif isinstance(shape, Ellipsoid):
            self._add_quadric(X_FG, np.array((shape.a(), shape.b(), shape.c())))
        elif isinstance(shape, Cylinder):
            half = shape.length() / 2.0
            self._add_quadric(X_FG, np.array((shape.radius(), shape.radius(), np.inf)), -half, half, shape.radius())
        elif isinstance(shape, Capsule):
            half = shape.length() / 2.0
            self._add_quadric(X_FG, np.array((shape.radius(), shape.radius(), np.inf)), -half, half)
            for z, low, high in ((half, 0.0, np.inf), (-half, -np.inf, 0.0)):
                self._add_quadric(X_FG @ RigidTransform([0.0, 0.0, z]), np.full(3, shape.radius()), low, high)
        elif isinstance(shape, Box):
            self._add_faces(X_FG, _BOX_CORNERS * shape.size(), _BOX_FACES)
        elif isinstance(shape, HalfSpace):
            e = _HALF_SPACE_EXTENT
            self._add_faces(X_FG, np.array([(-e, -e, 0.0), (e, -e, 0.0), (e, e, 0.0), (-e, e, 0.0)]), ((0, 1, 2, 3),))
        elif isinstance(shape, Convex):
            self._add_faces(X_FG, *_hull(shape, name))
        elif isinstance(shape, Mesh):
            self._add_faces(X_FG, *_triangles(shape, name))
        else:
            what = "MeshcatCone" if isinstance(shape, MeshcatCone) else type(shape).__name__
            warnings.warn(f"lidar: {what} {name} is ignored", stacklevel=2)

    def _add_quadric(
        self, X_FG: RigidTransform, semi_axes: np.ndarray, low: float = -np.inf, high: float = np.inf, cap: float = 0.0
    ) -> None:
        R_FG = X_FG.rotation().matrix()
        matrix = (R_FG / semi_axes**2) @ R_FG.T
        upper = matrix[np.triu_indices(3)]
        self.quadrics.append(np.concatenate((X_FG.translation(), upper, R_FG[:, 2], (low, high, cap))))

    def _add_faces(self, X_FG: RigidTransform, vertices: np.ndarray, faces: Collection) -> None:
        self.vertices.append(vertices @ X_FG.rotation().matrix().T + X_FG.translation())
        self.faces.extend(np.asarray(face, dtype=np.int64) + self.count for face in faces)
        self.count += len(vertices)


def _hull(shape: Convex, name: str) -> tuple[np.ndarray, list[list[int]]]:
    try:
        hull = shape.GetConvexHull()
    except RuntimeError as error:
        raise _unreadable(shape, name, str(error)) from error
    data, faces, k = hull.face_data(), [], 0
    while k < len(data):  # count, then that many vertices
        faces.append(data[k + 1 : k + 1 + data[k]])
        k += 1 + data[k]
    return np.array([hull.vertex(k) for k in range(hull.num_vertices())]), faces


def _triangles(shape: Mesh, name: str) -> tuple[np.ndarray, np.ndarray]:
    if shape.extension().lower() != ".obj":
        raise _unreadable(shape, name, f"a {shape.extension()} file")
    source = shape.source()
    with contextlib.ExitStack() as stack:
        if source.is_path():
            path = Path(source.path())
        else:
            path = Path(stack.enter_context(tempfile.TemporaryDirectory())) / "mesh.obj"
            path.write_bytes(source.in_memory().mesh_file.contents())
        if not path.is_file():
            raise _unreadable(shape, name, "no such file")
        try:
            mesh = ReadObjToTriangleSurfaceMesh(path, scale3=shape.scale3())
        except RuntimeError as error:
            raise _unreadable(shape, name, str(error)) from error
    corners = [[triangle.vertex(k) for k in range(3)] for triangle in mesh.triangles()]
    return np.array(mesh.vertices()), np.array(corners)


def _unreadable(shape: Mesh | Convex, name: str, why: str) -> StarnavError:
    return StarnavError(
        f"lidar: mesh {shape.source().description()} of geometry {name}: {why}; allowed: a readable .obj surface"
    )


@njit(cache=True)
def _planes(X_WF, X_WS):
    """The scan plane in each frame F: rounded normal and distance (m, 4), and as `slice_solids` takes it (m, 3, 3)."""
    keys, planes = np.empty((len(X_WF), 4)), np.empty((len(X_WF), 3, 3))
    normal, origin = np.empty(3), np.empty(3)
    for k in range(len(X_WF)):
        X = X_WF[k]
        for i in range(3):
            normal[i] = X[0, i] * X_WS[0, 2] + X[1, i] * X_WS[1, 2] + X[2, i] * X_WS[2, 2]
            origin[i] = 0.0
            for j in range(3):
                origin[i] += X[j, i] * (X_WS[j, 3] - X[j, 3])
            keys[k, i] = np.round(normal[i] / _RESOLUTION)
            normal[i] = keys[k, i]
        normal /= math.sqrt((normal * normal).sum())
        keys[k, 3] = np.round((normal * origin).sum() / _RESOLUTION)
        # The first vector is F's x axis seen from above the plane, or its y axis where x is too steep.
        axis = 0 if abs(normal[0]) < 0.9 else 1
        first = -normal[axis] * normal
        first[axis] += 1.0
        first /= math.sqrt((first * first).sum())
        planes[k, 0] = first
        planes[k, 1] = np.cross(normal, first)
        planes[k, 2] = normal * (keys[k, 3] * _RESOLUTION)
    return keys, planes


@njit(cache=True)
def _planar_poses(X_WF, X_WS, planes):
    """(x, y, yaw) of S in each plane of `_planes`, shape (m, 3)."""
    poses = np.empty((len(X_WF), 3))
    for k in range(len(X_WF)):
        X, plane = X_WF[k], planes[k]
        x = y = cosine = sine = 0.0
        for i in range(3):
            p, a = -plane[2, i], 0.0
            for j in range(3):
                p += X[j, i] * (X_WS[j, 3] - X[j, 3])
                a += X[j, i] * X_WS[j, 0]
            x += plane[0, i] * p
            y += plane[1, i] * p
            cosine += plane[0, i] * a
            sine += plane[1, i] * a
        poses[k, 0], poses[k, 1], poses[k, 2] = x, y, math.atan2(sine, cosine)
    return poses


@njit(cache=True)
def _slice(plane, quadrics, vertices, face_starts, face_vertices):
    e1, e2 = plane[0], plane[1]
    normal = np.cross(e1, e2)
    heights = np.empty(len(vertices))
    for k in range(len(vertices)):
        heights[k] = ((vertices[k] - plane[2]) * normal).sum()
    crossing = 0
    for f in range(len(face_starts) - 1):
        above = False
        below = False
        for k in range(face_starts[f], face_starts[f + 1]):
            if heights[face_vertices[k]] >= 0.0:
                above = True
            else:
                below = True
        crossing += above and below
    rows = np.zeros((3 * len(quadrics) + crossing, COLUMNS))
    count = 0
    for q in quadrics:
        count = _slice_quadric(q, plane, normal, rows, count)
    for f in range(len(face_starts) - 1):
        count = _slice_face(face_starts[f], face_starts[f + 1], face_vertices, vertices, heights, plane, rows, count)
    return rows[:count].copy()


@njit(cache=True)
def _slice_face(first, last, corners, vertices, heights, plane, rows, count):
    ends = np.empty(4)
    found = 0
    for k in range(first, last):
        i, j = corners[k], corners[k + 1 if k + 1 < last else first]
        if (heights[i] >= 0.0) == (heights[j] >= 0.0) or found == 4:
            continue
        if heights[i] > heights[j]:  # always upwards: two faces that share an edge share the very same point
            i, j = j, i
        share = heights[i] / (heights[i] - heights[j])
        point = vertices[i] + share * (vertices[j] - vertices[i]) - plane[2]
        ends[found] = (point * plane[0]).sum()
        ends[found + 1] = (point * plane[1]).sum()
        found += 2
    if found == 4 and (ends[0] != ends[2] or ends[1] != ends[3]):
        count = _put_segment(ends[0], ends[1], ends[2], ends[3], rows, count)
    return count


@njit(cache=True)
def _put_segment(x1, y1, x2, y2, rows, count):
    row = rows[count]
    row[0], row[1], row[2], row[3] = (x1 + x2) / 2.0, (y1 + y2) / 2.0, math.hypot(x2 - x1, y2 - y1) / 2.0, SEGMENT
    row[4], row[5], row[6], row[7] = x1, y1, x2, y2
    return count + 1


@njit(cache=True)
def _slice_quadric(q, plane, normal, rows, count):
    """Put the conic d^T A d + 2 b^T d + c = 0 of one quadric, clipped to low <= m^T d <= high, and its end faces."""
    e1, e2 = plane[0], plane[1]
    height = ((q[0:3] - plane[2]) * normal).sum()
    x0, y0 = ((q[0:3] - plane[2]) * e1).sum(), ((q[0:3] - plane[2]) * e2).sum()
    matrix = np.array([[q[3], q[4], q[5]], [q[4], q[6], q[7]], [q[5], q[7], q[8]]])
    # d is measured from the centre's projection, w = -height normal away from the centre.
    M1 = (matrix * e1).sum(axis=1)
    M2 = (matrix * e2).sum(axis=1)
    a00, a01, a11 = (M1 * e1).sum(), (M1 * e2).sum(), (M2 * e2).sum()
    b0, b1 = -height * (M1 * normal).sum(), -height * (M2 * normal).sum()
    c = height * height * ((matrix * normal).sum(axis=1) * normal).sum() - 1.0
    axis, cap = q[9:12], q[14]
    m0, m1 = (axis * e1).sum(), (axis * e2).sum()
    k = -height * (axis * normal).sum()
    low, high = q[12] - k, q[13] - k
    slope = math.hypot(m0, m1)
    if slope < 1e-12:
        if low > 0.0 or high < 0.0:
            return count
        m0 = m1 = slope = 0.0
        low, high = -np.inf, np.inf

    # The circle around the whole conic, if it is an ellipse.
    cx = cy = size = 0.0
    radius = np.inf
    trace, determinant = a00 + a11, a00 * a11 - a01 * a01
    if determinant > 1e-12 * trace * trace:
        cx, cy = (a01 * b1 - a11 * b0) / determinant, (a01 * b0 - a00 * b1) / determinant
        size = -(c + b0 * cx + b1 * cy)
        if size <= 0.0:
            return count
        spread = math.hypot((a00 - a11) / 2.0, a01)
        radius = math.sqrt(size * (trace / 2.0 + spread) / determinant)
        middle = m0 * cx + m1 * cy
        if low <= middle - slope * radius and high >= middle + slope * radius:
            round_ = spread <= 1e-12 * trace
            row = rows[count]
            row[0], row[1], row[2] = x0 + cx, y0 + cy, radius
            row[3] = CIRCLE if round_ else CONIC
            if not round_:
                _put_conic(row, a00, a01, a11, b0, b1, c, cx, cy)
                row[12], row[13] = -1.0, 1.0
            return count + 1

    # Clipped: a box along the axis and across it. Clipped quadrics are round about their axis, so A is diagonal there.
    u0, u1 = m0 / slope, m1 / slope
    across = a00 * u1 * u1 - 2.0 * a01 * u0 * u1 + a11 * u0 * u0
    begin, end = low / slope, high / slope
    side = (b0 * u1 - b1 * u0) / across
    if radius < np.inf:
        begin, end = max(begin, u0 * cx + u1 * cy - radius), min(end, u0 * cx + u1 * cy + radius)
        half = math.sqrt(size / across)
    else:
        half = 1.0 / math.sqrt(across)  # a lying cylinder, whose slice is at most as wide as itself
    if begin < end:
        row = rows[count]
        px, py = u0 * (begin + end) / 2.0 - u1 * side, u1 * (begin + end) / 2.0 + u0 * side
        row[0], row[1] = x0 + px, y0 + py
        row[2] = min(radius + math.hypot(px - cx, py - cy), math.hypot((end - begin) / 2.0, half)) + 1e-9
        row[3] = CONIC
        _put_conic(row, a00, a01, a11, b0, b1, c, px, py)
        row[10], row[11] = m0, m1
        row[12], row[13] = low - m0 * px - m1 * py, high - m0 * px - m1 * py
        count += 1
    if cap > 0.0:  # the plane meets the disc of an end face in a chord
        lean = (axis * normal).sum()
        for bound in (q[12], q[13]):
            rise = height + bound * lean  # of the disc's centre over the plane
            away = rise / slope  # from the disc's centre to the chord, within the disc
            if abs(away) < cap:
                half = math.sqrt(cap * cap - away * away)
                along = bound * slope + away * lean
                px, py = x0 + along * u0, y0 + along * u1
                count = _put_segment(px - half * u1, py + half * u0, px + half * u1, py - half * u0, rows, count)
    return count


@njit(cache=True)
def _put_conic(row, a00, a01, a11, b0, b1, c, px, py):
    """Write the conic's coefficients for d measured from (px, py)."""
    g0, g1 = a00 * px + a01 * py, a01 * px + a11 * py
    row[4], row[5], row[6] = a00, a01, a11
    row[7], row[8] = b0 + g0, b1 + g1
    row[9] = c + (2.0 * b0 + g0) * px + (2.0 * b1 + g1) * py
