import numpy as np
from hypothesis import given, settings

from drake_starnav.planning.bucket_search import bucket_dijkstra
from drake_starnav.surroundings.region_union import RegionUnion
from tests.helpers.scans import seeds, wandered

ALIKE = RegionUnion.none(), (0.0, 0.0), 1.0, 0
"""No cell costs more for being unknown."""
NOWHERE = -1, -1


def random_weight(rng: np.random.Generator) -> np.ndarray:
    weight = np.where(rng.random((42, 52)) < 0.25, 0, rng.integers(10, 26, (42, 52))).astype(np.uint8)
    weight[[0, -1]] = weight[:, [0, -1]] = 0
    return weight


@settings(max_examples=25)
@given(seeds)
def test_a_search_towards_a_cell_finds_the_same_cost(seed):
    rng = np.random.default_rng(seed)
    weight = random_weight(rng)
    start, goal = (tuple(rng.integers(1, (41, 51)).tolist()) for _ in range(2))
    weight[start] = weight[goal] = 10
    whole, found = np.zeros((2, *weight.shape), np.int32)
    bucket_dijkstra(weight, whole, goal, NOWHERE, ALIKE)
    bucket_dijkstra(weight, found, goal, start, ALIKE)
    assert found[start] == whole[start]
    assert (found >= whole).all()
    assert (found < 0).sum() <= (whole < 0).sum()


@settings(max_examples=10)
@given(seeds)
def test_cells_outside_the_known_regions_weigh_more(seed):
    """As if they had been weighed before the search."""
    rng = np.random.default_rng(seed)
    _, roadmap = wandered(seed, nodes=3)
    weight, goal, cell, origin = random_weight(rng), (20, 25), 0.2, np.array((-4.0, -5.0))
    weight[goal] = 10
    i, j = np.indices(weight.shape)
    middles = origin + cell * np.stack((i - 1, j - 1), axis=-1).reshape(-1, 2)
    unknown = ~roadmap.union.contains(middles).reshape(weight.shape)
    before = np.where((weight > 0) & unknown, weight + 5, weight).astype(np.uint8)
    expected, found = np.zeros((2, *weight.shape), np.int32)
    bucket_dijkstra(before, expected, goal, NOWHERE, ALIKE)
    bucket_dijkstra(weight, found, goal, NOWHERE, (roadmap.union, tuple(origin.tolist()), cell, 5))
    np.testing.assert_array_equal(found, expected)
    reached = (found < 0) & (np.stack((i, j)) != np.reshape(goal, (2, 1, 1))).any(axis=0)
    np.testing.assert_array_equal(weight[reached], before[reached])
