"""A recorded run and the solid shapes of its scene over time, kept in memory to draw pictures from above."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from pydrake.common.value import Value
from pydrake.geometry import FrameId, GeometryId, Mesh, QueryObject, Role, SceneGraph, SceneGraphInspector
from pydrake.systems.framework import Context, EventStatus, LeafSystem

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.footprint import Footprint
from drake_starnav.geometry.trajectory import Motion
from drake_starnav.station.mesh_files import mesh_triangles
from drake_starnav.station.model_world import shape_vertices
from drake_starnav.visualization.meshes import SHELL_COLOR, Color
from drake_starnav.visualization.page import Caption, Extent
from drake_starnav.visualization.timeline import Timeline, Track
from drake_starnav.worlds.footprints import box_vertices, convex_footprint

UNPAINTED = (0.9, 0.9, 0.9)
"""Drake's colour of a shape that has none."""


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
    color: tuple[float, ...]
    poses: Track

    def seen_from_above(self, time: float) -> tuple[list[np.ndarray], float]:
        """Polygons that cover it, each of shape (k, 2), W, m, and the height of its top, m, at a time, s."""
        X_WF = self.poses.at(time)
        points = self.vertices @ X_WF[:, :3].T + X_WF[:, 3]
        if self.faces is not None:
            return list(points[self.faces, :2]), points[:, 2].max()
        shadow = convex_footprint(points, -np.inf, np.inf)
        return ([] if shadow is None else [shadow]), points[:, 2].max()


class SceneTimeline:
    """The painted shapes of a scene, and where their frames were: the upper rows of their transforms, shape (3, 4)."""

    def __init__(self, scene_graph: SceneGraph, hidden: Iterable[FrameId] = ()) -> None:
        """Of the shapes with a look in a scene graph, but for those of hidden frames."""
        inspector, away = scene_graph.model_inspector(), set(hidden)
        self.solids: list[Solid] = []
        self.frames = {frame: Track() for frame in away}
        for geometry in sorted(inspector.GetAllGeometryIds(Role.kIllustration), key=GeometryId.get_value):
            frame = inspector.GetFrameId(geometry)
            if frame not in away and (corners := _corners(inspector, geometry)) is not None:
                color = inspector.GetIllustrationProperties(geometry).GetPropertyOrDefault("phong", "diffuse", None)
                rgb = UNPAINTED if color is None else (color.r(), color.g(), color.b())
                self.solids.append(Solid(*corners, rgb, self.frames.setdefault(frame, Track())))

    def note(self, query: QueryObject, time: float) -> None:
        """Remember where the frames are at a time, s."""
        for frame, poses in self.frames.items():
            if frame != SceneGraph.world_frame_id() or not poses.times:
                poses.set(query.GetPoseInWorld(frame).GetAsMatrix34(), time)


def _corners(inspector: SceneGraphInspector, geometry: GeometryId) -> tuple[np.ndarray, np.ndarray | None] | None:
    """Vertices in the frame and faces of a geometry; of what cannot be read its box, of what has no bounds None."""
    shape, X_FG, faces = inspector.GetShape(geometry), inspector.GetPoseInFrame(geometry), None
    try:
        if isinstance(shape, Mesh):
            vertices, faces = mesh_triangles(shape, inspector.GetName(geometry))
            return vertices @ X_FG.rotation().matrix().T + X_FG.translation(), faces
        return shape_vertices(inspector, geometry, X_FG), None
    except (StarnavError, RuntimeError):
        box = inspector.GetObbInGeometryFrame(geometry)
        if box is None:
            return None
        X_FB = X_FG @ box.pose()
        return box_vertices(2.0 * box.half_width()) @ X_FB.rotation().matrix().T + X_FB.translation(), None


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
class RobotTrack:
    """A robot that drives through the scene.

    Attributes:
        motion: its poses.
        shape: of its hull.
        color: of its hull, red, green, blue, 0 to 1.
        deck: size of the lighter deck on it, as a share of the hull's.
    """

    motion: Motion
    shape: Footprint
    color: Color = SHELL_COLOR
    deck: float = 0.86


@dataclass(frozen=True)
class RecordedRun:
    """A recorded run.

    Attributes:
        caption: text beside the scene.
        extent: the box of the floor that is shown, W, m.
        scene: obstacles and all else that is solid, but the robots.
        timeline: drawings on the floor.
        robots: the robots; the camera follows the first.
    """

    caption: Caption
    extent: Extent
    scene: SceneTimeline
    timeline: Timeline
    robots: tuple[RobotTrack, ...]

    @property
    def duration(self) -> float:
        """Time of the last pose, s."""
        return max(robot.motion.duration for robot in self.robots)
