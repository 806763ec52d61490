import numpy as np
from hypothesis import given, settings

from drake_starnav.planning.bucket_search import UNREACHED, bucket_dijkstra
from tests.helpers.scans import seeds


@settings(max_examples=25)
@given(seeds)
def test_a_search_towards_a_cell_finds_the_same_cost(seed):
    rng = np.random.default_rng(seed)
    weight = np.where(rng.random((42, 52)) < 0.25, 0, rng.integers(10, 26, (42, 52))).astype(np.uint8)
    weight[[0, -1]] = weight[:, [0, -1]] = 0
    start, goal = rng.integers(1, (41, 51)), rng.integers(1, (41, 51))
    weight[tuple(start)] = weight[tuple(goal)] = 10
    cost_to_come, whole, found = (np.zeros(weight.shape, np.int32) for _ in range(3))
    bucket_dijkstra(weight, whole, *goal, cost_to_come)
    cost_to_come[tuple(start)] = -UNREACHED
    bucket_dijkstra(weight, found, *goal, cost_to_come, 0, *start)
    assert found[tuple(start)] == whole[tuple(start)]
    assert (found >= whole).all()
    assert (found < 0).sum() <= (whole < 0).sum()
