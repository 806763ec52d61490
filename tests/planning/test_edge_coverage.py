import numpy as np
from hypothesis import given, settings

from drake_starnav.planning.edge_coverage import UNCOVERED
from drake_starnav.planning.frontiers import uncovered
from drake_starnav.planning.roadmap import COVER_SLACK
from tests.helpers.scans import seeds, wandered


@settings(max_examples=15)
@given(seeds)
def test_edge_frontiers_are_open_where_no_other_region_covers_them(seed):
    _, roadmap = wandered(seed, nodes=6)
    coverage, at = roadmap.coverage, 0
    for node, rows in enumerate(coverage.rows):
        by = coverage.covered_by[at : at + len(rows)]
        is_open = uncovered(rows[:, 2:], roadmap.stack.arrays, skip=node, slack=COVER_SLACK)
        np.testing.assert_array_equal(by == UNCOVERED, is_open)
        at += len(rows)
    np.testing.assert_array_equal(coverage.open, np.flatnonzero(coverage.covered_by == UNCOVERED))
    np.testing.assert_array_equal(coverage.open_rows, np.vstack(coverage.rows)[coverage.open])


@settings(max_examples=15)
@given(seeds)
def test_all_frontiers_of_a_new_roadmap_are_open_edge_frontiers(seed):
    _, roadmap = wandered(seed, nodes=6)
    known = {tuple(row) for row in roadmap.coverage.open_rows}
    frontiers = roadmap.frontiers
    assert {tuple(row) for row in np.hstack((frontiers.stand, frontiers.probe))} <= known
