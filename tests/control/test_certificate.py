"""What a controller says of its guarantee."""

import numpy as np
import pytest

from drake_starnav.control.certificate import Certificate


def test_nothing_is_guaranteed_before_the_first_command() -> None:
    none = Certificate.none()
    assert not none.certified
    assert none.path.shape == (1, 3)


def test_it_is_immutable() -> None:
    certificate = Certificate(True, np.zeros((2, 3)))
    with pytest.raises(AttributeError):
        certificate.certified = False
