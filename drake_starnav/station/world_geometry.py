"""A planar world as bodies of a MultibodyPlant."""

import math

import numpy as np
from pydrake.common import MemoryFile
from pydrake.geometry import (
    Box,
    Convex,
    Cylinder,
    GeometryId,
    GeometryInstance,
    IllustrationProperties,
    InMemoryMesh,
    Mesh,
    PerceptionProperties,
    Rgba,
    SceneGraph,
    Shape,
    Sphere,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import CoulombFriction, MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex

from drake_starnav.errors import StarnavError
from drake_starnav.models.obj_files import format_obj, make_prism
from drake_starnav.station.model_world import add_model
from drake_starnav.station.robot_geometry import RobotModel
from drake_starnav.station.scene_slices import SURFACE
from drake_starnav.worlds.convex_parts import split_into_convex_parts
from drake_starnav.worlds.world import World

OBSTACLE_HEIGHT = 0.5
"""Height of prisms, cylinders and walls, m, where no robot is higher."""
OVERHEAD = 0.05
"""Obstacles are higher than a robot by this, m."""
WALL_THICKNESS = 0.1
"""The walls along the bounds stand outside them, m."""
GROUND_THICKNESS = 1.0
GROUND_BORDER = 2000.0
"""The ground reaches this far beyond the world, m."""
MOST_LOOKS = 200
"""More convex prisms than these are shown by one mesh: each object of a recording costs about a kilobyte."""
MOST_POLYGONS = 1000
"""More polygons than these are one surface, which the lidar sees and the plant has no contact with: a plant notes of
each pair of shapes whether it may collide, in each of its contexts. 3,000 take 8 s and 1.7 GB, 6,000 100 s and 6 GB."""
OBSTACLE_COLOR = [0.55, 0.57, 0.60, 1.0]
WALL_COLOR = [0.35, 0.37, 0.40, 1.0]


def add_ground(plant: MultibodyPlant, extent: tuple[float, float, float, float]) -> GeometryId:
    """A flat floor at z = 0 under the box (x_min, y_min, x_max, y_max) and far beyond it.

    A big box, since a half space among many anchored shapes crashes Drake (issue 19263).
    """
    low, high = np.reshape(extent, (2, 2))
    box = Box(*(high - low + 2 * GROUND_BORDER), GROUND_THICKNESS)
    X_WG = RigidTransform([*(0.5 * (low + high)), -0.5 * GROUND_THICKNESS])
    return plant.RegisterCollisionGeometry(plant.world_body(), X_WG, box, "ground", CoulombFriction(1.0, 1.0))


def add_world(plant: MultibodyPlant, world: World) -> None:
    """Register the obstacles of a world, for collision and display, on the world body of a plant not yet finalized.

    The bodies of a model file are added as its models. All else is anchored to the world body, which keeps a thousand
    obstacles cheap to simulate. More polygons than `MOST_POLYGONS`, and fixed meshes that are hollow, become surfaces,
    with which a plant has no contact: a `CollisionMonitor` of your own finds it by `make_surface_world`.

    Raises:
        StarnavError: the world has moving obstacles, which only `add_station` can drive; or as in `add_model`.
    """
    if len(world.moving_obstacles):
        raise StarnavError(
            f"world {world.name} has {len(world.moving_obstacles)} moving obstacles; allowed in a plant of your own: "
            "obstacles that stand, as add_station also adds what drives the others"
        )
    add_still_obstacles(plant, world)


def find_obstacle_height(plant: MultibodyPlant, scene_graph: SceneGraph) -> float:
    """Height of prisms, cylinders and walls in a plant, m: its robots and their lidars are lower."""
    needed_height = OBSTACLE_HEIGHT
    for model in map(ModelInstanceIndex, range(plant.num_model_instances())):
        if plant.HasBodyNamed("base_link", model):
            robot = RobotModel(plant, scene_graph, model)
            needed_height = max(needed_height, robot.top() + OVERHEAD, robot.find_highest_frame() + OVERHEAD)
    return needed_height


def add_still_obstacles(plant: MultibodyPlant, world: World, height: float | None = None) -> None:
    """The same as `add_world`, without a world's moving obstacles; None: of the height for the plant's robots."""
    if world.model is not None:  # whose footprints are the world's cylinders and polygons
        add_model(plant, Parser(plant).scene_graph(), world.model)
        return
    height = height or find_obstacle_height(plant, Parser(plant).scene_graph())
    z = 0.5 * height
    for k, (x, y, radius) in enumerate(world.cylinders):
        _add_shape(plant, f"cylinder_{k}", Cylinder(radius, height), RigidTransform([x, y, z]), OBSTACLE_COLOR)
    for k, (x, y, radius) in enumerate(world.spheres):
        _add_shape(plant, f"sphere_{k}", Sphere(radius), RigidTransform([x, y, radius]), OBSTACLE_COLOR)
    _add_prisms(plant, world, height)
    if world.bounds is not None:
        _add_walls(plant, world.bounds, height)


def _add_prisms(plant: MultibodyPlant, world: World, height: float) -> None:
    """Add the polygons of a world as prisms of a height, m: many of them look like one body, and very many are one."""
    convex_parts, is_solid = {}, make_surface_world(world) is None
    for k, polygon in enumerate(world.polygons):
        convex_parts.update({f"polygon_{k}_{i}": part for i, part in enumerate(split_into_convex_parts(polygon))})
    is_one_body = not is_solid or len(convex_parts) > MOST_LOOKS
    for name, part in convex_parts.items() if is_solid else ():
        _add_shape(plant, name, *_make_prism_shape(part, height, name), None if is_one_body else OBSTACLE_COLOR)
    if is_one_body:
        add_surface(plant, _make_prisms_mesh(list(convex_parts.values()), height), "polygons_visual", seen=not is_solid)


def make_surface_world(world: World) -> World | None:
    """A world with those obstacles that are surfaces in a plant, with which it has no contact; None without any.

    `CollisionMonitor` finds the robot's contacts with them.
    """
    polygons = world.polygons if world.model is None else world.model.surfaces
    if not polygons or world.model is None and len(polygons) <= MOST_POLYGONS:
        return None
    return World(world.name, world.start, world.goal, polygons=polygons)


def add_surface(plant: MultibodyPlant, mesh: Mesh, name: str, *, seen: bool) -> None:
    """Show a mesh in W, fixed to the world, in a plant not yet finalized; `seen`: whether lidars see it."""
    surface_look, perception = IllustrationProperties(), PerceptionProperties()
    surface_look.AddProperty("phong", "diffuse", Rgba(*OBSTACLE_COLOR))
    perception.AddProperty("phong", "diffuse", Rgba(*OBSTACLE_COLOR))
    if seen:
        perception.AddProperty(*SURFACE, True)
    instance = GeometryInstance(RigidTransform(), mesh, name)
    instance.set_illustration_properties(surface_look)
    instance.set_perception_properties(perception)
    plant.RegisterVisualGeometry(plant.world_body(), instance)


def _add_shape(plant: MultibodyPlant, name: str, shape: Shape, X_WG: RigidTransform, color: list[float] | None) -> None:
    body = plant.world_body()
    plant.RegisterCollisionGeometry(body, X_WG, shape, name, CoulombFriction(0.3, 0.3))
    if color is not None:
        plant.RegisterVisualGeometry(body, X_WG, shape, f"{name}_visual", color)


def _make_prism_shape(corners: np.ndarray, height: float, label: str) -> tuple[Shape, RigidTransform]:
    """The upright prism over a convex footprint: a box where it is a rectangle, the cheaper shape."""
    edges = np.roll(corners, -1, axis=0) - corners
    lengths = np.hypot(edges[:, 0], edges[:, 1])
    center = corners.mean(axis=0)
    z = 0.5 * height
    if len(corners) == 4:
        corner_cosines = np.einsum("ij,ij->i", edges, np.roll(edges, -1, axis=0)) / (lengths * np.roll(lengths, -1))
        if np.abs(corner_cosines).max() < 1e-9:
            R_WG = RotationMatrix.MakeZRotation(math.atan2(edges[0, 1], edges[0, 0]))
            return Box(lengths[0], lengths[1], height), RigidTransform(R_WG, [*center, z])
    return make_upright_prism(corners - center, height, label), RigidTransform([*center, z])


def make_upright_prism(corners: np.ndarray, height: float, label: str) -> Convex:
    """The prism over a convex polygon (n, 2), half above and half below it, m."""
    points = np.hstack([np.vstack((corners.T, np.full(len(corners), z))) for z in (-0.5 * height, 0.5 * height)])
    return Convex(points=points, label=label)


def _make_prisms_mesh(parts: list[np.ndarray], height: float) -> Mesh:
    """The upright prisms over convex footprints, as one mesh."""
    meshes = [make_prism(corners, 0.0, height) for corners in parts]
    first_vertices = np.cumsum([0, *(len(vertices) for vertices, _ in meshes)])
    triangles = [corners + k for (_, corners), k in zip(meshes, first_vertices, strict=False)]
    mesh_text = format_obj(np.vstack([vertices for vertices, _ in meshes]).round(9), np.vstack(triangles))
    return Mesh(InMemoryMesh(mesh_file=MemoryFile(mesh_text, ".obj", "obstacles.obj")))


def _add_walls(plant: MultibodyPlant, bounds: tuple[float, float, float, float], height: float) -> None:
    """Add walls of a height, m, along the outside of bounds; those along x reach around the corners."""
    low, high = np.reshape(bounds, (2, 2))
    middle, (length, width) = 0.5 * (low + high), high - low
    for side, x, y, box in (
        ("south", middle[0], low[1] - 0.5 * WALL_THICKNESS, (length + 2 * WALL_THICKNESS, WALL_THICKNESS)),
        ("north", middle[0], high[1] + 0.5 * WALL_THICKNESS, (length + 2 * WALL_THICKNESS, WALL_THICKNESS)),
        ("west", low[0] - 0.5 * WALL_THICKNESS, middle[1], (WALL_THICKNESS, width)),
        ("east", high[0] + 0.5 * WALL_THICKNESS, middle[1], (WALL_THICKNESS, width)),
    ):
        _add_shape(plant, f"wall_{side}", Box(*box, height), RigidTransform([x, y, 0.5 * height]), WALL_COLOR)
