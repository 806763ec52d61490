import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings

from drake_starnav.planning.distance_grid import HIT_ERROR
from drake_starnav.planning.map_revision import with_stall_point
from drake_starnav.planning.parameters import PlannerParameters
from drake_starnav.planning.roadmap import (
    StarRoadmap,
    blacklist_target,
    extended,
    rebuilt,
    refitted,
    uncovered_share,
)
from drake_starnav.regions.region_union import RegionUnion
from drake_starnav.regions.star_region import scan_region, united
from drake_starnav.worlds.world import World
from tests.helpers.scans import MARGINS, RADIUS, cast, distance, explored, observed, seeds, wandered

PARAMETERS = PlannerParameters()


def hits(roadmap: StarRoadmap) -> np.ndarray:
    return np.vstack([node.scan.points(node.pose) for node in roadmap.nodes])


def assert_same(one: StarRoadmap, other: StarRoadmap) -> None:
    for part in ("edges", "lengths", "blacklisted_targets"):
        np.testing.assert_array_equal(getattr(one, part), getattr(other, part))
    for name in RegionUnion._fields:
        np.testing.assert_array_equal(getattr(one.union, name), getattr(other.union, name))
    for name in ("viewpoint", "probe", "owner"):
        np.testing.assert_array_equal(getattr(one.frontiers, name), getattr(other.frontiers, name))


@settings(max_examples=15)
@given(seeds)
def test_frontiers_are_uncovered_open_and_owned_by_the_region_they_stand_in(seed):
    _, roadmap = wandered(seed)
    frontiers = roadmap.frontiers
    assert (roadmap.hits.distance(frontiers.probe) > RADIUS - HIT_ERROR).all()
    for k in range(len(roadmap)):
        mine = frontiers.where(frontiers.owner == k)
        assert not roadmap.union.contains(mine.probe).any()
        away = np.hypot(*(mine.viewpoint - roadmap.union.center[k]).T)
        assert (away <= roadmap.regions[k].reach + 1e-9).all() and (away > 0.12).all()


def test_a_probe_that_another_region_covers_dies():
    world = World("disc", (0, 0, 0), (4, 0), cylinders=[(1.5, 0.0, 0.3)])
    alone = explored(world, np.zeros((1, 2)))
    behind = np.hypot(*(alone.frontiers.probe - (2.3, 0.0)).T) < 1.5
    assert behind.any()
    both = explored(world, np.array(((0.0, 0.0), (2.6, 0.0))))
    region = both.regions[1]
    spent = region.contains(alone.frontiers.probe)
    assert spent.any() and not spent.all()
    old = both.frontiers.where(both.frontiers.owner == 0)
    remaining = {tuple(p) for p in old.probe.tolist()}
    assert not remaining & {tuple(p) for p in alone.frontiers.probe[spent].tolist()}
    assert not region.contains(old.probe).any()


@settings(max_examples=10)
@given(seeds)
def test_blacklisted_places_stay_away(seed):
    world, roadmap = wandered(seed, nodes=3)
    place = roadmap.frontiers.viewpoint[len(roadmap.frontiers) // 2]
    given_up = blacklist_target(roadmap, place, 0.2, place)
    gone = np.hypot(*(roadmap.frontiers.viewpoint - place).T) <= 0.2
    assert 0 < gone.sum() == len(roadmap.frontiers) - len(given_up.frontiers)
    assert given_up.blacklisted_targets[-1].tolist() == pytest.approx([*place, 0.2])
    scan, pose = roadmap.nodes[-1].scan, roadmap.nodes[-1].pose
    pose = pose + (0.05, 0.0, 0.4)
    scan = cast(world, pose)
    again = extended(given_up, observed(scan, pose), MARGINS, RADIUS)
    assert np.hypot(*(again.frontiers.viewpoint - place).T).min(initial=np.inf) > 0.2


@settings(max_examples=8)
@given(seeds)
def test_rebuilt_it_is_the_same(seed):
    _, roadmap = wandered(seed, nodes=4)
    again = rebuilt(roadmap, MARGINS, RADIUS)
    for part in ("center", "bearing_0", "values", "slopes"):
        np.testing.assert_array_equal(getattr(again.union, part), getattr(roadmap.union, part))
    np.testing.assert_array_equal(again.edges, roadmap.edges)
    assert again.hits is roadmap.hits


@settings(max_examples=8)
@given(seeds)
def test_in_a_rebuilt_roadmap_nothing_was_tried_in_vain(seed):
    _, roadmap = wandered(seed, nodes=3)
    viewpoint, probe = roadmap.frontiers.viewpoint[0], roadmap.frontiers.probe[0]
    given_up = with_stall_point(blacklist_target(roadmap, viewpoint, 10.0, probe), probe, MARGINS, RADIUS)
    given_up = dataclasses.replace(given_up, inspection_points=viewpoint[None])
    again = rebuilt(given_up, MARGINS, RADIUS)
    assert not len(given_up.frontiers) and len(given_up.blacklisted_probes) and len(given_up.stall_points)
    assert not any(
        len(part)
        for part in (again.blacklisted_targets, again.blacklisted_probes, again.inspection_points, again.stall_points)
    )
    assert_same(again, rebuilt(roadmap, MARGINS, RADIUS))
    for old, new in zip(roadmap.regions, again.regions, strict=True):
        np.testing.assert_array_equal(new.free_range, old.free_range)
        assert new.margin == old.margin > MARGINS.least - 1e-9


@settings(max_examples=8)
@given(seeds)
def test_snapshots_are_unchanged_by_later_ones(seed):
    world, roadmap = wandered(seed, nodes=3)
    _, copy = wandered(seed, nodes=3)
    probes = np.random.default_rng(seed).uniform(-3.0, 3.0, (200, 2))
    known = roadmap.hits.distance(probes)
    for x in (-0.1, 0.1):
        pose = np.array((x, 0.0, x))
        scan = cast(world, pose)
        extended(roadmap, observed(scan, pose), MARGINS, RADIUS)
    blacklist_target(roadmap, np.zeros(2), 1.0, np.zeros(2))
    rebuilt(roadmap, dataclasses.replace(MARGINS, preferred=0.0), RADIUS)
    assert_same(roadmap, copy)
    np.testing.assert_array_equal(roadmap.hits.distance(probes), known)


@settings(max_examples=15)
@given(seeds)
def test_the_uncovered_share_is_that_of_random_points_in_the_region(seed):
    _, roadmap = wandered(seed, nodes=5)
    *others, region = roadmap.regions
    rng = np.random.default_rng(seed)
    points = region.center + rng.uniform(-region.reach, region.reach, (20000, 2))
    points = points[region.contains(points)]
    new = ~np.any([other.contains(points) for other in others], axis=0)
    assert uncovered_share(region, united(others)) == pytest.approx(new.mean(), abs=0.03)
    assert uncovered_share(region, roadmap.union) == 0.0
    assert uncovered_share(region, RegionUnion.none()) == 1.0


@settings(max_examples=8)
@given(seeds)
def test_refitted_it_is_as_if_it_had_been_explored_with_the_other_footprint(seed):
    _, roadmap = wandered(seed, nodes=4)
    narrow, swept = 0.8 * RADIUS, 1.5 * RADIUS
    again = refitted(roadmap, MARGINS, narrow, swept)
    anew = StarRoadmap.empty(PlannerParameters(), swept)
    for node in roadmap.nodes:
        region = scan_region(node.scan, node.pose, narrow, MARGINS)
        anew = extended(anew, dataclasses.replace(node, region=region), MARGINS, narrow)
    np.testing.assert_array_equal(again.union.values, anew.union.values)
    np.testing.assert_array_equal(again.edges, anew.edges)
    np.testing.assert_array_equal(hits(again), hits(anew))
    assert again.hits.cap == anew.hits.cap


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
