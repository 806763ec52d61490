"""Outlines are counter-clockwise, of the size asked for, and turned about their origin."""

import math

import numpy as np
import pytest

from drake_starnav.worlds.outlines import place, rectangle, trap


def area(outline: np.ndarray) -> float:
    """Signed; positive if counter-clockwise."""
    x, y = outline.T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def test_a_rectangle_has_its_area() -> None:
    assert area(rectangle(1.0, 2.0, 3.0, 5.0)) == 6.0


@pytest.mark.parametrize("arms", [0, 1, 2])
def test_a_trap_is_its_spine_and_its_arms(arms: int) -> None:
    length, depth, thickness = 2.0, 1.0, 0.1
    outline = trap(length, depth, thickness, arms)
    spine = thickness * (length + (0.5 * arms) * thickness)
    assert area(outline) == pytest.approx(spine + arms * thickness * (depth - 0.5 * thickness))
    assert outline[:, 0].max() == pytest.approx(depth if arms else 0.5 * thickness)


def test_a_placed_outline_is_turned_then_moved() -> None:
    np.testing.assert_allclose(place(np.array([(1.0, 0.0)]), (2.0, 3.0), 0.5 * math.pi), [(2.0, 4.0)], atol=1e-12)
    outline = trap(2.0, 1.0, 0.1, 2)
    assert area(place(outline, (4.0, -1.0), 0.7)) == pytest.approx(area(outline))
