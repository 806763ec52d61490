import numpy as np
import pytest
from hypothesis import given, settings

from drake_starnav.planning.node_graph import graph_distances
from drake_starnav.planning.roadmap import StarRoadmap
from drake_starnav.regions.star_region import StarRegion, scan_region
from drake_starnav.worlds.world import World
from tests.helpers.scans import MARGINS, RADIUS, cast, explored, free_point, seeds, wandered


def here(world: World, position: np.ndarray) -> StarRegion:
    pose = np.array((*position, 0.0))
    return scan_region(cast(world, pose), pose, RADIUS, MARGINS)


def floyd_warshall(roadmap: StarRoadmap) -> np.ndarray:
    cost = np.full((len(roadmap), len(roadmap)), np.inf)
    np.fill_diagonal(cost, 0.0)
    for (i, j), edge in zip(roadmap.edges, roadmap.lengths, strict=True):
        cost[i, j] = cost[j, i] = min(cost[i, j], edge)
    for k in range(len(roadmap)):
        cost = np.minimum(cost, cost[:, k, None] + cost[None, k])
    return cost


@settings(max_examples=15)
@given(seeds)
def test_graph_distances_match_floyd_warshall(seed):
    world, roadmap = wandered(seed, nodes=7)
    position = free_point(np.random.default_rng(seed + 1), world, RADIUS + 0.05)
    region = here(world, position)
    distances, previous = graph_distances(roadmap, region, position)
    centers = roadmap.union.center
    entries = [k for k, r in enumerate(roadmap.regions) if r.contains(position) or region.contains(centers[k])]
    direct = np.hypot(*(centers - position).T)
    expected = (direct[entries, None] + floyd_warshall(roadmap)[entries]).min(axis=0)
    np.testing.assert_allclose(distances, expected)
    for node, before in enumerate(previous):
        edge = [n for n, e in zip(roadmap.lengths, roadmap.edges.tolist(), strict=True) if set(e) == {node, before}]
        cost = direct[node] if before < 0 else distances[before] + edge[0]
        assert distances[node] == pytest.approx(cost)


def test_off_the_map_the_nearest_node_is_the_way_in():
    world = World("wall", (0, 0, 0), (3, 0), polygons=([(0.9, -5), (1.1, -5), (1.1, 5), (0.9, 5)],))
    roadmap = explored(world, np.array(((0.0, 0.0), (-1.0, 0.0))))
    distances, previous = graph_distances(roadmap, here(world, np.array((2.0, 0.0))), np.array((2.0, 0.0)))
    assert distances.tolist() == pytest.approx([2.0, 3.0]) and previous.tolist() == [-1, 0]
