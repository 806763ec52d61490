"""Gives a look to what a model file describes for collision only."""

from collections.abc import Iterable

import numpy as np
from pydrake.geometry import (
    GeometryId,
    MakePhongIllustrationProperties,
    Role,
    SceneGraph,
    SceneGraphInspector,
)
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant

from drake_starnav.station.scene_slices import seen_geometries
from drake_starnav.station.world_geometry import OBSTACLE_COLOR


def show_collision_shapes(plant: MultibodyPlant, scene_graph: SceneGraph, floor: Iterable[GeometryId]) -> None:
    """Let visualizers draw the collision shapes that no visual shape of the same body stands for.

    A visual shape stands for the collision shapes whose middle lies in its bounding box; those of the floor are not
    drawn. The plant is finalized, and no context of its scene graph exists yet.
    """
    inspector = scene_graph.model_inspector()
    seen, unseen = seen_geometries(inspector), set(floor)
    for frame in inspector.GetAllFrameIds():
        boxes = [_box(inspector, geometry) for geometry in inspector.GetGeometries(frame, Role.kIllustration)]
        for geometry in sorted(seen & set(inspector.GetGeometries(frame)), key=GeometryId.get_value):
            box = _box(inspector, geometry)
            if geometry in unseen or box is None or inspector.GetIllustrationProperties(geometry) is not None:
                continue
            middle = box[0].translation()
            if not any((np.abs(X.inverse() @ middle) <= half).all() for X, half in filter(None, boxes)):
                look = MakePhongIllustrationProperties(OBSTACLE_COLOR)
                scene_graph.AssignRole(plant.get_source_id(), geometry, look)


def _box(inspector: SceneGraphInspector, geometry: GeometryId) -> tuple[RigidTransform, np.ndarray] | None:
    """Pose in the body's frame and half widths of a shape's bounding box; None for an unbounded shape."""
    box = inspector.GetObbInGeometryFrame(geometry)
    return None if box is None else (inspector.GetPoseInFrame(geometry) @ box.pose(), box.half_width())
