"""Arguments of the baselines are arrays of finite numbers, or refused by name."""

import numpy as np
import pytest

from drake_starnav.baselines.checks import positive, rows, vector
from drake_starnav.errors import StarnavError


def test_lists_become_arrays_of_floats() -> None:
    np.testing.assert_array_equal(vector([1, 2], 2, "x"), np.array((1.0, 2.0)))
    assert rows([(1, 2), (3, 4)], 2, "x").dtype == float
    assert rows(np.zeros((0, 2)), 2, "x").shape == (0, 2)
    assert positive(3, "x") == 3.0


@pytest.mark.parametrize(
    ("check", "message"),
    [
        (lambda: vector([1.0], 2, "goal"), r"goal has shape \(1,\); allowed: \(2,\)"),
        (lambda: rows([(1.0, 2.0)], 3, "circles"), r"circles has shape \(1, 2\); allowed: \(n, 3\)"),
        (lambda: rows([(1.0, 2.0)], 2, "points", 4), r"points has shape \(1, 2\); allowed: \(4, 2\)"),
        (lambda: rows([(1.0, np.nan)], 2, "points"), r"points\[0, 1\] is nan; allowed: finite numbers"),
        (lambda: vector("ab", 2, "goal"), "goal is 'ab'; allowed: numbers"),
        (lambda: positive(0.0, "radius"), "radius is 0.0; allowed: a finite number above 0"),
        (lambda: positive(np.inf, "radius"), "radius is inf"),
    ],
)
def test_others_are_refused_by_name(check, message: str) -> None:
    with pytest.raises(StarnavError, match=message):
        check()
