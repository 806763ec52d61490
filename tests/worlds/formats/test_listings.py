"""Lists of numbers in scenarios: others are refused by name."""

import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.worlds.formats.listings import check_list, check_numbers

PLACE = ("x", "y")


def test_lists_and_tuples_of_finite_numbers_pass() -> None:
    assert check_list((1, 2), "x") == (1, 2)
    assert check_numbers([1, 2.5], "goal", PLACE) == [1, 2.5]
    assert check_numbers([], "goal", PLACE, or_empty=True) == []


@pytest.mark.parametrize("value", [[1.0], [1.0, 2.0, 3.0], [1.0, float("inf")], [1.0, True], [1.0, "2"], []])
def test_others_are_refused_with_what_is_allowed(value: list) -> None:
    with pytest.raises(StarnavError, match=r"goal is .*; allowed: finite \[x, y\]"):
        check_numbers(value, "goal", PLACE)


def test_what_is_no_list_is_refused() -> None:
    with pytest.raises(StarnavError, match="goal is 3; allowed: a list"):
        check_numbers(3, "goal", PLACE)
