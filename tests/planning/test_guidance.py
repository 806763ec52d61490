"""The guidance from any planner to the controller."""

import numpy as np
import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.planning.guidance import Guidance


def test_a_path_is_followed_to_its_end() -> None:
    guidance = Guidance.along([(1.0, 0.0), (1.0, 2.0)])
    assert guidance.arrives and guidance.path.tolist() == [[1.0, 0.0], [1.0, 2.0]]
    assert len(Guidance.along([]).path) == 0


@pytest.mark.parametrize("path", [[(1.0, 2.0, 0.5)], [1.0, 2.0], [(1.0, float("nan"))], np.zeros((2, 2, 2))])
def test_an_invalid_path_is_rejected(path) -> None:
    with pytest.raises(StarnavError, match=r"guidance: path has shape .*; allowed: \(k, 2\), finite x and y"):
        Guidance.along(path)
