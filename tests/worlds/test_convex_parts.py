"""Convex pieces cover a simple polygon without overlap."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_starnav.errors import StarnavError
from drake_starnav.worlds.convex_parts import EVEN, split_into_convex_parts
from drake_starnav.worlds.outlines import make_rectangle, make_trap
from tests.worlds.test_outlines import area


def check_parts(polygon: np.ndarray, parts: list[np.ndarray]) -> None:
    size = np.ptp(polygon, axis=0).max()
    for part in parts:
        edges = np.roll(part, -1, axis=0) - part
        following = np.roll(edges, -1, axis=0)
        assert (edges[:, 0] * following[:, 1] - edges[:, 1] * following[:, 0] >= -1e-9 * size**2).all()
        assert area(part) > 0.0
        offsets = np.abs(part[:, None] - polygon[None]).max(axis=2)
        assert offsets.min(axis=1).max() < 1e-9  # no corner is new
    assert sum(area(part) for part in parts) == pytest.approx(abs(area(polygon)), rel=1e-9, abs=1e-9 * size**2)


@st.composite
def star_polygons(draw):
    """Simple polygons, mostly concave: a radius for each of some increasing angles."""
    n = draw(st.integers(4, 20))
    radii = draw(st.lists(st.floats(0.2, 3.0), min_size=n, max_size=n))
    angles = 2.0 * math.pi / n * np.arange(n)
    centre = draw(st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3)))
    polygon = np.array(centre) + np.array(radii)[:, None] * np.column_stack((np.cos(angles), np.sin(angles)))
    return polygon[:: draw(st.sampled_from([1, -1]))]


@given(star_polygons())
@settings(max_examples=100)
def test_star_polygons(polygon):
    check_parts(polygon, split_into_convex_parts(polygon))


@pytest.mark.parametrize(("arms", "pieces"), [(0, 1), (1, 2), (2, 3)])
def test_traps_of_either_sense_have_as_few_pieces_as_walls(arms, pieces):
    polygon = make_trap(2.0, 1.5, 0.12, arms)
    for outline in (polygon, polygon[::-1]):
        parts = split_into_convex_parts(outline)
        assert len(parts) == pieces
        check_parts(outline, parts)


def test_repeated_and_straight_corners_are_dropped():
    polygon = np.array([(0, 0), (1, 0), (1, 0), (2, 0), (2, 1), (1, 1), (0, 1), (0, 0)], dtype=float)
    (part,) = split_into_convex_parts(polygon)
    np.testing.assert_allclose(sorted(map(tuple, part)), sorted(map(tuple, make_rectangle(0.0, 0.0, 2.0, 1.0))))


@pytest.mark.parametrize(
    "polygon",
    [
        [(0, 0), (1, 1), (1, 0), (0, 1)],  # crossing edges
        [(0, 0), (4, 0), (4, 2), (2, 0), (0, 2)],  # a corner on an edge
        [(0, 0), (2, 0), (1, 0), (1, 1)],  # doubles back
        [(0, 0), (1, 1), (2, 2)],  # no area
        [(0, 0), (1, 0)],
        [(0, 0), (1, 0), (math.nan, 1)],
    ],
)
def test_invalid_polygons_are_refused(polygon):
    with pytest.raises(StarnavError, match="allowed"):
        split_into_convex_parts(np.array(polygon, dtype=float))


def outlines_of_thousands() -> dict[str, np.ndarray]:
    chance, turn = np.random.default_rng(0), 2.0 * math.pi / 4000 * np.arange(4000)
    round_ = np.column_stack((np.cos(turn), np.sin(turn)))
    spiral = np.linspace(0.0, 60.0, 2000)
    coil = np.column_stack((np.cos(spiral), np.sin(spiral)))
    sides = [(1.0 + shift + 0.1 * spiral)[:, None] * coil for shift in (0.0, 0.1)]
    tooth = (0, 0), (0, 1), (0.005, 1), (0.005, 0)
    teeth = [(0.01 * k + x, y * (1.0 + 0.1 * (k % 7))) for k in range(1000) for x, y in tooth]
    return {
        "digitised circle": np.round(round_, 6),
        "burr": (1.0 + 0.2 * chance.random(4000))[:, None] * round_,
        "spiral": np.vstack((sides[0], sides[1][::-1])),
        "comb": np.array([*teeth, (10.0, -0.1), (0.0, -0.1)]),
    }


@pytest.mark.parametrize(("name", "most"), [("digitised circle", 1), ("burr", 2500), ("spiral", 2100), ("comb", 1001)])
def test_thousands_of_corners_are_cut_at_once(name: str, most: int):
    polygon = outlines_of_thousands()[name]
    parts = split_into_convex_parts(polygon)
    assert len(parts) <= most
    whole = shapely.Polygon(polygon)
    assert sum(area(part) for part in parts) == pytest.approx(whole.area, abs=EVEN * 0.5 * whole.length)
