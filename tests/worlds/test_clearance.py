"""Clearance against shapely."""

import numpy as np
import pytest
import shapely

from drake_starnav.geometry.footprint import find_covered_area, footprint
from drake_starnav.worlds import World, compute_clearance
from drake_starnav.worlds.clearance import compute_body_clearance, find_nearest_obstacle
from drake_starnav.worlds.moving_obstacles import (
    MovingObstacles,
    compute_moving_obstacle_clearance,
    moving_obstacle_states,
)
from drake_starnav.worlds.world import ROBOT_HEIGHT

U_SHAPE = np.array([(1.0, 1.0), (3.0, 1.0), (3.0, 2.5), (2.7, 2.5), (2.7, 1.3), (1.3, 1.3), (1.3, 2.5), (1.0, 2.5)])


def world(**changes) -> World:
    solids = {"cylinders": [(0.5, 3.0, 0.3), (3.4, 0.5, 0.2)], "spheres": [(2.0, 3.2, 0.4)], "polygons": (U_SHAPE,)}
    return World("test", (0.2, 0.2, 0.0), (3.8, 3.8), bounds=(0.0, 0.0, 4.0, 4.0), **(solids | changes))


@pytest.mark.parametrize("order", [1, -1])
def test_clearance_is_the_least_distance_from_any_obstacle_and_negative_inside(order):
    points = np.random.default_rng(1).uniform(-0.5, 4.5, (5000, 2))
    w, solid, places = world(polygons=(U_SHAPE[::order],)), shapely.Polygon(U_SHAPE), shapely.points(points)
    outline, (x0, y0, x1, y1) = shapely.distance(solid.boundary, places), w.bounds
    distances = [np.where(shapely.contains(solid, places), -outline, outline)]
    distances += [np.hypot(*(points - disc[:2]).T) - disc[2] for disc in w.discs]
    distances += [points[:, 0] - x0, x1 - points[:, 0], points[:, 1] - y0, y1 - points[:, 1]]
    np.testing.assert_allclose(compute_clearance(w, points), np.min(distances, axis=0), atol=1e-12)


@pytest.mark.parametrize(
    ("point", "name"),
    [((0.9, 3.0), "cylinders[0]"), ((2.0, 2.7), "spheres[0]"), ((2.0, 1.4), "polygons[0]"), ((3.9, 2.0), "bounds")],
)
def test_nearest_obstacle_is_named(point, name):
    assert find_nearest_obstacle(world(), point)[0] == name


def test_sphere_section_below_robot_height() -> None:
    world = World("x", (0.0, 0.0, 0.0), (1.0, 0.0), spheres=[(3.0, 0.0, 0.4), (6.0, 0.0, 0.1)])
    section = np.sqrt(0.4**2 - (0.4 - ROBOT_HEIGHT) ** 2)
    points = np.array([(3.0 - section - 0.2, 0.0), (6.3, 0.0)])
    np.testing.assert_allclose(compute_clearance(world, points), [0.2, 0.2], atol=1e-12)  # a small sphere counts whole


FORK = footprint(  # a body with two thin tines, which no discs of one radius cover tightly
    (
        ((-0.5, -0.3), (0.0, -0.3), (0.0, 0.3), (-0.5, 0.3)),
        ((-0.1, -0.3), (0.6, -0.3), (0.6, -0.28), (-0.1, -0.28)),
        ((-0.1, 0.28), (0.6, 0.28), (0.6, 0.3), (-0.1, 0.3)),
    )
)


@pytest.mark.parametrize("shape", [FORK, footprint(((0.4, -0.25), (0.4, 0.25), (-0.4, 0.25), (-0.4, -0.25)))])
def test_a_body_keeps_the_distance_that_shapely_finds_from_what_stands_and_what_moves(shape):
    rng = np.random.default_rng(3)
    poses = np.column_stack((rng.uniform(-1.0, 5.0, (400, 2)), rng.uniform(-4.0, 4.0, 400)))
    times = rng.uniform(0.0, 20.0, len(poses))
    path = np.array([(0.0, 0.0, 0.0), (5.0, 4.0, 1.0), (12.0, 1.0, 4.0), (14.0, 0.0, 0.0)])
    moving = MovingObstacles(np.array([0.3, 0.2]), (path, path[:2]))
    placed, w = [find_covered_area(shape, pose) for pose in poses], world()
    shapes = [shapely.Polygon(U_SHAPE), *(shapely.Point(x, y).buffer(r, 512) for x, y, r in w.discs)]
    walls = shapely.box(*w.bounds)
    positions, _ = moving_obstacle_states(moving, times)
    for k, (body, stands) in enumerate(zip(placed, compute_body_clearance(w, poses, shape), strict=True)):
        inside = walls.covers(body)
        gap = min(min(map(body.distance, shapes)), body.distance(walls.exterior)) if inside else 0.0
        assert max(stands, 0.0) == pytest.approx(gap, abs=1e-5)
        assert (stands < 0.0) == (not inside or any(body.intersection(each).area > 1e-9 for each in shapes))
        points = [shapely.Point(position) for position in positions[k]]
        away = [body.distance(point) - radius for point, radius in zip(points, moving.radii, strict=True)]
        moves = compute_moving_obstacle_clearance(moving, poses[k : k + 1], times[k : k + 1], shape)[0]
        if any(map(body.contains, points)):
            assert moves < min(away)
        else:
            assert moves == pytest.approx(min(away), abs=1e-9)
