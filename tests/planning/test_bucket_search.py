import numpy as np
from hypothesis import given, settings

from drake_starnav.planning.bucket_search import search_buckets
from tests.helpers.scans import seeds

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
    search_buckets(weight, whole, goal, NOWHERE)
    search_buckets(weight, found, goal, start)
    assert found[start] == whole[start]
    assert (found >= whole).all()
    assert (found < 0).sum() <= (whole < 0).sum()
