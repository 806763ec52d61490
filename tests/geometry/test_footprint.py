"""Footprints: discs that cover them, their polygons, and what is refused."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.footprint import Footprint, disc, find_covered_area, footprint, measure_protrusion

SQUARE = ((0.2, 0.2), (-0.2, 0.2), (-0.2, -0.2), (0.2, -0.2))
corner = st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))


def contains(outer: Footprint, inner: Footprint) -> bool:
    """Whether one footprint lies inside another."""
    if inner.is_disc:
        return measure_protrusion(outer, np.zeros((1, 2)), inner.radius) < 1e-6
    return all(measure_protrusion(outer, part) < 1e-6 for part in inner.parts)


@pytest.mark.parametrize("middle", [(0.0, 0.2), (0.0, 0.2000001), (0.1, 0.1999), (0.0, 0.1991), (0.3, 0.2)])
def test_corners_in_line_with_others_count_for_nothing(middle: tuple[float, float]) -> None:
    plain = footprint(((0.3, 0.2), (-0.3, 0.2), (-0.3, -0.2), (0.3, -0.2)))
    shape = footprint(((0.3, 0.2), middle, (-0.3, 0.2), (-0.3, -0.2), (0.3, -0.2)))
    assert contains(shape, plain) and shape.radius == pytest.approx(plain.radius)


@given(st.lists(corner, min_size=3, max_size=8))
def test_discs_cover_every_convex_polygon(points):
    hull = shapely.MultiPoint(points).convex_hull
    if hull.area < 1e-9 or shapely.minimum_rotated_rectangle(hull).buffer(-0.01).is_empty:  # or it is a line
        return
    shape = footprint(tuple(map(tuple, shapely.get_coordinates(hull)[:-1].tolist())))
    inside = np.random.default_rng(0).dirichlet(np.ones(len(shape.parts[0])), 200) @ shape.parts[0]
    away = np.hypot(*np.moveaxis(inside[:, None] - shape.cover, -1, 0)).min(axis=1)
    assert away.max() <= shape.cover_radius + 1e-9
    assert np.hypot(*inside.T).max() <= shape.radius + 1e-9
    assert (inside @ shape.polygons.normals.T <= shape.polygons.offsets + 1e-9).all()


def test_a_disc_is_one_disc_and_turns_on_the_spot():
    shape = disc(0.3)
    assert (shape.cover_radius, shape.radius, shape.lever, len(shape.cover)) == (0.3, 0.3, 0.0, 1)
    assert find_covered_area(shape, np.array((1.0, 2.0, 3.0))).area == pytest.approx(math.pi * 0.09, rel=0.01)


def test_a_union_covers_what_its_parts_do():
    shape = footprint((SQUARE, ((0.2, 0.0), (0.5, 0.0), (0.5, 0.1), (0.2, 0.1))))
    assert find_covered_area(shape, np.array((0.0, 0.0, 1.0))).area == pytest.approx(0.16 + 0.03)
    assert list(shape.polygons.ends) == [4, 8]
    assert shapely.Polygon(shape.outline).area > 0.19


@pytest.mark.parametrize(
    ("corners", "reason"),
    [
        (((0.0, 0.0), (1.0, 0.0)), "has the part .* three or more corners"),
        (((0.0, 0.0), (1.0, 0.0), (0.2, 0.2), (0.0, 1.0)), "not convex"),
        (((0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)), "not convex"),
        (((0.0, 0.0), (1.0, 0.0), (math.nan, 1.0)), "finite"),
        (((0.0, 0.0), (1.0, 0.0), (1.0, 0.001), (0.0, 0.001)), "narrow"),
        (((-0.3, 0.0), (0.0, 0.0), (0.3, 0.0)), "in line"),
        (((0.3, 0.2), (0.0, 0.19), (-0.3, 0.2), (-0.3, -0.2), (0.3, -0.2)), r"0.19\] lies 10 mm inside its hull"),
    ],
)
def test_what_is_no_footprint_is_refused(corners, reason):
    with pytest.raises(StarnavError, match=reason):
        footprint(corners)


LONG = footprint(((-0.4, -0.2), (0.4, -0.2), (0.4, 0.2), (-0.4, 0.2)))
HALVES = footprint(tuple(((x0, -0.2), (x1, -0.2), (x1, 0.2), (x0, 0.2)) for x0, x1 in ((-0.4, 0.1), (0.0, 0.4))))


@pytest.mark.parametrize(
    ("outer", "inner", "lies_inside"),
    [
        (disc(0.3), disc(0.3), True),
        (disc(0.3), disc(0.31), False),
        (LONG, disc(0.2), True),
        (LONG, disc(0.21), False),
        (disc(0.45), LONG, True),
        (disc(0.44), LONG, False),
        (LONG, HALVES, True),
        (HALVES, LONG, True),
        (LONG, footprint(SQUARE), True),
        (footprint(SQUARE), LONG, False),
    ],
)
def test_which_footprint_contains_which(outer, inner, lies_inside) -> None:
    assert contains(outer, inner) == lies_inside


def test_what_spans_a_notch_sticks_out_between_its_corners() -> None:
    fork = footprint((((-0.5, -0.3), (0.0, -0.3), (0.0, 0.3), (-0.5, 0.3)),
                      ((0.0, 0.1), (0.5, 0.1), (0.5, 0.3), (0.0, 0.3)),
                      ((0.0, -0.3), (0.5, -0.3), (0.5, -0.1), (0.0, -0.1))))  # fmt: skip
    across = np.array(((0.4, 0.2), (0.41, 0.2), (0.41, -0.2), (0.4, -0.2)))
    assert measure_protrusion(fork, across) == pytest.approx(0.1, abs=2e-4)
    assert measure_protrusion(fork, across[:1], 0.05) == 0.0
