"""A Drake model file as a world: its bodies in a plant, and what they bar to the robot.

Contact is with whatever the file holds. Clearance and shortest path know the footprints: for each collision geometry
that is fixed to the world, the shadow of its part that is no higher than the robot. A mesh has the footprint of its
convex hull, with which Drake collides; one that is hollow that of its surface.
"""

import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.geometry import (
    Convex,
    Cylinder,
    GeometryId,
    HalfSpace,
    Mesh,
    PerceptionProperties,
    RenderLabel,
    Role,
    SceneGraph,
    SceneGraphInspector,
    Sphere,
)
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.multibody.tree import BodyIndex, ModelInstanceIndex, RigidBody
from pydrake.systems.framework import DiagramBuilder

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.footprint import Footprint
from drake_starnav.models.drake_meshes import is_hollow, read_shape_triangles
from drake_starnav.models.model_files import Models
from drake_starnav.models.model_folders import find_file
from drake_starnav.models.parser_warnings import refuse_parser_warnings
from drake_starnav.station.robot_geometry import find_massless_links, inflate_points, sample_outline
from drake_starnav.station.scene_slices import SURFACE, find_seen_geometries, read_solids
from drake_starnav.utils.files import explain_missing_file
from drake_starnav.utils.resources import find_model_path
from drake_starnav.worlds import check_world, make_world
from drake_starnav.worlds.footprints import make_convex_footprint, make_cylinder_vertices, make_sphere_footprint
from drake_starnav.worlds.world import ModelFile, World

FLOOR_TOLERANCE = 0.001
"""Geometry that rises no higher than this above the floor is part of it, m."""
SHEET = 0.001
"""Thickness that a footprint takes the surface of a hollow mesh to have, m."""


def make_world_with_footprints(
    kind: Any,
    seed: int,
    robot: Footprint | float,
    goals: Sequence[Sequence[float]] = (),
    height: Callable[[], float] | None = None,
) -> World:
    """The same as `make_world`, and the world of a model file has its footprints; errors as there.

    Args:
        kind, seed, robot, goals: as in `make_world`.
        height: makes that of the robot, m, where something may stand below its top or bulge over it; None: the usual.
    """
    world = make_world(kind, seed, robot, goals)
    if height is not None and (world.model is not None or len(world.spheres)):
        world = dataclasses.replace(world, height=height())
    if world.model is not None:
        world = add_model_footprints(world)
        check_world(world, kind, robot, goals)
    return world


def add_model_footprints(world: World) -> World:
    """The world of a model file with the footprints of the file's geometry, up to `height`, as cylinders and polygons.

    Raises:
        StarnavError: as in `add_model`, or the lidar cannot read a mesh.
    """
    if world.model is None:
        return world
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.01)  # never simulated
    add_model(plant, scene_graph, world.model)
    plant.Finalize()
    inspector = scene_graph.model_inspector()
    read_solids(inspector, Role.kProximity)  # refuses now what the lidar cannot read
    surfaces = [
        polygon
        for geometry, X_WG in find_fixed_geometries(plant, inspector, hollow=True)
        for polygon in find_shadows(inspector, geometry, X_WG, FLOOR_TOLERANCE, world.height)
    ]
    fixed_geometry = find_fixed_geometries(plant, inspector)
    has_moving = len(fixed_geometry) < len(inspector.GetAllGeometryIds(Role.kProximity))
    disc_footprints: list[tuple[float, float, float]] = []
    polygons: list[np.ndarray] = [*surfaces]
    for geometry, X_WG in fixed_geometry:
        shape = inspector.GetShape(geometry)
        if _is_floor(inspector, geometry, X_WG):
            continue
        is_upright = abs(X_WG.rotation().matrix()[2, 2]) > 1.0 - 1e-12
        if isinstance(shape, Sphere) or (isinstance(shape, Cylinder) and is_upright):
            disc_footprints += filter(None, [_find_disc_footprint(shape, X_WG, world.height)])
        else:
            polygons += find_shadows(inspector, geometry, X_WG, FLOOR_TOLERANCE, world.height)
    return dataclasses.replace(
        world,
        cylinders=np.array(disc_footprints),
        polygons=tuple(polygons),
        model=dataclasses.replace(world.model, moving=has_moving, surfaces=tuple(surfaces)),
    )


def _find_disc_footprint(
    shape: Sphere | Cylinder, X_WG: RigidTransform, height: float
) -> tuple[float, float, float] | None:
    """The footprint of a ball's or an upright cylinder's part from the floor up to a height: x, y, radius, m."""
    x, y, z = X_WG.translation()
    if isinstance(shape, Sphere):
        return make_sphere_footprint(X_WG.translation(), shape.radius(), FLOOR_TOLERANCE, height)
    half = 0.5 * shape.length()
    return (x, y, shape.radius()) if z - half < height and z + half > FLOOR_TOLERANCE else None


def find_shadows(
    inspector: SceneGraphInspector, geometry: GeometryId, X_WG: RigidTransform, low: float, high: float
) -> list[np.ndarray]:
    """The footprint of a collision shape's part between two heights, if any; of a hollow mesh those of its triangles,
    as sheets of `SHEET`."""
    if inspector.GetProximityProperties(geometry) is not None:
        polygon = make_convex_footprint(make_shape_vertices(inspector, geometry, X_WG), low, high)
        return [] if polygon is None else [polygon]
    vertices, triangles = read_shape_triangles(inspector.GetShape(geometry), inspector.GetName(geometry))
    corners = vertices[triangles] @ X_WG.rotation().matrix().T + X_WG.translation()
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal_length = np.linalg.norm(normals, axis=1)
    is_near = (normal_length > 0.0) & (corners[..., 2].min(axis=1) < high) & (corners[..., 2].max(axis=1) > low)
    half_sheet = 0.5 * SHEET * normals[is_near] / normal_length[is_near, None]
    sheets = np.concatenate((corners[is_near] + half_sheet[:, None], corners[is_near] - half_sheet[:, None]), axis=1)
    sheet_footprints = (make_convex_footprint(sheet, low, high) for sheet in sheets)
    return [polygon for polygon in sheet_footprints if polygon is not None]


def add_packages(parser: Parser) -> None:
    """Let a parser find `package://drake_starnav/...`, the shipped models, and the packages of ROS_PACKAGE_PATH."""
    parser.package_map().PopulateFromRosPackagePath()
    parser.package_map().AddPackageXml(str(find_model_path("package.xml")))


def add_model(plant: MultibodyPlant, scene_graph: SceneGraph, model: ModelFile) -> None:
    """Add the bodies of a model file to a plant not yet finalized.

    Raises:
        StarnavError: Drake cannot parse the file, or a mesh file is missing.
    """
    place = f"model {model.path or 'directives'}"
    instances = _parse_model(plant, model, place)
    bodies = [index for instance in instances for index in plant.GetBodyIndices(instance)]
    if model.weld:
        _weld_bodies(plant, bodies)
    for name in find_massless_links(plant, bodies):
        raise StarnavError(
            f"{place}: link {name} moves and has no mass; allowed: <inertial> with a mass and an inertia, or "
            "weld: true for a body that no joint holds"
        )
    inspector = scene_graph.model_inspector()
    for geometry in sorted(inspector.GetAllGeometryIds(), key=GeometryId.get_value):
        shape = inspector.GetShape(geometry)
        path = Path(shape.source().path()) if isinstance(shape, Mesh | Convex) and shape.source().is_path() else None
        if path and (fault := explain_missing_file(path)):
            raise StarnavError(f"{place}: mesh {path}: {fault}; allowed: a mesh file")
    _make_surfaces(plant, scene_graph)


def _parse_model(plant: MultibodyPlant, model: ModelFile, place: str) -> list[ModelInstanceIndex]:
    """Add the models of a file, which is brought into a form that Drake reads; `place` names it in messages."""
    parser, files = Parser(plant), Models(weld=model.weld)
    parser.SetAutoRenaming(True)
    add_packages(parser)
    with refuse_parser_warnings(place, said=files.restore_names):
        if model.text:
            return parser.AddModelsFromString(files.directives(model.text, Path.cwd()), "dmd.yaml")
        found_file = find_file(model.path, Path.cwd()) if "://" in model.path else Path(model.path)
        path = found_file or Path(parser.package_map().ResolveUrl(model.path))
        return parser.AddModels(str(files.model(path)))


def _weld_bodies(plant: MultibodyPlant, bodies: Sequence[BodyIndex]) -> None:
    """Weld those bodies that no joint holds to the world, where they stand."""
    held_bodies = {plant.get_joint(index).child_body().index() for index in plant.GetJointIndices()}
    for body in (plant.get_body(index) for index in bodies if index not in held_bodies):
        X_WB = plant.GetDefaultFloatingBaseBodyPose(body)
        plant.WeldFrames(plant.world_frame(), body.body_frame(), X_WB)


def _make_surfaces(plant: MultibodyPlant, scene_graph: SceneGraph) -> None:
    """Let fixed hollow meshes, as a house in one file, be what lidars see: Drake's contact would fill their hull."""
    inspector = scene_graph.model_inspector()
    for body in plant.GetBodiesWeldedTo(plant.world_body()):
        for geometry in plant.GetCollisionGeometriesForBody(body):
            shape = inspector.GetShape(geometry)
            collides = inspector.GetProximityProperties(geometry) is not None
            if isinstance(shape, Mesh) and collides and is_hollow(shape, inspector.GetName(geometry)):
                scene_graph.RemoveRole(plant.get_source_id(), geometry, Role.kProximity)
                surface = PerceptionProperties()
                surface.AddProperty("label", "id", RenderLabel.kDontCare)
                surface.AddProperty(*SURFACE, True)
                scene_graph.AssignRole(plant.get_source_id(), geometry, surface)


def drop_floors(plant: MultibodyPlant, scene_graph: SceneGraph, ground: GeometryId) -> None:
    """Take the collision role from what else than the ground is floor in a plant just finalized."""
    for geometry in find_floor_geometries(plant, scene_graph):
        if geometry != ground:
            scene_graph.RemoveRole(plant.get_source_id(), geometry, Role.kProximity)


def find_floor_geometries(plant: MultibodyPlant, scene_graph: SceneGraph) -> list[GeometryId]:
    """Fixed collision geometries of a finalized plant that rise no higher above z = 0 than `FLOOR_TOLERANCE`."""
    inspector = scene_graph.model_inspector()
    return [
        geometry for geometry, X_WG in find_fixed_geometries(plant, inspector) if _is_floor(inspector, geometry, X_WG)
    ]


def _is_floor(inspector: SceneGraphInspector, geometry: GeometryId, X_WG: RigidTransform) -> bool:
    shape = inspector.GetShape(geometry)
    if isinstance(shape, HalfSpace):
        return X_WG.translation()[2] <= FLOOR_TOLERANCE and X_WG.rotation().matrix()[2, 2] >= 1.0 - 1e-6
    return make_shape_vertices(inspector, geometry, X_WG)[:, 2].max() <= FLOOR_TOLERANCE


def find_fixed_geometries(
    plant: MultibodyPlant, inspector: SceneGraphInspector, *, hollow: bool = False
) -> list[tuple[GeometryId, RigidTransform]]:
    """`find_placed_geometries` of the bodies welded to the world, directly or not."""
    return find_placed_geometries(plant, inspector, plant.GetBodiesWeldedTo(plant.world_body()), hollow=hollow)


def find_placed_geometries(
    plant: MultibodyPlant, inspector: SceneGraphInspector, bodies: Sequence[RigidBody], *, hollow: bool
) -> list[tuple[GeometryId, RigidTransform]]:
    """Collision geometries of bodies, or their surfaces, and where they are with all joints at their defaults."""
    context, seen_geometries = plant.CreateDefaultContext(), find_seen_geometries(inspector)
    placed_geometries = []
    for body in bodies:
        X_WB = plant.EvalBodyPoseInWorld(context, body)
        for geometry in plant.GetCollisionGeometriesForBody(body):
            if geometry in seen_geometries and (inspector.GetProximityProperties(geometry) is None) == hollow:
                placed_geometries.append((geometry, X_WB @ inspector.GetPoseInFrame(geometry)))
    return sorted(placed_geometries, key=lambda item: item[0].get_value())


def make_shape_vertices(inspector: SceneGraphInspector, geometry: GeometryId, X_WG: RigidTransform) -> np.ndarray:
    """Corners of a convex polyhedron that contains a shape as Drake collides with it, shape (n, 3), W, m."""
    shape = inspector.GetShape(geometry)
    if isinstance(shape, Cylinder):
        corners = make_cylinder_vertices(shape.radius(), shape.length())
    else:
        outline_points, rounding_radius = sample_outline(inspector, geometry)
        corners = inflate_points(outline_points.T, rounding_radius)
    return corners @ X_WG.rotation().matrix().T + X_WG.translation()
