"""The methods set parameters that there are."""

import dataclasses

import pytest

from drake_starnav.navigation.methods import BY_KIND
from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.scenario.schema import CONTROLLERS, SECTIONS
from drake_starnav.scenario.shipped import METHODS, read_method_settings


@pytest.mark.parametrize("method", METHODS)
def test_method_options_are_real_parameters(method: str) -> None:
    plain, chosen = load_scenario("room"), load_scenario("room", method=method)
    for section in SECTIONS:
        before, after = dataclasses.asdict(getattr(plain, section)), dataclasses.asdict(getattr(chosen, section))
        assert {key for key in before if before[key] != after[key]} == set(
            read_method_settings(method).get(section, {})
        )


def test_every_kind_of_controller_is_some_method_s() -> None:
    kinds = {load_scenario("room", method=method).controller.kind for method in METHODS}
    assert kinds == set(CONTROLLERS) == set(BY_KIND)
