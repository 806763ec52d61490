"""What is declared: scenarios, faults, recordings, and the margins that follow from them."""

from typing import TYPE_CHECKING, Any

from drake_starnav.scenario.shipped import METHODS, scenario_names

if TYPE_CHECKING:
    from drake_starnav.scenario.margins import derive_margins
    from drake_starnav.scenario.scenario_file import load_scenario, parse_scenario, save_scenario
    from drake_starnav.scenario.schema import (
        DriveParameters,
        LocalizationParameters,
        RecordingParameters,
        Scenario,
        SimulationParameters,
    )

__all__ = [
    "METHODS",
    "DriveParameters",
    "LocalizationParameters",
    "RecordingParameters",
    "Scenario",
    "SimulationParameters",
    "derive_margins",
    "load_scenario",
    "parse_scenario",
    "save_scenario",
    "scenario_names",
]


def __getattr__(name: str) -> Any:
    """The schema knows the parameters of everything, whose kernels take a second to import: when first used."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from drake_starnav.scenario import margins, scenario_file, schema

    return next(getattr(module, name) for module in (schema, scenario_file, margins) if hasattr(module, name))
