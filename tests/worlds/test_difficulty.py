"""The tightest gap of worlds whose gaps are known."""

import math

import numpy as np
import pytest

from drake_starnav.worlds import Forest, World, make_world, shortest_path
from drake_starnav.worlds.difficulty import FARTHEST, tightest_gap

STRAIGHT = np.array([(0.0, 0.0), (6.0, 0.0)])


def world(**obstacles) -> World:
    return World("posts", (0.0, 0.0, 0.0), (6.0, 0.0), **obstacles)


def test_nothing_narrows_an_open_plane() -> None:
    assert tightest_gap(world(), STRAIGHT) == math.inf
    assert tightest_gap(world(cylinders=[(3.0, 1.0, 0.3)]), STRAIGHT) == math.inf  # on one side only


@pytest.mark.parametrize("half_width", [0.3, 0.8, 2.0])
def test_between_two_posts_it_is_their_gap(half_width: float) -> None:
    posts = [(3.0, half_width + 0.3, 0.3), (3.0, -half_width - 0.3, 0.3)]
    assert tightest_gap(world(cylinders=posts), STRAIGHT) == pytest.approx(2.0 * half_width, rel=2e-3)


def test_the_narrowest_counts_and_so_does_an_oblique_one() -> None:
    wide = [(1.5, 2.3, 0.3), (1.5, -2.3, 0.3)]
    oblique = [(4.0, 1.0, 0.3), (5.0, -1.0, 0.3)]
    assert tightest_gap(world(cylinders=wide + oblique), STRAIGHT) == pytest.approx(math.sqrt(5.0) - 0.6, rel=1e-2)


def test_a_corridor_is_as_wide_as_its_bounds() -> None:
    assert tightest_gap(world(bounds=(-9.0, -1.0, 9.0, 1.5)), STRAIGHT) == pytest.approx(2.5)


def test_thin_posts_between_two_places_of_a_coarser_look_are_found() -> None:
    posts = [(3.25, 0.5, 0.06), (3.25, -0.5, 0.06)]
    assert tightest_gap(world(cylinders=posts), STRAIGHT) == pytest.approx(0.88, rel=0.1)


@pytest.mark.parametrize(("away", "gap"), [(19.9, 39.8), (20.1, math.inf)])
def test_what_is_too_far_away_narrows_nothing(away: float, gap: float) -> None:
    walls = tuple(np.array([(-90.0, y), (90.0, y), (0.0, 1.1 * y)]) for y in (away, -away))
    assert tightest_gap(world(polygons=walls), STRAIGHT) == pytest.approx(gap)


@pytest.mark.parametrize("seed", range(4))
def test_a_shortest_path_leads_through_gaps_that_its_disc_fits_in(seed: int) -> None:
    forest = make_world(Forest(), seed, 0.25)
    _, path = shortest_path(forest, 0.255)
    assert 0.51 - 1e-3 <= tightest_gap(forest, path) < 2.0 * FARTHEST
