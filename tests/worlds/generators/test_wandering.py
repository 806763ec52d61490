"""The way of a disc that wanders: closed, even, and free of what stands."""

import numpy as np
import pytest

from drake_starnav.worlds import World, clearance
from drake_starnav.worlds.generators.wandering import wander

WORLD = World(
    "test",
    (0.5, 0.5, 0.0),
    (5.0, 3.0),
    cylinders=[(2.0, 2.0, 0.4)],
    polygons=([(4.0, 1.0), (4.2, 1.0), (4.2, 3.0), (4.0, 3.0)],),
    bounds=(0.0, 0.0, 6.0, 4.0),
)
BEGIN = np.array([1.0, 3.0])


@pytest.mark.parametrize("winding", [True, False])
@pytest.mark.parametrize("seed", range(4))
def test_the_disc_never_touches_anything(seed: int, winding: bool) -> None:
    path = wander(WORLD, BEGIN, 0.3, 0.7, winding, np.random.default_rng(seed))
    shares = np.linspace(0.0, 1.0, 400)[:, None, None]
    everywhere = (path[:-1, 1:] + shares * np.diff(path[:, 1:], axis=0)).reshape(-1, 2)
    assert clearance(WORLD, everywhere).min() >= 0.3
    assert np.array_equal(path[0], (0.0, *BEGIN))
    assert path[-1, 1:] == pytest.approx(BEGIN)
    assert np.array_equal(path[:, 1:], path[::-1, 1:]), "there and back"
    legs = np.diff(path, axis=0)
    assert np.hypot(legs[:, 1], legs[:, 2]) == pytest.approx(0.7 * legs[:, 0])


def test_who_goes_straight_turns_at_obstacles_only() -> None:
    path = wander(WORLD, BEGIN, 0.3, 0.7, False, np.random.default_rng(0))
    legs = np.diff(path[: len(path) // 2, 1:], axis=0)
    headings = np.arctan2(legs[:, 1], legs[:, 0])
    turned = np.abs(np.angle(np.exp(1j * np.diff(headings)))) > 1e-6
    near = clearance(WORLD, path[1 : len(path) // 2 - 1, 1:]) < 0.3 + 0.03
    assert turned.any()
    assert near[turned].all()


def test_a_disc_that_cannot_move_has_no_way() -> None:
    closet = World("closet", (0.5, 0.5, 0.0), (0.5, 0.5), bounds=(0.0, 0.0, 0.61, 0.61))
    assert wander(closet, np.array([0.305, 0.305]), 0.3, 0.5, False, np.random.default_rng(0)) is None
