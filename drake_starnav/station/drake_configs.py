"""The parts of a scenario that are structs of Drake's own."""

from collections.abc import Mapping
from typing import Any

from pydrake.common.yaml import yaml_dump, yaml_dump_typed, yaml_load, yaml_load_typed
from pydrake.multibody.plant import MultibodyPlantConfig
from pydrake.systems.analysis import SimulatorConfig

from drake_starnav.errors import StarnavError, said_by, shown
from drake_starnav.parameters import unknown_name


def scenario_plant_config(settings: Mapping[str, Any], defaults: MultibodyPlantConfig) -> MultibodyPlantConfig:
    """Defaults, and over them the scenario's `plant_config`; a `StarnavError` for what Drake does not allow."""
    if "time_step" in settings:
        raise StarnavError(
            f"plant_config.time_step is {shown(settings['time_step'])}; allowed: simulation.time_step, "
            "as the schedule of the loop follows from it"
        )
    return _laid_over(settings, defaults, "plant_config")


def scenario_simulator_config(settings: Mapping[str, Any], defaults: SimulatorConfig | None = None) -> SimulatorConfig:
    """Defaults, and over them the scenario's `simulator_config`; errors as of `scenario_plant_config`."""
    return _laid_over(settings, defaults or SimulatorConfig(), "simulator_config")


def _laid_over(mapping: Mapping[str, Any], defaults: Any, place: str) -> Any:
    if not mapping:
        return defaults
    known = yaml_load(data=yaml_dump_typed(defaults))
    for key in mapping:
        if key not in known:
            raise unknown_name(f"key {place}.{key}", key, known)
    try:
        return yaml_load_typed(data=yaml_dump(dict(mapping)), defaults=defaults)
    except (RuntimeError, ValueError, TypeError) as error:
        raise StarnavError(f"{place} is {shown(dict(mapping))}: {said_by(error)}; allowed: what Drake reads") from None
