"""The omniscient shortest path against lengths known in closed form."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given

from drake_starnav.errors import StarnavError
from drake_starnav.worlds import Forest, Maze, World, compute_clearance, find_shortest_path, make_world
from drake_starnav.worlds.outlines import make_rectangle, make_trap
from drake_starnav.worlds.shortest_path import is_segment_blocked
from tests.helpers.scans import seeds


@given(seeds)
def test_a_segment_is_blocked_where_a_point_of_it_is_inside(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = rng.uniform(-2.0, 2.0, (2, 2))
    capsule = np.array((*rng.uniform(-2.0, 2.0, 4), rng.uniform(0.1, 1.0)))
    nearest = shapely.distance(shapely.LineString((a, b)), shapely.LineString(capsule[:4].reshape(2, 2)))
    if abs(nearest - capsule[4]) > 1e-9:
        assert is_segment_blocked(*a, *b, capsule) == (nearest < capsule[4])


def check_path(world: World, radius: float, length: float, path: np.ndarray) -> None:
    """A path joins start and goal, has its stated length, and keeps its distance everywhere."""
    np.testing.assert_array_equal(path[0], world.start[:2])
    np.testing.assert_array_equal(path[-1], world.goal)
    assert length == pytest.approx(np.hypot(*np.diff(path, axis=0).T).sum())
    points = shapely.get_coordinates(shapely.LineString(path).segmentize(0.01))
    assert compute_clearance(world, points).min() >= radius - 1e-6


@pytest.mark.parametrize("goal", [(4.03, 0.32), (3.0, 1.517)])
@pytest.mark.parametrize(("radius", "start"), [(0.1, -3.011), (0.7, -3.011), (1.9, -6.0)])
def test_around_one_disc(radius, start, goal):
    """Also on an open plane, where the way round is far from all obstacles."""
    world = World("disc", (start, 0.013, 0.0), goal, cylinders=[(0.0, 0.0, 1.0)])
    length, path = find_shortest_path(world, radius)
    check_path(world, radius, length, path)
    reach = 1.0 + radius
    start_distance, goal_distance = math.hypot(*world.start[:2]), math.hypot(*goal)
    between = math.atan2(goal[1], goal[0]) - math.atan2(world.start[1], world.start[0])
    between = abs(math.remainder(between, 2.0 * math.pi))
    arc = between - math.acos(reach / start_distance) - math.acos(reach / goal_distance)
    assert arc > 0.0
    exact = math.sqrt(start_distance**2 - reach**2) + arc * reach + math.sqrt(goal_distance**2 - reach**2)
    assert exact - 1e-9 <= length <= 1.001 * exact


def test_a_path_from_a_coarse_grid_is_pulled_taut_all_the_way():
    a = 4.5 * np.array((math.cos(0.5), math.sin(0.5)))
    world = World("disc", (*-a, 0.0), (a[0], a[1] + 1.0), cylinders=[(0.0, 0.0, 3.0)])
    assert find_shortest_path(world, 0.25, 0.8)[0] == pytest.approx(find_shortest_path(world, 0.25, 0.05)[0], rel=1e-3)


def test_a_thin_robot_does_not_slip_through_a_zero_width_gap():
    walls = (make_rectangle(-0.2, -5.0, 0.0, 0.0), make_rectangle(-0.1, 0.0, 0.1, 5.0))
    world = World("slit", (-3.0, 0.0, 0.0), (3.0, 0.0), polygons=walls, bounds=(-5.0, -5.0, 5.0, 5.0))
    assert find_shortest_path(world, 0.001) is None


@pytest.mark.parametrize("goal", [(0.0, 0.0), (0.0, 0.6)])
def test_an_end_in_collision_is_no_way(goal):
    world = World("disc", (-3.0, 0.0, 0.0), goal, cylinders=[(0.0, 0.0, 0.5)])
    assert find_shortest_path(world, 0.25) is None


def test_out_of_a_trap_and_round_it():
    world = World("trap", (0.5, 0.0, 0.0), (-2.0, 0.0), polygons=(make_trap(2.0, 1.5, 0.1, 2),))
    length, path = find_shortest_path(world, 0.25)
    check_path(world, 0.25, length, path)
    mirrored = World("trap", (-2.0, 0.0, 0.0), (0.5, 0.0), polygons=(make_trap(2.0, 1.5, 0.1, 2)[::-1],))
    assert find_shortest_path(mirrored, 0.25)[0] == pytest.approx(length, rel=1e-3)


@pytest.mark.parametrize("kind", [Forest(), Maze(family="cells"), Maze(family="open")])
@pytest.mark.parametrize("seed", range(2))
def test_paths_in_worlds_are_clear_and_no_longer_than_with_a_larger_robot(kind, seed):
    world = make_world(kind, seed, 0.25)
    length, path = find_shortest_path(world, 0.25)
    check_path(world, 0.25, length, path)
    larger, wide = find_shortest_path(world, 0.3)
    check_path(world, 0.3, larger, wide)
    # the two may go round obstacles on different sides, of nearly equal lengths
    assert math.dist(world.start[:2], world.goal) <= length <= 1.01 * larger


@pytest.mark.parametrize(("radius", "resolution"), [(0.0, 0.05), (math.nan, 0.05), (0.25, 0.0), (0.25, 1e-5)])
def test_bad_arguments_are_refused(radius, resolution):
    world = World("disc", (-3.0, 0.0, 0.0), (3.0, 0.0), cylinders=[(0.0, 0.0, 0.5)])
    with pytest.raises(StarnavError, match="allowed"):
        find_shortest_path(world, radius, resolution)
