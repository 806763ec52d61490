"""What a message shows of a value is short, whatever the value."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_starnav.errors import LONGEST_VALUE, StarnavError, UnsupportedError, one_line, said_by, shown
from tests.helpers.inputs import fuzzed, values

HERSELF: list = []
HERSELF.append(HERSELF)
LAUGHS: list = ["l"]
for _ in range(300):
    LAUGHS = [LAUGHS, LAUGHS]


class Tagged(dict):
    pass


@fuzzed
@given(values | st.binary() | st.tuples(st.integers()))
def test_what_is_short_is_shown_as_it_is(value: object) -> None:
    text = repr(value)
    assert shown(value) == text or (len(text) > LONGEST_VALUE >= len(shown(value)))


@pytest.mark.parametrize(
    "value",
    [LAUGHS, HERSELF, Tagged(a=LAUGHS), {1: HERSELF}, (LAUGHS,) * 3, [0] * 10**6, 10**5000, -(10**5000), [10**5000] * 9,
     "x" * 10**6, b"x" * 10**6, "\0" * 10**6, dict.fromkeys(range(10**5))],
    ids=range(13),
)  # fmt: skip
def test_what_is_not_is_cut(value: object) -> None:
    assert 10 < len(shown(value)) <= LONGEST_VALUE


def test_a_text_that_is_cut_keeps_its_quotes() -> None:
    assert shown("x" * 300) == repr("x" * 90 + "...")


def test_a_line_is_one() -> None:
    assert one_line("a\nb\x1b[2J\u2028ä\udcff") == "a\\nb\\x1b[2J\\u2028ä\\udcff"
    assert said_by(ValueError("a\n  b")) == "a b"
    assert len(said_by(ValueError("x" * 9999))) == 5 * LONGEST_VALUE


def test_what_cannot_be_tried_is_refused_too() -> None:
    assert issubclass(UnsupportedError, StarnavError)
    assert str(StarnavError("x is 1; allowed: 2")) == "x is 1; allowed: 2"


def test_bad_input_is_a_value_error() -> None:
    assert issubclass(StarnavError, ValueError)
