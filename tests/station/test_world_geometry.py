"""A planar world as collision shapes: which shapes, where, and that the lidar sees them where they are."""

import math

import numpy as np
import pytest
from pydrake.geometry import Box, Convex, Cylinder, Role, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.schema import Scenario
from drake_starnav.station import world_geometry
from drake_starnav.station.navigation_station import NavigationStation
from drake_starnav.station.world_geometry import (
    GROUND_BORDER,
    MOST_LOOKS,
    MOST_POLYGONS,
    OBSTACLE_HEIGHT,
    WALL_THICKNESS,
    add_ground,
    add_world,
    surface_world,
)
from drake_starnav.worlds.moving_obstacles import MovingObstacles
from drake_starnav.worlds.world import World
from tests.helpers.scans import cast

LIDAR_HEIGHT = 0.13  # of the shipped robot, m
SQUARE = [(1.0, 1.0), (3.0, 1.0), (3.0, 2.0), (1.0, 2.0)]
TURNED = [
    (0.0, 0.0),
    (math.cos(0.4), math.sin(0.4)),
    (math.cos(0.4) - math.sin(0.4), math.sin(0.4) + math.cos(0.4)),
    (-math.sin(0.4), math.cos(0.4)),
]
TRIANGLE = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]
TRAPEZOID = [(0.0, 0.0), (3.0, 0.0), (2.0, 1.0), (1.0, 1.0)]
L_SHAPE = [(0.0, 0.0), (2.0, 0.0), (2.0, 0.5), (0.5, 0.5), (0.5, 2.0), (0.0, 2.0)]


def world_of(**obstacles) -> World:
    return World("test", (0.0, 0.0, 0.0), (1.0, 0.0), **obstacles)


def shapes(world: World, role: Role = Role.kProximity) -> dict:
    """Shape and X_WG of each obstacle by name, without the model's prefix; visual names without their ending."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=0.01)
    add_world(plant, world)
    plant.Finalize()
    inspector = scene_graph.model_inspector()
    found = {}
    for geometry in inspector.GetGeometries(plant.GetBodyFrameIdOrThrow(plant.world_body().index()), role):
        name = inspector.GetName(geometry).split("::")[-1].removesuffix("_visual")
        found[name] = (inspector.GetShape(geometry), inspector.GetPoseInFrame(geometry))
    return found


def test_moving_obstacles_are_not_left_out_in_silence() -> None:
    world = world_of(moving_obstacles=MovingObstacles([0.3], ([(0.0, 2.0, 0.0), (1.0, 3.0, 0.0)],)))
    plant, _ = AddMultibodyPlantSceneGraph(DiagramBuilder(), time_step=0.01)
    with pytest.raises(StarnavError, match="world test has 1 moving obstacles; allowed in a plant of your own"):
        add_world(plant, world)


def footprint(shape, X_WG: RigidTransform) -> tuple[np.ndarray, float, float]:
    """Corners of a prism in W, shape (n, 2), and its lower and upper end, m."""
    if isinstance(shape, Box):
        corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * 0.5 * shape.size()
    else:
        hull = shape.GetConvexHull()
        corners = np.array([hull.vertex(k) for k in range(hull.num_vertices())])
    points = (X_WG @ corners.T).T
    return np.unique(points[:, :2].round(9), axis=0), points[:, 2].min(), points[:, 2].max()


@pytest.mark.parametrize("polygon", [SQUARE, TURNED, SQUARE[::-1], [*SQUARE[:1], (2.0, 1.0), *SQUARE[1:]]])
def test_a_rectangle_becomes_a_box(polygon) -> None:
    ((shape, X_WG),) = shapes(world_of(polygons=(polygon,))).values()
    assert type(shape) is Box
    corners, low, high = footprint(shape, X_WG)
    rectangle = TURNED if polygon is TURNED else SQUARE
    assert corners == pytest.approx(np.unique(np.round(rectangle, 9), axis=0), abs=1e-8)
    assert (low, high) == pytest.approx((0.0, OBSTACLE_HEIGHT))


@pytest.mark.parametrize("polygon", [TRIANGLE, TRAPEZOID, [(x + y, y) for x, y in SQUARE]])
def test_any_other_convex_polygon_becomes_one_convex_prism(polygon) -> None:
    ((shape, X_WG),) = shapes(world_of(polygons=(polygon,))).values()
    assert type(shape) is Convex
    corners, low, high = footprint(shape, X_WG)
    assert corners == pytest.approx(np.unique(np.round(polygon, 9), axis=0), abs=1e-8)
    assert (low, high) == pytest.approx((0.0, OBSTACLE_HEIGHT))


def test_a_concave_polygon_becomes_several_parts_that_cover_it() -> None:
    parts = shapes(world_of(polygons=(TRIANGLE, L_SHAPE)))
    assert sorted(parts) == ["polygon_0_0", "polygon_1_0", "polygon_1_1"]
    corners = [footprint(*parts[name])[0] for name in ("polygon_1_0", "polygon_1_1")]
    assert {tuple(corner) for part in corners for corner in part} <= set(L_SHAPE)
    area = sum(_convex_area(part) for part in corners)
    assert area == pytest.approx(2.0 * 0.5 + 0.5 * 1.5)


def _convex_area(corners: np.ndarray) -> float:
    offset = corners - corners.mean(axis=0)
    x, y = corners[np.argsort(np.arctan2(offset[:, 1], offset[:, 0]))].T
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))


def test_round_obstacles_stand_and_rest_on_the_floor() -> None:
    found = shapes(world_of(cylinders=[(1.0, 2.0, 0.3)], spheres=[(-1.0, 0.5, 0.7)]))
    cylinder, X_WC = found["cylinder_0"]
    assert type(cylinder) is Cylinder
    assert (cylinder.radius(), cylinder.length()) == (0.3, OBSTACLE_HEIGHT)
    assert X_WC.translation() == pytest.approx([1.0, 2.0, 0.5 * OBSTACLE_HEIGHT])
    sphere, X_WS = found["sphere_0"]
    assert type(sphere) is Sphere
    assert sphere.radius() == 0.7
    assert X_WS.translation() == pytest.approx([-1.0, 0.5, 0.7])


def test_walls_stand_outside_the_bounds_and_close_the_corners() -> None:
    x0, y0, x1, y1 = bounds = (-1.0, -2.0, 4.0, 3.0)
    found = shapes(world_of(bounds=bounds))
    assert sorted(found) == ["wall_east", "wall_north", "wall_south", "wall_west"]
    t = WALL_THICKNESS
    expected = {
        "wall_south": (x0 - t, y0 - t, x1 + t, y0),
        "wall_north": (x0 - t, y1, x1 + t, y1 + t),
        "wall_west": (x0 - t, y0, x0, y1),
        "wall_east": (x1, y0, x1 + t, y1),
    }
    for name, box in expected.items():
        corners, *_ = footprint(*found[name])
        assert (*corners.min(axis=0), *corners.max(axis=0)) == pytest.approx(box)


def test_what_is_hit_is_what_is_shown() -> None:
    world = world_of(
        cylinders=[(3.0, 3.0, 0.4)], spheres=[(-3.0, 0.0, 0.5)], polygons=(SQUARE, L_SHAPE), bounds=(-5, -5, 5, 5)
    )
    hit, shown = shapes(world, Role.kProximity), shapes(world, Role.kIllustration)
    assert hit.keys() == shown.keys()
    for name, (shape, X_WG) in hit.items():
        assert type(shown[name][0]) is type(shape)
        assert shown[name][1].IsExactlyEqualTo(X_WG)


def test_many_prisms_are_shown_as_one_mesh() -> None:
    polygons = [np.array(TRIANGLE if k % 2 else SQUARE) + (4.0 * k, 0.0) for k in range(MOST_LOOKS + 1)]
    hit = shapes(world_of(polygons=tuple(polygons)))
    ((name, (mesh, X_WG)),) = shapes(world_of(polygons=tuple(polygons)), Role.kIllustration).items()
    assert len(hit) == len(polygons)
    assert name == "polygons"
    assert X_WG.IsExactlyIdentity()
    lines = mesh.source().in_memory().mesh_file.contents().decode().splitlines()
    vertices = {tuple(float(x) for x in line.split()[1:]) for line in lines if line.startswith("v")}
    assert vertices == {(x, y, z) for polygon in polygons for x, y in polygon for z in (0.0, OBSTACLE_HEIGHT)}
    corners = sum(len(polygon) for polygon in polygons)
    assert sum(line.startswith("f") for line in lines) == 4 * corners - 4 * len(polygons)


def test_more_polygons_than_a_plant_can_pair_are_one_surface() -> None:
    polygons = [np.array(TRIANGLE if k % 2 else SQUARE) + (4.0 * k, 0.0) for k in range(MOST_POLYGONS + 1)]
    assert surface_world(world_of(polygons=tuple(polygons[1:]))) is None
    world = world_of(polygons=tuple(polygons), cylinders=[(0.0, 3.0, 0.2)])
    surfaces = surface_world(world)
    assert (len(surfaces.polygons), len(surfaces.cylinders)) == (len(polygons), 0)
    assert sorted(shapes(world)) == ["cylinder_0"]
    assert sorted(shapes(world, Role.kPerception)) == ["cylinder_0", "polygons"]


def test_the_ground_is_a_box_below_the_floor_far_beyond_the_world() -> None:
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=0.01)
    ground = add_ground(plant, (-1.0, -2.0, 5.0, 3.0))
    plant.Finalize()
    inspector = scene_graph.model_inspector()
    corners, _, top = footprint(inspector.GetShape(ground), inspector.GetPoseInFrame(ground))
    assert top == 0.0
    assert corners.min(axis=0) == pytest.approx([-1.0 - GROUND_BORDER, -2.0 - GROUND_BORDER])
    assert corners.max(axis=0) == pytest.approx([5.0 + GROUND_BORDER, 3.0 + GROUND_BORDER])


def as_sliced(world: World, height: float) -> World:
    """The world whose spheres are cylinders of the radius that a plane at this height cuts out of them."""
    discs = [(x, y, math.sqrt(r**2 - (height - r) ** 2)) for x, y, r in world.spheres]
    return World(
        "sliced",
        world.start,
        world.goal,
        cylinders=np.vstack((world.cylinders, np.array(discs).reshape(-1, 3))),
        polygons=world.polygons,
        bounds=world.bounds,
    )


@pytest.mark.parametrize("most", [MOST_POLYGONS, 1])
@pytest.mark.parametrize("start", [(0.0, 0.0, 0.0), (-0.7, 0.3, 2.0)])
def test_the_station_s_lidar_measures_the_analytic_distances(start, most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(world_geometry, "MOST_POLYGONS", most)  # one surface, if it is 1
    world = World(
        "all kinds",
        start,
        (1.0, 0.0),
        cylinders=[(1.5, -1.2, 0.3)],
        spheres=[(-2.0, -0.5, 0.5), (0.5, 1.5, 0.2)],
        polygons=([(1.8, 0.5), (2.6, 0.7), (2.0, 1.3)], np.array(L_SHAPE) * 0.6 + (-2.0, 1.0)),
        bounds=(-3.0, -3.0, 4.0, 3.0),
    )
    lidar = LidarParameters(noise=0.0, range_max=4.0)
    station = NavigationStation(world, Scenario("test", None, RobotParameters(), lidar))
    simulator = Simulator(station)
    station.GetInputPort("drive.twist_command").FixValue(simulator.get_mutable_context(), [0.0, 0.0])
    simulator.Initialize()
    context = simulator.get_context()
    assert station.GetOutputPort("lidar.X_WS").Eval(context).translation() == pytest.approx([*start[:2], LIDAR_HEIGHT])
    scan = station.GetOutputPort("lidar.scan").Eval(context)
    exact = cast(as_sliced(world, LIDAR_HEIGHT), np.array(start), beams=lidar.beams, range_max=lidar.range_max)
    assert np.array_equal(scan.hits, exact.hits)
    assert 100 < scan.hits.sum() < lidar.beams
    assert scan.ranges[scan.hits] == pytest.approx(exact.ranges[exact.hits], abs=1e-6)
