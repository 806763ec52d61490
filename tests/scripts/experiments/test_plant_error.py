"""A trial's plant is exact enough for a small robot."""

import pytest

from scripts.experiments.plant_error import plant_error
from tests.helpers.cart import cart_scenario


@pytest.mark.parametrize("radius", [0.02])
def test_the_safety_margin_is_several_times_the_error_of_the_plant(radius: float, tmp_path) -> None:
    found = plant_error(cart_scenario(radius, tmp_path))
    assert found.radius == radius
    assert found.margin > 4.0 * found.error
