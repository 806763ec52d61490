import numpy as np
from hypothesis import given, settings

from drake_starnav.planning.edge_coverage import UNCOVERED
from drake_starnav.planning.map_revision import with_stall_point
from drake_starnav.planning.parameters import PlannerParameters
from drake_starnav.planning.roadmap import COVER_SLACK, StarRoadmap, extended
from tests.helpers.scans import MARGINS, RADIUS, seeds, wandered

PARAMETERS = PlannerParameters()


def assert_open_where_no_other_region_covers(roadmap: StarRoadmap) -> None:
    coverage = roadmap.coverage
    for node in range(len(roadmap)):
        mine = coverage.owner == node
        is_open = ~roadmap.union.contains(coverage.rows[mine, 2:], COVER_SLACK)
        np.testing.assert_array_equal(coverage.covered_by[mine] == UNCOVERED, is_open)
    assert (np.diff(coverage.owner) >= 0).all()
    np.testing.assert_array_equal(coverage.open, np.flatnonzero(coverage.covered_by == UNCOVERED))
    for region in np.unique(coverage.covered_by[coverage.covered_by >= 0]):
        probes = coverage.rows[coverage.covered_by == region, 2:]
        assert roadmap.regions[region].alone.contains(probes, COVER_SLACK).all()


@settings(max_examples=15)
@given(seeds)
def test_edge_frontiers_are_open_where_no_other_region_covers_them(seed):
    _, roadmap = wandered(seed, nodes=6)
    assert_open_where_no_other_region_covers(roadmap)


@settings(max_examples=15)
@given(seeds)
def test_they_are_after_regions_were_cut_back_or_dropped_and_others_added(seed):
    world, before = wandered(seed, nodes=6)
    rows = before.coverage.rows.copy()
    place = before.union.center[3] + np.random.default_rng(seed).uniform(-0.6, 0.6, 2)
    after = with_stall_point(before, place, MARGINS, RADIUS)
    assert_open_where_no_other_region_covers(after)
    for roadmap in (before, after, before):  # the second extension of `before` finds its rows taken
        if len(roadmap):
            assert_open_where_no_other_region_covers(
                extended(roadmap, before.regions[2], *before.scans[2], MARGINS, RADIUS)
            )
    np.testing.assert_array_equal(before.coverage.rows, rows)


@settings(max_examples=15)
@given(seeds)
def test_all_frontiers_of_a_new_roadmap_are_open_edge_frontiers(seed):
    _, roadmap = wandered(seed, nodes=6)
    known = {tuple(row) for row in roadmap.coverage.rows[roadmap.coverage.open]}
    frontiers = roadmap.frontiers
    assert {tuple(row) for row in np.hstack((frontiers.stand, frontiers.probe))} <= known
