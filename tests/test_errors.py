"""What a message shows of a value is short and in one line."""

import pytest

from drake_starnav.errors import LONGEST_VALUE, StarnavError, UnsupportedError, one_line, said_by, shown


@pytest.mark.parametrize(("value", "text"), [([1, "a"], "[1, 'a']"), ("x" * 999, repr("x" * 999)[:97] + "...")])
def test_what_is_short_is_shown_as_it_is_and_what_is_not_is_cut(value: object, text: str) -> None:
    assert shown(value) == text and len(text) <= LONGEST_VALUE


def test_a_line_is_one() -> None:
    assert one_line("a\nb\x1b[2J\u2028ä\udcff") == "a\\nb\\x1b[2J\\u2028ä\\udcff"
    assert said_by(ValueError("a\n  b.")) == "a b"
    assert len(said_by(ValueError("x" * 9999))) == 5 * LONGEST_VALUE


def test_bad_input_is_a_value_error_and_what_cannot_be_tried_is_bad_input() -> None:
    assert issubclass(UnsupportedError, StarnavError) and issubclass(StarnavError, ValueError)


def test_no_more_of_a_value_is_written_out_than_is_shown() -> None:
    nested: list = ["l"] * 10
    for _ in range(40):  # written out, 10^41 letters
        nested = [nested] * 10
    assert len(shown({"a": (nested,)})) == LONGEST_VALUE
    endless: list = []
    endless.append(endless)
    assert shown(endless).startswith("[[[[")
    assert shown("a" * 10**8).startswith("'aaaa")


@pytest.mark.parametrize("value", [[], (), (1,), {}, {"a": [1, ("b", 2.5)]}, [None, {"x": {}}], "it's", {1}])
def test_what_is_short_is_written_as_python_does(value: object) -> None:
    assert shown(value) == repr(value)
