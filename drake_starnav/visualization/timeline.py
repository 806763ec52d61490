"""The contents of a recording over time, flat and solid, kept in memory to draw pictures."""

import bisect
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import shapely
from pydrake.common.value import Value
from pydrake.geometry import (
    FrameId,
    GeometryId,
    IllustrationProperties,
    Mesh,
    QueryObject,
    Role,
    SceneGraph,
    SceneGraphInspector,
)
from pydrake.systems.framework import Context, EventStatus, LeafSystem

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.trajectory import Motion
from drake_starnav.models.drake_meshes import read_shape_triangles
from drake_starnav.station.model_world import make_shape_vertices
from drake_starnav.visualization.meshes import Color
from drake_starnav.visualization.page import Caption, Extent
from drake_starnav.worlds.footprints import make_box_vertices, make_convex_footprint


@dataclass
class Shape:
    """One flat object of a recording.

    Attributes:
        points: vertices of the triangles, or lone points, shape (n, 2), m.
        height: above the floor, m.
        faces: shape (k, 3), indices of points; None for lone points.
        colors: shape (1, 3) for all of it, or (n, 3) for each point; red, green, blue, 0 to 1.
        size: of a lone point, pixels.
        on_top: whether it is never hidden.
        opacity: 0 to 1.
        poses: of the frame of its points in W, the upper rows of a transform, shape (3, 4); None: they are in W.
        shown: whether it is visible.
    """

    points: np.ndarray
    height: float
    faces: np.ndarray | None
    colors: np.ndarray
    size: float = 0.0
    on_top: bool = False
    opacity: float = 1.0
    poses: "Track | None" = None
    shown: "Track" = field(default_factory=lambda: Track([0.0], [True]))

    @cached_property
    def areas(self) -> dict[tuple[float, ...], shapely.Geometry]:
        """By colour, what the triangles of it cover, m; where points have colours, those of one shade together."""
        triangle_faces = np.zeros((0, 3), int) if self.faces is None else self.faces
        colors = np.broadcast_to(self.colors, (len(self.points), 3))[triangle_faces].mean(axis=1)
        shades, shade = np.unique(colors.round(1) if len(self.colors) > 1 else colors, axis=0, return_inverse=True)
        triangles = shapely.polygons(self.points[triangle_faces])
        return {tuple(color): shapely.union_all(triangles[shade == k]) for k, color in enumerate(shades.tolist())}


@dataclass
class Track:
    """Keyframes of one property, in the order of their times."""

    times: list[float] = field(default_factory=list)
    values: list[Any] = field(default_factory=list)

    def set(self, value: Any, time: float) -> None:
        """Add a keyframe; it replaces one of the same time."""
        k = bisect.bisect_left(self.times, time)
        if k < len(self.times) and self.times[k] == time:
            self.values[k] = value
        else:
            self.times.insert(k, time)
            self.values.insert(k, value)

    def at(self, time: float) -> Any:
        """The value at a time: numbers are interpolated between keyframes, as in Meshcat; flags switch."""
        next_key = bisect.bisect_right(self.times, time)
        if next_key == 0:
            return self.values[0]
        if next_key == len(self.times) or isinstance(self.values[next_key - 1], bool):
            return self.values[next_key - 1]
        time_share = (time - self.times[next_key - 1]) / (self.times[next_key] - self.times[next_key - 1])
        return (1.0 - time_share) * self.values[next_key - 1] + time_share * self.values[next_key]


@dataclass(frozen=True)
class Solid:
    """One shape of a scene.

    Attributes:
        vertices: shape (n, 3), in its frame, m.
        faces: triangles, shape (k, 3), of vertices; None for their convex hull.
        color: red, green, blue, 0 to 1.
        poses: of its frame in W, the upper rows of a transform, shape (3, 4).
    """

    vertices: np.ndarray
    faces: np.ndarray | None
    color: Color
    poses: Track

    def project_from_above(self, time: float) -> tuple[list[np.ndarray], float]:
        """Polygons that cover it, each of shape (k, 2), W, m, and the height of its top, m, at a time, s."""
        X_WF = self.poses.at(time)
        points = self.vertices @ X_WF[:, :3].T + X_WF[:, 3]
        if self.faces is not None:
            return list(points[self.faces, :2]), points[:, 2].max()
        shadow = make_convex_footprint(points, -np.inf, np.inf)
        return ([] if shadow is None else [shadow]), points[:, 2].max()


class SceneTimeline:
    """The painted shapes of a scene, and where their frames were: the upper rows of their transforms, shape (3, 4)."""

    def __init__(self, scene_graph: SceneGraph, also: Iterable[FrameId] = ()) -> None:
        """Take the shapes with a look in a scene graph, and the frames `also` where they have none."""
        inspector = scene_graph.model_inspector()
        self.solids: list[Solid] = []
        self.frames = {frame: Track() for frame in also}
        for geometry in sorted(inspector.GetAllGeometryIds(Role.kIllustration), key=GeometryId.get_value):
            frame = inspector.GetFrameId(geometry)
            if (corners := _read_mesh(inspector, geometry)) is not None:
                color = _read_color(inspector.GetIllustrationProperties(geometry))
                self.solids.append(Solid(*corners, color, self.frames.setdefault(frame, Track())))

    def note(self, query: QueryObject, time: float) -> None:
        """Remember where the frames are at a time, s."""
        for frame, poses in self.frames.items():
            if frame != SceneGraph.world_frame_id() or not poses.times:
                poses.set(query.GetPoseInWorld(frame).GetAsMatrix34(), time)


def _read_color(look: IllustrationProperties) -> Color:
    """Red, green, blue, 0 to 1, of a shape that looks so."""
    if not look.HasProperty("phong", "diffuse"):
        return 0.9, 0.9, 0.9  # as Drake draws it
    color = look.GetProperty("phong", "diffuse")
    return color.r(), color.g(), color.b()


def _read_mesh(inspector: SceneGraphInspector, geometry: GeometryId) -> tuple[np.ndarray, np.ndarray | None] | None:
    """Vertices in the frame and faces of a geometry; of what cannot be read its box, of what has no bounds None."""
    shape, X_FG, faces = inspector.GetShape(geometry), inspector.GetPoseInFrame(geometry), None
    try:
        if isinstance(shape, Mesh):
            vertices, faces = read_shape_triangles(shape, inspector.GetName(geometry))
            return vertices @ X_FG.rotation().matrix().T + X_FG.translation(), faces
        return make_shape_vertices(inspector, geometry, X_FG), None
    except (StarnavError, RuntimeError):
        box = inspector.GetObbInGeometryFrame(geometry)
        if box is None:
            return None
        X_FB = X_FG @ box.pose()
        return make_box_vertices(2.0 * box.half_width()) @ X_FB.rotation().matrix().T + X_FB.translation(), None


class SceneRecorder(LeafSystem):
    """Records the poses of the shapes of a scene periodically.

    ```
                      ┌───────────────┐
    geometry_query ──>│ SceneRecorder │
                      └───────────────┘
    ```

    Ports:
        geometry_query: abstract, `QueryObject` of the scene.
    """

    def __init__(self, timeline: SceneTimeline, *, period: float) -> None:
        """Takes notes of that period, s."""
        super().__init__()
        self._timeline = timeline
        self._query = self.DeclareAbstractInputPort("geometry_query", Value(QueryObject()))
        self.DeclarePeriodicPublishEvent(period, 0.0, self._publish)

    def _publish(self, context: Context) -> EventStatus:
        self._timeline.note(self._query.Eval(context), context.get_time())
        return EventStatus.Succeeded()


@dataclass(frozen=True)
class RecordedRun:
    """A recorded run.

    Attributes:
        caption: text beside the scene.
        extent: the box of the floor that is shown, W, m.
        scene: robots, obstacles and all else that is solid.
        shapes: drawings on the floor by their paths in Meshcat, in the order of their creation.
        motions: of the robots; the camera follows the first.
    """

    caption: Caption
    extent: Extent
    scene: SceneTimeline
    shapes: dict[str, Shape]
    motions: tuple[Motion, ...]

    @property
    def duration(self) -> float:
        """Time of the last pose, s."""
        return max(motion.duration for motion in self.motions)

    def visible(self, time: float) -> dict[str, Shape]:
        """Those of the shapes that are visible at a time, s."""
        return {path: shape for path, shape in self.shapes.items() if shape.shown.at(time)}
