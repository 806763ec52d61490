"""Rows that values share which extend one another."""

import numpy as np
import pytest

from drake_starnav.utils.shared_rows import SharedRows


@pytest.fixture
def three() -> SharedRows:
    return SharedRows((np.arange(6.0).reshape(3, 2), np.arange(3)), 3)


def test_the_first_to_extend_shares_memory_and_the_second_gets_its_own(three: SharedRows) -> None:
    four = three.extended(3, 1, (np.full(2, 7.0), 9))
    before = [array.copy() for array in four.in_use]
    five = four.extended(4, 1, (np.full(2, 8.0), 10))
    assert five is four
    other = four.extended(4, 1, (np.full(2, -1.0), -1))
    assert other is not four
    for known, mine, others in zip(before, five.arrays, other.arrays, strict=True):
        np.testing.assert_array_equal(mine[:4], known)
        np.testing.assert_array_equal(others[:4], known)
    assert five.in_use[1].tolist() == [0, 1, 2, 9, 10] and other.in_use[1].tolist() == [0, 1, 2, 9, -1]


def test_without_room_the_rows_are_copied_with_their_types(three: SharedRows) -> None:
    more = three.extended(3, 2, (np.zeros((2, 2)), np.array([5, 6])))
    assert more is not three and three.used == 3
    assert [array.dtype for array in more.arrays] == [array.dtype for array in three.arrays]
    assert more.in_use[1].tolist() == [0, 1, 2, 5, 6]
    assert len(more.arrays[0]) >= 10


def test_chosen_rows_are_copies(three: SharedRows) -> None:
    chosen = SharedRows.copied(three.arrays, np.array([2, 0]))
    assert chosen.in_use[1].tolist() == [2, 0]
    chosen.arrays[1][0] = 99
    assert three.arrays[1].tolist() == [0, 1, 2]
