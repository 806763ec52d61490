"""What a world given in Python may be."""

import math

import numpy as np
import pytest

from drake_starnav import StarnavError, World

HERE, THERE = (0.0, 0.0, 0.0), (5.0, 0.0)


@pytest.mark.parametrize(
    "given, message",
    [
        ({"cylinders": [(2, 1), (3, 1), (4, 1)]}, r"cylinders\[0\] is \[2, 1\]; allowed: finite \[x, y, radius\]"),
        ({"cylinders": [(2, 1, 0.3), (3, 1)]}, r"cylinders\[1\] is \[3, 1\]; allowed: finite"),
        (
            {"cylinders": np.array([(2, 1, 0.3), (3, 1, math.nan)])},
            r"cylinders\[1\] is \[3.0, 1.0, nan\]; allowed: fini",
        ),
        ({"cylinders": np.array([("2", "1", "0.3")])}, r"cylinders\[0\] is \['2', '1', '0.3'\]; allowed: finite"),
        ({"cylinders": 3}, r"cylinders is 3; allowed: a list"),
        ({"cylinders": [(2, 1, 0.0)]}, r"cylinders\[0\] is \[2.0, 1.0, 0.0\]; allowed: a positive radius"),
        ({"spheres": (2, 1, 0.3)}, r"spheres\[0\] is 2; allowed: a list"),
        ({"polygons": [[(2, 1, 0), (3, 1, 0), (3, 2, 0)]]}, r"polygons\[0\]\[0\] is .*; allowed: finite \[x, y\]"),
        ({"polygons": [[(2, 1), (3, 1)]]}, r"polygons\[0\] is .*; allowed: at least 3 finite corners"),
        ({"start": (0, 0)}, r"start is \[0, 0\]; allowed: finite \[x, y, yaw\]"),
        ({"goal": (1, 2, 3)}, r"goal is \[1, 2, 3\]; allowed: finite \[x, y\]"),
        ({"bounds": (0, 0, 1)}, r"bounds is \[0, 0, 1\]; allowed: finite \[x_min, y_min, x_max, y_max\]"),
        ({"bounds": (0, 0, -1, 1)}, r"bounds is .*; allowed: x_min < x_max"),
    ],
)
def test_what_is_no_world_is_refused(given: dict, message: str) -> None:
    with pytest.raises(StarnavError, match=rf"world w: {message}"):
        World(**{"name": "w", "start": HERE, "goal": THERE, **given})
