"""Meshcat: its look, the scene in it, and objects that appear and disappear in recorded time."""

import logging
import math
from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping
from typing import Any

import numpy as np
from pydrake.geometry import (
    FrameId,
    GeometryId,
    MakePhongIllustrationProperties,
    Meshcat,
    MeshcatParams,
    MeshcatVisualizer,
    MeshcatVisualizerParams,
    Rgba,
    Role,
    SceneGraph,
    SceneGraphInspector,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.perception import PointCloud
from pydrake.systems.framework import DiagramBuilder, OutputPort

from drake_starnav.station.robot_geometry import read_floor_contact
from drake_starnav.station.scene_slices import find_seen_geometries
from drake_starnav.station.world_geometry import OBSTACLE_COLOR
from drake_starnav.visualization.meshes import LAYERS, SHELL_COLOR, Layer, Mesh
from drake_starnav.visualization.timeline import Shape, Track

LOOK = (
    *((f"/Lights/{light}", "visible", False) for light in ("SpotLight", "PointLightNegativeX", "PointLightPositiveX")),
    ("/Lights/AmbientLight/<object>", "intensity", 2.0),
    ("/Lights/FillLight/<object>", "intensity", 1.3),
    ("/Lights/FillLight/<object>", "position", [-3.0, 10.0, 4.0]),  # x, z, -y of W
    *(("/Background", f"{part}_color", [1.0, 1.0, 1.0]) for part in ("top", "bottom")),
    *((helper, "visible", False) for helper in ("/Grid", "/Axes")),
)
"""Paths, properties and values: white behind, and light evenly from everywhere, in which a level surface has about the
colour it was given, and walls are a little darker."""
WORLD_PREFIX = "/world"
"""Folder of Meshcat's panel that holds robot and obstacles."""


def start_quiet_meshcat() -> Meshcat:
    """Start a Meshcat server for this machine alone, that shows no statistics and does not log its address."""
    drake_log = logging.getLogger("drake")
    log_level = drake_log.level
    drake_log.setLevel(logging.WARNING)
    try:
        return Meshcat(MeshcatParams(host="localhost", show_stats_plot=False))
    finally:
        drake_log.setLevel(log_level)


def apply_look(meshcat: Meshcat) -> None:
    """Let a Meshcat look as `LOOK` says, in which layers have the colours of the legend."""
    for path, name, value in LOOK:
        meshcat.SetProperty(path, name, value)


def add_scene(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    scene_graph: SceneGraph,
    meshcat: Meshcat,
    floor: Iterable[GeometryId],
    source: OutputPort | None = None,
    robot: Collection[FrameId] = (),
    **looks: Any,
) -> None:
    """Show what `show_collision_shapes` leaves of a scene below `WORLD_PREFIX`, in this `LOOK`.

    `source`: the scene graph's query port, if it is in a diagram of its own; `looks`: of `MeshcatVisualizerParams`.
    """
    apply_look(meshcat)
    show_collision_shapes(plant, scene_graph, floor, robot)
    parameters = MeshcatVisualizerParams(role=Role.kIllustration, prefix=WORLD_PREFIX, **looks)
    MeshcatVisualizer.AddToBuilder(builder, source or scene_graph, meshcat, parameters)


def show_collision_shapes(
    plant: MultibodyPlant, scene_graph: SceneGraph, floor: Iterable[GeometryId], robot: Collection[FrameId] = ()
) -> None:
    """Let visualizers draw the collision shapes that no visual shape of the same body stands for.

    A visual shape stands for the collision shapes whose middle lies in its bounding box; those of the floor are not
    drawn. Shapes of the robot's frames have its colour. The plant is finalized, and no context of its scene graph
    exists yet.
    """
    inspector = scene_graph.model_inspector()
    seen_shapes, unseen = find_seen_geometries(inspector), set(floor)
    # others of the same wheel are drawn
    unseen |= {geometry for geometry in seen_shapes if read_floor_contact(inspector, geometry)}
    for frame in inspector.GetAllFrameIds():
        visuals = inspector.GetGeometries(frame, Role.kIllustration)
        visual_boxes = [_find_bounding_box(inspector, geometry) for geometry in visuals]
        visual_names = {inspector.GetName(geometry) for geometry in visuals}
        for geometry in sorted(seen_shapes & set(inspector.GetGeometries(frame)), key=GeometryId.get_value):
            bounding_box = _find_bounding_box(inspector, geometry)
            if geometry in unseen or bounding_box is None or inspector.GetIllustrationProperties(geometry) is not None:
                continue
            shape_middle = bounding_box[0].translation()
            if not any((np.abs(X.inverse() @ shape_middle) <= half).all() for X, half in filter(None, visual_boxes)):
                look = MakePhongIllustrationProperties([*SHELL_COLOR, 1.0] if frame in robot else OBSTACLE_COLOR)
                if (name := inspector.GetName(geometry)) in visual_names:  # both without one in their file
                    scene_graph.RenameGeometry(geometry, f"{name} {geometry.get_value()}")
                scene_graph.AssignRole(plant.get_source_id(), geometry, look)


def _find_bounding_box(
    inspector: SceneGraphInspector, geometry: GeometryId
) -> tuple[RigidTransform, np.ndarray] | None:
    """Pose in the body's frame and half widths of a shape's bounding box; None for an unbounded shape."""
    box = inspector.GetObbInGeometryFrame(geometry)
    return None if box is None else (inspector.GetPoseInFrame(geometry) @ box.pose(), box.half_width())


class MeshcatStage:
    """Objects of layers in Meshcat that appear and disappear in recorded time.

    Meshcat does not record the creation of an object, only changes of transforms and properties. Hence every object is
    created once, and its recorded property `visible` shows and hides it. Without a recording the times are ignored and
    changes take effect at once.

    `shapes` are all objects that have not been deleted, by their paths, with the times at which they are visible.
    """

    def __init__(
        self,
        meshcat: Meshcat,
        root: str,
        frame: float,
        layers: Mapping[str, Layer] = LAYERS,
        keep: bool = True,
        scale: float = 1.0,
    ) -> None:
        """
        Args:
        meshcat: to draw into.
        root: path of the folder that holds the layers.
        frame: time between two frames of the recording, s.
        layers: by name, the layers that may be drawn.
        keep: whether removed objects are only hidden, as a recording needs them; else they are deleted.
        scale: of the world's marks, see `meshes.choose_mark_scale`; points are smaller in larger worlds.
        """
        self._meshcat, self._root, self._frame = meshcat, root, frame
        self._layers, self._keep, self._point_scale = layers, keep, 1.0 / math.sqrt(max(scale, 1.0))
        self._count = 0
        self._shown: dict[str, str] = {}  # layer and key -> the object shown last
        self._poses: defaultdict[str, Track] = defaultdict(Track)  # of what moves, by folder
        self.shapes: dict[str, Shape] = {}

    def clear(self) -> None:
        """Remove everything."""
        self._meshcat.Delete(self._root)
        self._count = 0
        self._shown.clear()
        self._poses.clear()
        self.shapes.clear()

    def add(
        self,
        layer: str,
        mesh: Mesh,
        time: float,
        opacity: float | None = None,
        colors: np.ndarray | None = None,
        key: str = "",
    ) -> str | None:
        """Show a new object of a layer from a time on, s; returns its path, or None if the mesh is empty.

        Args:
            layer, mesh, time: W, m and s.
            opacity: instead of the layer's.
            colors: shape (n, 3), one for each vertex, instead of the layer's.
            key: of the folder in the layer with which it moves, see `move`; else it stands.
        """
        if not len(mesh):
            return None
        path, look = self._new_path(layer, key), self._layers[layer]
        color, opacity = look.color, look.opacity if opacity is None else opacity
        vertices, faces = np.asfortranarray(mesh.vertices.T), np.asfortranarray(mesh.faces.T)
        if colors is None:
            self._meshcat.SetTriangleMesh(path, vertices, faces, Rgba(*color, opacity))
        else:  # those of vertices are taken as linear light, others as sRGB
            self._meshcat.SetTriangleColorMesh(path, vertices, faces, np.asfortranarray(colors.T**2.2))
        layer_colors = np.array([color]) if colors is None else colors
        height, poses = float(mesh.vertices[0, 2]), self._poses.get(f"{layer}/{key}")
        self.shapes[path] = Shape(
            mesh.vertices[:, :2], height, mesh.faces, layer_colors, on_top=look.on_top, opacity=opacity, poses=poses
        )
        if look.on_top:
            self._put_on_top(path, layer)
        elif opacity < 1.0:  # or translucent objects at one height would hide one another
            self._meshcat.SetProperty(f"{path}/<object>", "material.depthWrite", False)
            self._meshcat.SetProperty(f"{path}/<object>", "renderOrder", self._order(layer) + 1e-6 * self._count)
        self._appear(path, time)
        return path

    def swap(self, layer: str, mesh: Mesh, time: float, opacity: float | None = None, key: str = "") -> None:
        """Replace the last object of the same layer and key; an empty mesh only hides it."""
        self._replace(layer + key, self.add(layer, mesh, time, opacity, key=key), time)

    def move(self, layer: str, key: str, pose: np.ndarray, time: float) -> None:
        """Let what is in a folder of a layer be at a pose (x, y, yaw), W, from a time on; call it before `add`."""
        X_WF = RigidTransform(RotationMatrix.MakeZRotation(pose[2]), [pose[0], pose[1], 0.0])
        self._meshcat.SetTransform(f"{self._root}/{layer}/{key}", X_WF, time)
        self._poses[f"{layer}/{key}"].set(X_WF.GetAsMatrix34(), time)

    def add_points(self, layer: str, points: np.ndarray, time: float) -> str | None:
        """Show points of shape (n, 2), W, m, from a time on; returns the path as `add` does."""
        if not len(points):
            return None
        path, look = self._new_path(layer), self._layers[layer]
        point_cloud = PointCloud(len(points))
        point_cloud.mutable_xyzs()[:2] = points.T
        point_cloud.mutable_xyzs()[2] = look.height
        point_size = self._point_scale * look.size
        self._meshcat.SetObject(path, point_cloud, point_size, Rgba(*look.color))
        self.shapes[path] = Shape(points, look.height, None, np.array([look.color]), point_size, look.on_top)
        self._meshcat.SetProperty(f"{path}/<object>", "material.sizeAttenuation", False)
        if look.on_top:
            self._put_on_top(path, layer)
        self._appear(path, time)
        return path

    def swap_points(self, layer: str, points: np.ndarray, time: float) -> None:
        """Replace the last points of the same layer by others of shape (n, 2), W, m."""
        self._replace(layer, self.add_points(layer, points, time), time)

    def remove(self, path: str, time: float) -> None:
        """Hide an object permanently."""
        if self._keep:
            self._show(path, False, time)
        else:
            self._meshcat.Delete(path)
            del self.shapes[path]

    def _new_path(self, layer: str, key: str = "") -> str:
        self._count += 1
        folder = f"{layer}/{key}" if key else layer
        return f"{self._root}/{folder}/{self._count:04d}"

    def _put_on_top(self, path: str, layer: str) -> None:
        """Draw an object after all translucent ones, through whatever is above it."""
        for name, value in (("material.depthTest", False), ("material.transparent", True)):
            self._meshcat.SetProperty(f"{path}/<object>", name, value)
        self._meshcat.SetProperty(f"{path}/<object>", "renderOrder", self._order(layer))

    def _appear(self, path: str, time: float) -> None:
        if time > self._frame:
            self._show(path, False, 0.0)
        self._show(path, True, time)

    def _replace(self, key: str, path: str | None, time: float) -> None:
        last_path = self._shown.pop(key, None)
        if last_path is not None:
            self.remove(last_path, time)
        if path is not None:
            self._shown[key] = path

    def _show(self, path: str, visible: bool, time: float) -> None:
        self._meshcat.SetProperty(path, "visible", visible, time)
        self.shapes[path].shown.set(visible, time)

    def _order(self, layer: str) -> float:
        return 1.0 + list(self._layers).index(layer)
