"""What a world given in Python may be."""

import math

import numpy as np
import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.worlds import World

HERE, THERE = (0.0, 0.0, 0.0), (5.0, 0.0)


def test_rows_are_kept_as_they_are() -> None:
    square = [(2, 1), (3, 1), (3, 2)]
    world = World("w", (0, 0, 0), np.array(THERE), cylinders=[(2, 1, 0.3)], spheres=[], polygons=[square])
    assert world.cylinders.tolist() == [[2.0, 1.0, 0.3]]
    assert world.spheres.shape == (0, 3)
    assert world.polygons[0].tolist() == [[2.0, 1.0], [3.0, 1.0], [3.0, 2.0]]
    assert world.goal == THERE and not world.cylinders.flags.writeable


@pytest.mark.parametrize(
    "given, message",
    [
        (
            {"cylinders": [(2, 1), (3, 1), (4, 1)]},
            r"cylinders has shape \(3, 2\); allowed: \(n, 3\), rows of \(x, y, r",
        ),
        ({"cylinders": np.ones((3, 4))}, r"cylinders has shape \(3, 4\)"),
        ({"cylinders": [(2, 1, 0.3), (3, 1)]}, r"cylinders is .*; allowed: numbers"),
        ({"spheres": (2, 1, 0.3)}, r"spheres has shape \(3,\)"),
        ({"polygons": [[(2, 1, 0), (3, 1, 0), (3, 2, 0)]]}, r"polygons\[0\] has shape \(3, 3\); allowed: \(n, 2\)"),
        ({"polygons": [[(2, 1), (3, 1)]]}, r"polygons\[0\] is .*; allowed: at least 3 finite corners"),
        ({"start": (0, 0)}, r"start is \(0, 0\); allowed: \(x, y, yaw\)"),
        ({"start": (0, 0, math.nan)}, r"start is .*; allowed: finite numbers"),
        ({"goal": (1, 2, 3)}, r"goal is \(1, 2, 3\); allowed: \(x, y\)"),
        ({"goal": "far"}, r"goal is 'far'; allowed: \(x, y\)"),
        ({"bounds": (0, 0, 1)}, r"bounds is \(0, 0, 1\); allowed: \(x_min, y_min, x_max, y_max\)"),
        ({"bounds": (0, 0, -1, 1)}, r"bounds is .*; allowed: x_min < x_max"),
    ],
)
def test_what_is_no_world_is_refused(given: dict, message: str) -> None:
    with pytest.raises(StarnavError, match=rf"world w: {message}"):
        World(**{"name": "w", "start": HERE, "goal": THERE, **given})
