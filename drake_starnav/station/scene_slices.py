"""What a scan plane cuts out of the shapes of a SceneGraph, as rows for `drake_starnav.lidar.raycast`.

Shapes are read once per geometry version into the solids of `drake_starnav.lidar.plane_slices`.

Slices are kept in the frame F that the shapes move with (the world frame for anchored ones), and recomputed only
when the scan plane has moved relative to F. The plane is rounded first (its normal to 1e-6, its distance from F's
origin to 1e-6 m), so that trembling does not re-slice and the result does not depend on what was sliced before. Of
meshes only faces near the plane are looked at.
"""

import math
import warnings
from collections.abc import Collection

import numpy as np
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
    Role,
    SceneGraphInspector,
    Shape,
    Sphere,
)
from pydrake.math import RigidTransform

from drake_starnav.lidar.plane_slices import EVERYWHERE, Slab, Solids, find_scan_planes, slice_solids
from drake_starnav.lidar.raycast import Fan, Shapes, cast_groups, cast_rolling
from drake_starnav.models.drake_meshes import compute_hull_faces, read_shape_triangles
from drake_starnav.worlds.footprints import make_box_vertices

SURFACE = ("lidar", "surface")
"""Group and name of the perception property of shapes that lidars see whatever their role."""
_IDENTITY = np.eye(3, 4)
_BOX_FACES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


def read_solids(inspector: SceneGraphInspector, role: Role, exclude: Collection[FrameId] = ()) -> dict[FrameId, Solids]:
    """All shapes of a role, or with the property `SURFACE`, by the frame they move with, but those of some; the world
    first.

    Raises:
        StarnavError: a mesh cannot be read.
    """
    parts: dict[FrameId, _Parts] = {inspector.world_frame_id(): _Parts()}
    deformable = set(inspector.GetAllDeformableGeometryIds())
    for geometry in sorted(find_seen_geometries(inspector, role), key=GeometryId.get_value):
        frame = inspector.GetFrameId(geometry)
        if frame in exclude:
            continue
        if geometry in deformable:
            warnings.warn(f"lidar: deformable {inspector.GetName(geometry)} is ignored", stacklevel=2)
            continue
        into = parts.setdefault(frame, _Parts())
        into.add(inspector.GetShape(geometry), inspector.GetPoseInFrame(geometry), inspector.GetName(geometry))
    return {frame: part.solids() for frame, part in parts.items()}


def find_seen_geometries(inspector: SceneGraphInspector, role: Role = Role.kProximity) -> set[GeometryId]:
    """The shapes of a role, and those with the property `SURFACE`."""
    surfaces = {
        geometry
        for geometry in inspector.GetAllGeometryIds(Role.kPerception)
        if inspector.GetPerceptionProperties(geometry).HasProperty(*SURFACE)
    }
    return surfaces | set(inspector.GetAllGeometryIds(role))


class SceneSlices:
    """The slices of a scene, kept from scan to scan; it belongs to one Context.

    It only remembers: the result of `cast` depends on its arguments alone.
    """

    def __init__(self, role: Role, exclude: Collection[FrameId] = ()) -> None:
        """Slice the shapes of a role, except those of some frames."""
        self._role = role
        self._exclude = frozenset(exclude)
        self._version = GeometryVersion()
        self._frames: list[FrameId] = []
        self._solids: list[Solids] = []
        self._slabs: list[Slab | None] = []
        self._keys = np.zeros((0, 4))
        self._rows: list[np.ndarray] = []
        self._groups = Shapes.of([])
        self._kept = (0.0, 0.0, 0.0)  # a circle: x, y, radius; no anchored shape outside it is in the groups

    def __deepcopy__(self, memo: dict) -> "SceneSlices":
        return SceneSlices(self._role, self._exclude)  # a copied Context fills its own

    def cast(
        self, query: QueryObject, X_WS: np.ndarray, fan: Fan, range_max: float, X_WS_begin: np.ndarray | None = None
    ) -> np.ndarray:
        """The true distance along each beam of a fan, shape (n,), m, `+inf` where nothing is hit.

        Args:
            X_WS: pose of the sensor frame S, the upper rows of its matrix, shape (3, 4); its x-y plane is the scan
                plane.
            range_max: shapes farther than this may be ignored, m.
            X_WS_begin: pose when the sweep of the beams began, one beam before the first; None when all measure at
                once. Between the two the sensor moves evenly within the scan plane of `X_WS`, and everything else
                stands still.
        """
        inspector = query.inspector()
        if not inspector.geometry_version().IsSameAs(self._version, self._role):
            self._read(inspector)
        X_WF = np.array([_IDENTITY, *(query.GetPoseInWorld(frame).GetAsMatrix34() for frame in self._frames[1:])])
        first = X_WS if X_WS_begin is None else X_WS_begin
        keys, planes, (begin, end), stale = find_scan_planes(X_WF, first, X_WS, self._keys)
        place = end[0, :2].tolist()
        reach = range_max + math.dist(place, begin[0, :2].tolist())
        if math.dist(place, self._kept[:2]) + reach > self._kept[2]:
            stale = np.union1d(0, stale)
        if 0 in stale:
            self._kept = (*place, 2.0 * reach)
        if len(stale):
            self._slice(keys, planes, stale)
        ranges = np.full(len(fan.directions), np.inf)
        if X_WS_begin is None:
            cast_groups(tuple(self._groups), end, tuple(fan), ranges, range_max)
        else:
            cast_rolling(tuple(self._groups), begin, end, tuple(fan), ranges, range_max)
        return ranges

    def _slice(self, keys: np.ndarray, planes: np.ndarray, numbers: np.ndarray) -> None:
        """Cut the solids of the frames of some numbers anew, by the scan plane in each, as of `find_scan_planes`."""
        for k in numbers.tolist():
            slab = self._slabs[k]
            if slab is None or not slab.contains_cut_of(planes[k]):
                slab = self._slabs[k] = Slab.of(self._solids[k], planes[k])
            self._rows[k] = slice_solids(slab.solids, planes[k], EVERYWHERE if k else self._kept)
        self._keys, self._groups = keys, Shapes.of(self._rows)

    def _read(self, inspector: SceneGraphInspector) -> None:
        solids = read_solids(inspector, self._role, self._exclude)
        self._frames, self._solids = list(solids), list(solids.values())
        self._keys = np.full((len(solids), 4), np.nan)
        self._slabs, self._rows = [None] * len(solids), [np.zeros(0)] * len(solids)
        self._version = GeometryVersion(inspector.geometry_version())


class _Parts:
    """Collects the shapes of one frame."""

    def __init__(self) -> None:
        self.quadrics: list[np.ndarray] = []
        self.vertices: list[np.ndarray] = []
        self.faces: list[np.ndarray] = []
        self.count = 0

    def solids(self) -> Solids:
        face_starts = np.zeros(len(self.faces) + 1, dtype=np.int64)
        np.cumsum([len(face) for face in self.faces], out=face_starts[1:])
        return Solids(
            quadrics=np.array(self.quadrics, dtype=float).reshape(-1, 15),
            vertices=np.vstack([*self.vertices, np.zeros((0, 3))]),
            face_starts=face_starts,
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
            self._add_faces(X_FG, make_box_vertices(shape.size()), _BOX_FACES)
        elif isinstance(shape, HalfSpace):
            e = 1e5  # m; it is cut as a square face of this half-width
            self._add_faces(X_FG, np.array([(-e, -e, 0.0), (e, -e, 0.0), (e, e, 0.0), (-e, e, 0.0)]), ((0, 1, 2, 3),))
        elif isinstance(shape, Convex):
            self._add_faces(X_FG, *compute_hull_faces(shape, name))
        elif isinstance(shape, Mesh):
            self._add_faces(X_FG, *read_shape_triangles(shape, name))
        else:
            shape_name = "MeshcatCone" if isinstance(shape, MeshcatCone) else type(shape).__name__
            warnings.warn(f"lidar: {shape_name} {name} is ignored", stacklevel=2)

    def _add_quadric(
        self, X_FG: RigidTransform, semi_axes: np.ndarray, low: float = -np.inf, high: float = np.inf, cap: float = 0.0
    ) -> None:
        R_FG = X_FG.rotation().matrix()
        quadric_matrix = (R_FG / semi_axes**2) @ R_FG.T
        upper_triangle = quadric_matrix[np.triu_indices(3)]
        self.quadrics.append(np.concatenate((X_FG.translation(), upper_triangle, R_FG[:, 2], (low, high, cap))))

    def _add_faces(self, X_FG: RigidTransform, vertices: np.ndarray, faces: Collection) -> None:
        self.vertices.append(vertices @ X_FG.rotation().matrix().T + X_FG.translation())
        self.faces.extend(np.asarray(face, dtype=np.int64) + self.count for face in faces)
        self.count += len(vertices)
