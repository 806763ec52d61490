import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings

from drake_starnav.planning.parameters import PlannerParameters
from drake_starnav.planning.roadmap import (
    CLOSURE_RADIUS,
    StarRoadmap,
    add_node,
    measure_uncovered_share,
    refit_regions,
    replace_regions,
)
from drake_starnav.planning.state import PlannerState
from drake_starnav.surroundings.region_union import RegionUnion
from drake_starnav.surroundings.star_region import clear_region, unite_regions
from drake_starnav.worlds.world import World
from tests.helpers.scans import MARGINS, RADIUS, cast, distance, explored, observed, seeds, wandered

PARAMETERS = PlannerParameters()
INITIAL = PlannerState.initial(PARAMETERS, RADIUS)


def hits(roadmap: StarRoadmap) -> np.ndarray:
    return np.vstack([node.scan.points(node.pose) for node in roadmap.nodes])


def assert_same(one: StarRoadmap, other: StarRoadmap) -> None:
    np.testing.assert_array_equal(one.edges, other.edges)
    for name in RegionUnion._fields:
        np.testing.assert_array_equal(getattr(one.union, name), getattr(other.union, name))


@settings(max_examples=8)
@given(seeds)
def test_snapshots_are_unchanged_by_later_ones(seed):
    world, roadmap = wandered(seed, nodes=3)
    _, copy = wandered(seed, nodes=3)
    probes = np.random.default_rng(seed).uniform(-3.0, 3.0, (200, 2))
    known = roadmap.grid.distance(probes)
    for x in (-0.1, 0.1):
        pose = np.array((x, 0.0, x))
        scan = cast(world, pose)
        add_node(roadmap, observed(scan, pose), MARGINS, RADIUS)
    replace_regions(
        roadmap,
        [clear_region(region, np.ones((1, 2)), CLOSURE_RADIUS * RADIUS) for region in roadmap.regions],
        MARGINS,
        RADIUS,
    )
    refit_regions(roadmap, dataclasses.replace(MARGINS, preferred=0.0), RADIUS)
    assert_same(roadmap, copy)
    np.testing.assert_array_equal(roadmap.grid.distance(probes), known)


@settings(max_examples=15)
@given(seeds)
def test_the_uncovered_share_is_that_of_random_points_in_the_region(seed):
    _, roadmap = wandered(seed, nodes=5)
    *others, region = roadmap.regions
    rng = np.random.default_rng(seed)
    points = region.center + rng.uniform(-region.reach, region.reach, (20000, 2))
    points = points[region.contains(points)]
    new = ~np.any([other.contains(points) for other in others], axis=0)
    assert measure_uncovered_share(region, unite_regions(others)) == pytest.approx(new.mean(), abs=0.03)
    assert measure_uncovered_share(region, roadmap.union) == 0.0
    assert measure_uncovered_share(region, RegionUnion.none()) == 1.0


@settings(max_examples=15)
@given(seeds)
def test_edges_are_free(seed):
    world, roadmap = wandered(seed, nodes=6)
    assert len(roadmap.edges) == len({tuple(e) for e in roadmap.edges.tolist()}) > 0
    for i, j in roadmap.edges:
        a, b = roadmap.union.center[i], roadmap.union.center[j]
        assert i < j
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
