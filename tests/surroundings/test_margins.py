"""The record of margins cannot be made in part, nor changed."""

import pytest

from drake_starnav.surroundings.margins import Margins
from tests.helpers.scans import MARGINS


@pytest.mark.parametrize("left_out", vars(MARGINS))
def test_no_margin_has_a_default(left_out: str) -> None:
    with pytest.raises(TypeError, match=left_out):
        Margins(**{name: value for name, value in vars(MARGINS).items() if name != left_out})
