"""A scenario as a plain struct, which Drake's typed YAML functions read and write."""

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Union

from pydrake.common.yaml import yaml_dump_typed
from pydrake.multibody.parsing import ModelDirective, ModelDirectives

from drake_starnav.parameters import build, declared, plain_struct
from drake_starnav.scenario import Scenario
from drake_starnav.scenario.schema import DRAKE_CONFIGS, SECTIONS, check_takes_directives, with_absolute_files
from drake_starnav.worlds import WORLD_KINDS

Setting = Union[str, bool, int, float]  # noqa: UP007, Drake asks for this form


_KINDS = tuple(plain_struct(kind) for kind in WORLD_KINDS.values())
_Sections: Any = dataclasses.make_dataclass(
    "_Sections",
    [
        ("name", str, "scenario"),
        ("world", Union[_KINDS], dataclasses.field(default_factory=_KINDS[0])),  # noqa: UP007
        *(
            (key, plain_struct(cls), dataclasses.field(default_factory=plain_struct(cls)))
            for key, cls in SECTIONS.items()
        ),
        ("directives", list[ModelDirective], dataclasses.field(default_factory=list)),
        *((key, dict[str, Setting], dataclasses.field(default_factory=dict)) for key in DRAKE_CONFIGS),
    ],
)


@dataclass
class ScenarioConfig(_Sections):
    """A scenario as a plain struct with the same keys as its YAML, for Drake's typed YAML functions.

        config = yaml_load_typed(schema=ScenarioConfig, filename="mine.yaml")
        config.robot.max_speed = 0.5
        trial = run_trial(config.scenario())
        print(yaml_dump_typed(ScenarioConfig.of(trial_scenario)))

    `world` is one of the kinds of worlds, by its tag; `directives` are those of a `!Model`; `plant_config` and
    `simulator_config` hold keys of `MultibodyPlantConfig` and `SimulatorConfig`. Values are checked by `scenario`.
    """

    def scenario(self) -> Scenario:
        """The scenario, all of its values checked.

        Raises:
            StarnavError: a value is not allowed.
        """
        kind, world = type(self.world).__name__, _values(self.world)
        if self.directives:
            check_takes_directives(kind, world.get("directives"), self.name)
            text = yaml_dump_typed(ModelDirectives(directives=self.directives))
            world["directives"] = with_absolute_files(text, Path.cwd())
        parts: dict[str, Any] = {key: build(cls, _values(getattr(self, key)), key) for key, cls in SECTIONS.items()}
        parts |= {key: dict(getattr(self, key)) for key in DRAKE_CONFIGS}
        return Scenario(self.name, build(WORLD_KINDS[kind], world, "world"), **parts)

    @classmethod
    def of(cls, scenario: Scenario) -> "ScenarioConfig":
        """The struct of a scenario."""
        parts = {key: _twin(getattr(scenario, key)) for key in SECTIONS}
        parts |= {key: dict(getattr(scenario, key)) for key in DRAKE_CONFIGS}
        return cls(name=scenario.name, world=_twin(scenario.world), **parts)


def _twin(parameters: Any) -> Any:
    kind: Any = type(parameters)
    values = _values(parameters)
    return plain_struct(kind)(**{key: list(x) if isinstance(x, tuple) else x for key, x in values.items()})


def _values(parameters: Any) -> dict[str, Any]:
    return {field.name: getattr(parameters, field.name) for field in declared(parameters)}
