import numpy as np
import pytest
from hypothesis import given, settings

from drake_starnav.worlds.world import World
from tests.helpers.scans import RADIUS, distance, explored, seeds, wandered


@settings(max_examples=15)
@given(seeds)
def test_edges_are_free(seed):
    world, roadmap = wandered(seed, nodes=6)
    assert len(roadmap.edges) == len({tuple(e) for e in roadmap.edges.tolist()}) > 0
    for (i, j), length in zip(roadmap.edges, roadmap.lengths, strict=True):
        a, b = roadmap.union.center[i], roadmap.union.center[j]
        apart = float(np.hypot(*(b - a)))
        assert i < j and length == pytest.approx(apart)
        if roadmap.regions[i].contains(b) or roadmap.regions[j].contains(a):
            line = a + (b - a) * np.linspace(0.0, 1.0, 200)[:, None]
            assert np.any([r.contains(line) for r in roadmap.regions], axis=0)[1:-1].all()
            assert distance(world, line).min() > RADIUS
        else:  # see the next test
            assert (roadmap.edges[:, 1] == j).sum() == 1


def test_a_node_that_no_region_sees_is_joined_to_the_one_it_is_least_outside_of():
    world = World("wall", (0, 0, 0), (2, 0), polygons=([(0.9, -5), (1.1, -5), (1.1, 5), (0.9, 5)],))
    roadmap = explored(world, np.array(((0.0, 0.0), (-4.0, 0.0), (2.0, 0.0))))
    assert roadmap.edges.tolist() == [[0, 1], [0, 2]]
    assert roadmap.lengths.tolist() == pytest.approx([4.0, 2.0])
