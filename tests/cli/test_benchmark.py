"""Options of the commands `benchmark` and `report`."""

import pytest

from drake_starnav.cli.benchmark import world_numbers
from drake_starnav.errors import StarnavError


def test_world_numbers_are_ascending_and_unique() -> None:
    assert world_numbers("7, 3,20-22,21") == [3, 7, 20, 21, 22]


@pytest.mark.parametrize("text", ["", "a", "3-1", "1-", "-1", "0-100000"])
def test_other_texts_are_refused(text: str) -> None:
    with pytest.raises(StarnavError, match="--worlds .* allowed: "):
        world_numbers(text)
