import numpy as np
import pytest
from hypothesis import given, settings

from drake_starnav.planning.distance_grid import STRIDE
from drake_starnav.planning.parameters import PlannerParameters
from drake_starnav.planning.virtual_frontiers import VIRTUAL_FRONTIER_LENGTH, virtual_frontier
from tests.helpers.scans import seeds, wandered

HALF_CELL = 0.5 * STRIDE * PlannerParameters().grid_resolution
"""Half of a side of a cell of the cost-to-go, m."""


@settings(max_examples=15)
@given(seeds)
def test_a_virtual_frontier_is_where_a_path_leaves_the_regions_for_good(seed):
    world, roadmap = wandered(seed, nodes=3)
    start, angle = roadmap.union.center[0], np.random.default_rng(seed).uniform(-np.pi, np.pi)
    path = start + np.arange(0.0, 12.0, 0.1)[:, None] * (np.cos(angle), np.sin(angle))
    frontier, way = virtual_frontier(roadmap, path)
    assert len(frontier) == 1 and roadmap.regions[frontier.owner[0]].contains(frontier.viewpoint[0])
    away = np.hypot(*(path - frontier.viewpoint[0]).T)
    assert away.min() < HALF_CELL + 1e-9
    after = np.argmin(away) + 1
    last = np.argmin(np.hypot(*(path - frontier.probe[0]).T))
    around = HALF_CELL * np.array([(0, 0), (1, 0), (0, 1), (-1, 0), (0, -1)])
    beyond = (path[after : last + 1, None] + around).reshape(-1, 2)
    assert len(beyond) and not any(region.contains(beyond).any() for region in roadmap.regions)
    assert (
        VIRTUAL_FRONTIER_LENGTH - HALF_CELL
        <= np.hypot(*(frontier.probe[0] - frontier.viewpoint[0]))
        < VIRTUAL_FRONTIER_LENGTH + 0.1 + HALF_CELL + 1e-9
    )
    np.testing.assert_array_equal(way[-1], frontier.viewpoint[0])


def test_a_virtual_frontier_may_be_where_the_robot_stands_just_outside_of_the_regions():
    _, roadmap = wandered(1, nodes=1)
    direction = np.array((1.0, 0.0))
    edge = next(r for r in np.arange(0.05, 12.0, 0.05) if not roadmap.regions[0].contains(r * direction))
    for outside in (0.01, HALF_CELL + 0.01):
        path = (edge + outside + np.arange(0.0, 1.0, 0.1))[:, None] * direction
        frontier, way = virtual_frontier(roadmap, path)
        if outside > HALF_CELL:
            np.testing.assert_array_equal(frontier.viewpoint, path[:1])
        else:  # a place in the robot's cell is inside
            assert roadmap.regions[0].contains(frontier.viewpoint[0])
            assert np.hypot(*(frontier.viewpoint[0] - path[0])) == pytest.approx(HALF_CELL)
        assert len(way) == 1 and frontier.owner.tolist() == [0]
