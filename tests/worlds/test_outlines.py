"""Outlines are counter-clockwise, of the size asked for, and turned about their origin."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from drake_starnav.worlds.outlines import find_solid_rectangles, make_trap, place


def area(outline: np.ndarray) -> float:
    """Signed; positive if counter-clockwise."""
    x, y = (outline - outline[0]).T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


@pytest.mark.parametrize("arms", [0, 1, 2])
def test_a_trap_is_its_spine_and_its_arms(arms: int) -> None:
    length, depth, thickness = 2.0, 1.0, 0.1
    outline = make_trap(length, depth, thickness, arms)
    spine = thickness * (length + (0.5 * arms) * thickness)
    assert area(outline) == pytest.approx(spine + arms * thickness * (depth - 0.5 * thickness))
    assert outline[:, 0].max() == pytest.approx(depth if arms else 0.5 * thickness)


def test_a_placed_outline_is_turned_then_moved() -> None:
    np.testing.assert_allclose(place(np.array([(1.0, 0.0)]), (2.0, 3.0), 0.5 * math.pi), [(2.0, 4.0)], atol=1e-12)
    outline = make_trap(2.0, 1.0, 0.1, 2)
    assert area(place(outline, (4.0, -1.0), 0.7)) == pytest.approx(area(outline))


def covered(rectangles: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    found = np.zeros(shape, bool)
    for i0, j0, i1, j1 in rectangles:
        assert 0 <= i0 < i1 <= shape[0]
        assert 0 <= j0 < j1 <= shape[1]
        found[i0:i1, j0:j1] = True
    return found


def at_passable(solid: np.ndarray) -> np.ndarray:
    """Solid cells with an edge in common with a passable one."""
    return solid & ndimage.binary_dilation(~solid, ndimage.generate_binary_structure(2, 1))


@given(st.integers(0, 10_000), st.integers(1, 30), st.integers(1, 30), st.floats(0.05, 0.95), st.integers(1, 3))
def test_the_outline_is_exact(seed: int, rows: int, columns: int, share: float, blur: int) -> None:
    noise = ndimage.uniform_filter(np.random.default_rng(seed).random((rows, columns)), blur)
    solid = noise < np.quantile(noise, share)
    found = covered(find_solid_rectangles(solid), solid.shape)
    assert not (found & ~solid).any()
    assert (found | ~at_passable(solid)).all()


@given(st.integers(0, 10_000), st.integers(1, 3))
def test_only_what_is_out_of_reach_is_filled(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    solid = rng.random((25, 25)) < 0.45
    places = rng.permutation(np.argwhere(~solid))[:count]
    found = covered(find_solid_rectangles(solid, places), solid.shape)
    reached = np.zeros_like(solid)
    reached[tuple(places.T)] = True
    reached = ndimage.binary_propagation(reached, mask=~solid)
    assert not (found & reached).any()
    beside = ndimage.binary_dilation(reached, ndimage.generate_binary_structure(2, 1)) & ~reached
    assert found[beside].all()


def test_walls_are_one_rectangle_each() -> None:
    solid = np.ones((40, 60), bool)
    solid[5:-5, 5:-5] = False
    solid[20:24, 10:50] = True
    assert len(find_solid_rectangles(solid)) == 5


@pytest.mark.parametrize("thickness", [1, 4, 60])
def test_an_outside_that_nobody_sees_is_left_out(thickness: int) -> None:
    solid = np.pad(np.zeros((10, 10), bool), thickness, constant_values=True)
    rectangles = find_solid_rectangles(solid)
    assert len(rectangles) == 4
    assert np.minimum(rectangles[:, 2] - rectangles[:, 0], rectangles[:, 3] - rectangles[:, 1]).max() <= 3
