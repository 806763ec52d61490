import dataclasses

import numpy as np
from hypothesis import given, settings

from drake_starnav.planning.grid import OFF, STRIDE
from drake_starnav.planning.roadmap import StarRoadmap, append_node, replace_regions
from drake_starnav.surroundings.star_region import clear_region
from tests.helpers.scans import MARGINS, RADIUS, seeds, wandered


def assert_counts_the_cells_of_its_regions(roadmap: StarRoadmap) -> None:
    (first, counts), cell = roadmap.grid.coverage, roadmap.grid.resolution * STRIDE
    middles = (first + np.argwhere(np.ones_like(counts)) + OFF) * cell
    expected = sum(region.as_union.contains(middles).astype(int) for region in roadmap.regions)
    np.testing.assert_array_equal(counts.ravel(), expected)
    low, high = first * cell, (first + counts.shape) * cell
    edges = np.vstack([region.outline() for region in roadmap.regions])
    assert (low <= edges).all() and (edges <= high).all()


@settings(max_examples=8, deadline=None)
@given(seeds)
def test_a_cell_is_known_while_a_region_covers_its_middle(seed):
    _, roadmap = wandered(seed, nodes=5)
    assert_counts_the_cells_of_its_regions(roadmap)
    rng = np.random.default_rng(seed)
    places = rng.uniform(-4.0, 4.0, (3, 2))
    cut = [clear_region(region, places, 0.3) for region in roadmap.regions]
    less = replace_regions(roadmap, cut, MARGINS, RADIUS)
    assert_counts_the_cells_of_its_regions(less)
    dropped = [None if k == 1 else region for k, region in enumerate(cut)]
    fewer = replace_regions(less, dropped, MARGINS, RADIUS)
    assert_counts_the_cells_of_its_regions(fewer)
    away = dataclasses.replace(roadmap.nodes[1], region=roadmap.nodes[1].region.transformed(np.array((9.0, -7.0, 1.0))))
    assert_counts_the_cells_of_its_regions(append_node(fewer, away, fewer.grid))
    assert_counts_the_cells_of_its_regions(roadmap)  # it has not changed
