"""Settings of Drake's plant and simulator in a scenario."""

import pytest
from pydrake.systems.analysis import SimulatorConfig

from drake_starnav.errors import StarnavError
from drake_starnav.navigation import make_diagram
from drake_starnav.scenario import parse_scenario
from drake_starnav.simulation import run_trial
from drake_starnav.station.drake_configs import scenario_plant_config, scenario_simulator_config
from drake_starnav.station.plant import plant_config

WORLD = "world: !Obstacles {goal: [2.0, 0.0]}\n"


def test_settings_are_laid_over_ours() -> None:
    scenario = parse_scenario(WORLD + "plant_config: {penetration_allowance: 0.002}", name="x")
    config = scenario_plant_config(scenario.plant_config, plant_config(0.005))
    assert (config.penetration_allowance, config.contact_model, config.time_step) == (0.002, "point", 0.005)
    scenario = parse_scenario(WORLD, name="x", overrides=["plant_config.contact_model=hydroelastic_with_fallback"])
    station = make_diagram(scenario).GetSubsystemByName("station")
    assert station.plant.get_contact_model().name == "kHydroelasticWithFallback"


def test_the_simulator_of_a_trial_has_them() -> None:
    scenario = parse_scenario(WORLD + "simulator_config: {publish_every_time_step: true}", name="x")
    assert scenario_simulator_config(scenario.simulator_config).publish_every_time_step
    assert run_trial(scenario).outcome == "reached"
    assert scenario_simulator_config({}).accuracy == SimulatorConfig().accuracy


@pytest.mark.parametrize(
    "text, words",
    [
        ("plant_config: {contact_modle: point}", "unknown key plant_config.contact_modle: did you mean contact_model"),
        ("plant_config: {time_step: 0.01}", "plant_config.time_step is 0.01; allowed: simulation.time_step"),
        ("plant_config: {penetration_allowance: much}", "plant_config is .*much.*allowed: what Drake reads"),
        ("plant_config: [1]", "plant_config is \\[1\\]; allowed: a mapping"),
        ("simulator_config: {accuracy: [1]}", "simulator_config is .*; allowed: a mapping of names to numbers"),
        ("simulator_config: {speed: 1}", "unknown key simulator_config.speed"),
    ],
)
def test_what_drake_does_not_know_is_refused(text: str, words: str) -> None:
    with pytest.raises(StarnavError, match=words):
        run_trial(parse_scenario(WORLD + text, name="x"))
