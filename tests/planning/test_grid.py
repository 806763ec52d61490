"""The distances to all hits, in tiles that snapshots share."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_starnav.planning.grid import STRIDE, Grid
from tests.helpers.scans import RADIUS, seeds

RESOLUTION = 0.05


def memory(points: np.ndarray, parts: int = 1) -> Grid:
    out = Grid.empty(RESOLUTION, RADIUS)
    for part in np.array_split(points, parts):
        out = out.add_hits(part)
    return out


def nearest(points: np.ndarray, hits: np.ndarray) -> np.ndarray:
    return np.hypot(*np.moveaxis(points[:, None] - hits, -1, 0)).min(axis=1)


@settings(max_examples=25)
@given(seeds, st.sampled_from([0.0, 40.0, -1000.0]), st.sampled_from([1, 4]))
def test_distances_match_brute_force_within_the_resolution(seed, away, parts):
    rng = np.random.default_rng(seed)
    hits = rng.uniform(-4.0, 4.0, (300, 2)) + away
    points = rng.uniform(-5.0, 5.0, (500, 2)) + away
    grid = memory(hits, parts)
    centres = np.rint(points / RESOLUTION) * RESOLUTION
    exact = np.minimum(nearest(centres, hits), grid.cap)
    error = grid.distance(points) - exact
    assert error.min() > -1e-5  # a hit in the same half cell as another may be left out, but none is invented
    assert error.max() < 1.35 * RESOLUTION


def test_nothing_was_hit_far_away_or_in_an_empty_memory():
    empty = Grid.empty(RESOLUTION, RADIUS)
    points = np.array(((0.0, 0.0), (100.0, -3.0)))
    assert (empty.distance(points) == empty.cap).all()
    assert empty.distance(np.zeros((0, 2))).shape == (0,)
    assert empty.add_hits(np.zeros((0, 2))) is empty
    assert memory(np.zeros((1, 2))).distance(points).tolist() == pytest.approx([0.0, empty.cap])


@settings(max_examples=10)
@given(seeds)
def test_snapshots_are_immutable_and_share_untouched_tiles(seed):
    rng = np.random.default_rng(seed)
    before = memory(np.vstack((rng.uniform(0.0, 1.0, (50, 2)), rng.uniform(20.0, 21.0, (50, 2)))))
    points = rng.uniform(-1.0, 22.0, (400, 2))
    distances = before.distance(points)
    copies = {key: tile.copy() for key, tile in before.tiles.items()}
    near = rng.uniform(0.0, 1.0, (50, 2))
    after, fork = before.add_hits(near), before.add_hits(near)
    assert (before.distance(points) == distances).all() and (after.distance(points) <= distances).all()
    assert all((before.tiles[key] == tile).all() for key, tile in copies.items())
    shared = [key for key, tile in after.tiles.items() if np.shares_memory(tile, before.tiles.get(key, points))]
    assert shared and len(shared) < len(after.tiles)
    assert all((fork.tiles[key] == tile).all() for key, tile in after.tiles.items())
    later = after.add_hits(near + 0.3)
    assert (later.distance(points) == fork.add_hits(near + 0.3).distance(points)).all()


@settings(max_examples=10)
@given(seeds)
def test_the_coarse_cells_of_a_box_cover_it_by_whole_cells(seed):
    rng = np.random.default_rng(seed)
    grid = memory(rng.uniform(-4.0, 4.0, (200, 2)))
    low = rng.uniform(-6.0, 0.0, 2)
    high = low + rng.uniform(1.0, 6.0, 2)
    first, count = grid.box(low, high)
    assert (first * STRIDE * RESOLUTION <= low + 1e-9).all()
    assert ((first + count) * STRIDE * RESOLUTION >= high - 1e-9).all()
    numbers = STRIDE * (first + np.moveaxis(np.indices(count), 0, -1).reshape(-1, 2))
    places, distance = grid.coarse((numbers + 0.5 * (STRIDE - 1)) * RESOLUTION)
    inside = np.rint(places / RESOLUTION).astype(int)
    np.testing.assert_allclose(places, inside * RESOLUTION, atol=1e-9)
    assert {tuple(cell) for cell in (inside - numbers[:, None]).reshape(-1, 2).tolist()} == set(
        np.ndindex(STRIDE, STRIDE)
    )
    np.testing.assert_array_equal(distance.ravel(), grid.distance(inside.reshape(-1, 2) * RESOLUTION))
