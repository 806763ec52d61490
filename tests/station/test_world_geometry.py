"""A planar world as collision shapes: which shapes, where, and that the lidar sees them where they are."""

import dataclasses
import math

import numpy as np
import pytest
import shapely
from pydrake.geometry import Box, Role
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_starnav import LidarParameters, NavigationStation, RobotParameters, Scenario, StarnavError, World
from drake_starnav.station import world_geometry
from drake_starnav.station.world_geometry import (
    MOST_LOOKS,
    MOST_POLYGONS,
    OBSTACLE_HEIGHT,
    add_world,
    make_surface_world,
)
from drake_starnav.worlds.moving_obstacles import MovingObstacles
from drake_starnav.worlds.outlines import place
from tests.helpers.scans import cast

LIDAR_HEIGHT = 0.13  # of the shipped robot, m
SQUARE = [(1.0, 1.0), (3.0, 1.0), (3.0, 2.0), (1.0, 2.0)]
TURNED = [tuple(corner) for corner in place(np.array([(0, 0), (1, 0), (1, 1), (0, 1)]), (0.0, 0.0), 0.4)]
TRIANGLE = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]
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


def footprint(shape, X_WG: RigidTransform) -> tuple[shapely.Polygon, float, float]:
    """What a prism covers in W, and its lower and upper end, m."""
    if isinstance(shape, Box):
        corners = 0.5 * shape.size() * np.array(np.meshgrid(*3 * [(-1, 1)])).reshape(3, -1).T
    else:
        hull = shape.GetConvexHull()
        corners = np.array([hull.vertex(k) for k in range(hull.num_vertices())])
    points = (X_WG @ corners.T).T
    return shapely.MultiPoint(points[:, :2]).convex_hull, points[:, 2].min(), points[:, 2].max()


@pytest.mark.parametrize("polygon", [SQUARE, TURNED, SQUARE[::-1], [*SQUARE[:1], (2.0, 1.0), *SQUARE[1:]]])
def test_a_rectangle_becomes_a_box(polygon) -> None:
    ((shape, X_WG),) = shapes(world_of(polygons=(polygon,))).values()
    assert type(shape) is Box
    covered, low, high = footprint(shape, X_WG)
    assert shapely.hausdorff_distance(covered, shapely.Polygon(polygon)) < 1e-8
    assert (low, high) == pytest.approx((0.0, OBSTACLE_HEIGHT))


def test_a_concave_polygon_becomes_several_parts_that_cover_it() -> None:
    parts = shapes(world_of(polygons=(TRIANGLE, L_SHAPE)))
    assert sorted(parts) == ["polygon_0_0", "polygon_1_0", "polygon_1_1"]
    first, second = (footprint(*parts[name])[0] for name in ("polygon_1_0", "polygon_1_1"))
    assert first.intersection(second).area < 1e-9
    assert first.union(second).symmetric_difference(shapely.Polygon(L_SHAPE)).area < 1e-9


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
    assert make_surface_world(world_of(polygons=tuple(polygons[1:]))) is None
    world = world_of(polygons=tuple(polygons), cylinders=[(0.0, 3.0, 0.2)])
    surfaces = make_surface_world(world)
    assert (len(surfaces.polygons), len(surfaces.cylinders)) == (len(polygons), 0)
    assert sorted(shapes(world)) == ["cylinder_0"]
    assert sorted(shapes(world, Role.kPerception)) == ["cylinder_0", "polygons"]


def as_sliced(world: World, height: float) -> World:
    """The world whose spheres are cylinders of the radius that a plane at this height cuts out of them."""
    discs = [(x, y, math.sqrt(r**2 - (height - r) ** 2)) for x, y, r in world.spheres]
    return dataclasses.replace(world, cylinders=[*map(tuple, world.cylinders), *discs], spheres=[])


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
