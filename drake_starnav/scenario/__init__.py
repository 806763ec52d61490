"""What is declared: scenarios, faults, recordings, and the margins that follow from them."""

from drake_starnav.scenario.schema import (
    METHODS,
    Scenario,
    load_scenario,
    parse_scenario,
    save_scenario,
    scenario_names,
)

__all__ = [
    "METHODS",
    "Scenario",
    "load_scenario",
    "parse_scenario",
    "save_scenario",
    "scenario_names",
]
