"""Scenarios: typed parameters <-> YAML.

A scenario has the sections `world, robot, lidar, localization, drive, planner, controller, obstacles, simulation,
recording` and one for each baseline; each is a dataclass with defaults, so that a file only contains what differs. The
world is chosen by a tag, e.g. `world: !Forest {width: 20}`; the models of a `!Model` may stand in `directives`.
`plant_config` and `simulator_config` hold what Drake's structs of these names hold.
"""

import dataclasses
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from drake_starnav.baselines import DsmParameters, DwaParameters, FoaParameters, PotentialFieldParameters
from drake_starnav.control import ControllerParameters
from drake_starnav.errors import StarnavError, check_kind, shown
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.parameters import build, declared, parameter, unknown_name
from drake_starnav.planning import PlannerParameters
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.faults import DriveParameters, LocalizationParameters
from drake_starnav.scenario.recording import RecordingParameters
from drake_starnav.scenario.shipped import METHODS, scenario_names
from drake_starnav.tracking import DynamicObstacleParameters
from drake_starnav.utils.files import read_text, reason_of, write_text
from drake_starnav.utils.resources import model_path
from drake_starnav.utils.yaml_text import LARGEST_TEXT, PlainLoader, load_yaml
from drake_starnav.worlds import WORLD_KINDS, Model
from drake_starnav.worlds.formats.world_file import shipped_file


@dataclass(frozen=True)
class SimulationParameters:
    """How a trial is simulated and judged."""

    timeout: float = parameter(0.0, "time a trial may take; 0 for the world's own", unit="s", low=0.0, high=1e6)
    time_step: float = parameter(
        0.005,
        "step of a discrete plant; the delay of a drive is rounded up to a multiple of it",
        unit="s",
        low=1e-4,
        high=0.02,
    )
    goal_tolerance: float = parameter(
        0.3, "distance from the goal at which it counts as reached", unit="m", above=0.0, high=10.0
    )


@dataclass(frozen=True)
class Scenario:
    """Everything that, with a seed, defines a trial."""

    name: str
    world: Any
    robot: RobotParameters = field(default_factory=RobotParameters)
    lidar: LidarParameters = field(default_factory=LidarParameters)
    localization: LocalizationParameters = field(default_factory=LocalizationParameters)
    drive: DriveParameters = field(default_factory=DriveParameters)
    planner: PlannerParameters = field(default_factory=PlannerParameters)
    controller: ControllerParameters = field(default_factory=ControllerParameters)
    obstacles: DynamicObstacleParameters = field(default_factory=DynamicObstacleParameters)
    dsm: DsmParameters = field(default_factory=DsmParameters)
    foa: FoaParameters = field(default_factory=FoaParameters)
    dwa: DwaParameters = field(default_factory=DwaParameters)
    apf: PotentialFieldParameters = field(default_factory=PotentialFieldParameters)
    simulation: SimulationParameters = field(default_factory=SimulationParameters)
    recording: RecordingParameters = field(default_factory=RecordingParameters)
    plant_config: dict[str, Any] = field(default_factory=dict)
    simulator_config: dict[str, Any] = field(default_factory=dict)


DRAKE_CONFIGS = ("plant_config", "simulator_config")
"""Sections with the keys of Drake's `MultibodyPlantConfig` and `SimulatorConfig`; see `station.drake_configs`."""
SECTIONS: dict[str, Any] = {
    part.name: part.default_factory
    for part in dataclasses.fields(Scenario)
    if part.name not in ("name", "world", *DRAKE_CONFIGS)
}
KEYS = ("world", *SECTIONS, *DRAKE_CONFIGS)
"""Of a scenario's mapping, where they may be overridden; it may also hold `directives`."""


OTHER_BREAKS = "\x85\u2028\u2029"
"""Line breaks of YAML that are only kept where they are escaped."""


class _Tagged(dict):
    """A mapping of a YAML file with the tag it carried."""

    tag: str = ""


class _Loader(PlainLoader):
    """Plain YAML whose mappings may carry a tag and have each key once; it never makes objects of other kinds."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """A mapping, or an error that names the place of a key that is there twice."""
        seen = set()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode) and key.tag != "tag:yaml.org,2002:merge":
                if key.value in seen:
                    raise yaml.constructor.ConstructorError(None, None, f"key {key.value} is repeated", key.start_mark)
                seen.add(key.value)
        return super().construct_mapping(node, deep)


def _tagged(loader: _Loader, suffix: str, node: yaml.Node) -> _Tagged:
    if isinstance(node, yaml.ScalarNode) and node.value == "":
        mapping = _Tagged()
    elif isinstance(node, yaml.MappingNode):
        mapping = _Tagged(loader.construct_mapping(node, deep=True))
    else:
        raise yaml.constructor.ConstructorError(None, None, f"!{suffix} must be followed by a mapping", node.start_mark)
    mapping.tag = suffix
    return mapping


class _TaggedDumper(yaml.SafeDumper):
    """Writes mappings with the tags that they were read with."""


class _ScenarioDumper(yaml.SafeDumper):
    """Writes a section in one line, but one with a text of several lines as a block, and that text line by line."""


def _written_section(dumper: _ScenarioDumper, section: _Tagged) -> yaml.Node:
    tag = f"!{section.tag}" if section.tag else "tag:yaml.org,2002:map"
    block = any(isinstance(value, str) and "\n" in value for value in section.values())
    return dumper.represent_mapping(tag, dict(section), flow_style=not block)


def _written_text(dumper: _ScenarioDumper, text: str) -> yaml.Node:
    style = '"' if set(OTHER_BREAKS) & set(text) else "|" if "\n" in text else None
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=style)


_ScenarioDumper.add_representer(_Tagged, _written_section)
_ScenarioDumper.add_representer(str, _written_text)
_TaggedDumper.add_representer(_Tagged, lambda dumper, value: dumper.represent_mapping(f"!{value.tag}", dict(value)))
_Loader.add_multi_constructor("!", _tagged)


def scenario_path(name_or_path: str | Path) -> Path:
    """The file of a shipped scenario, or the one at a path; a `StarnavError` if there is neither."""
    path, name_or_path = Path(name_or_path), str(name_or_path)
    if path.suffix in (".yaml", ".yml") or os.path.isfile(path):
        return path
    if name_or_path not in scenario_names():
        known = [*scenario_names(), "a path to a YAML file"]
        raise unknown_name(f"scenario {shown(name_or_path)}", name_or_path, known)
    return model_path("scenarios", f"{name_or_path}.yaml")


def load_scenario(name_or_path: str | Path, *, method: str = "star", overrides: Sequence[str] = ()) -> Scenario:
    """A shipped scenario by name, or one from a YAML file by path.

    Args:
        name_or_path: e.g. "forest", or "my/world.yaml".
        method: whose settings the scenario's own keys are laid over; see `METHODS`.
        overrides: "dotted.key=value" texts, laid over the scenario's keys.

    Raises:
        StarnavError: no such scenario or method, broken YAML, unknown key, or a value that is not allowed.
    """
    path = scenario_path(name_or_path)
    try:
        text = read_text(path, LARGEST_TEXT)
    except OSError as error:
        raise StarnavError(
            f"scenario file {path} cannot be read: {reason_of(error)}; allowed: a UTF-8 YAML file"
        ) from None
    return parse_scenario(
        text, name=_name_of(path), place=str(path), method=method, overrides=overrides, folder=path.absolute().parent
    )


def _name_of(path: Path) -> str:
    """The name of a scenario file; bytes in it that are not UTF-8 are replaced."""
    return os.fsencode(path.stem).decode("utf-8", errors="replace")


def _check_known(method: str) -> None:
    if method not in METHODS:
        raise unknown_name(f"method {shown(method)}", method, METHODS)


def check_method(scenario: Scenario, method: str) -> None:
    """Raise a `StarnavError` unless a scenario may be one of a method; one of `star` may have any controller."""
    check_kind(scenario, Scenario, "scenario", "as from load_scenario")
    _check_known(method)
    kind = METHODS[method].get("controller", {}).get("kind", "star")
    if scenario.controller.kind != kind and method != "star":
        raise StarnavError(
            f"method is {method}, and the scenario's controller.kind {scenario.controller.kind}; allowed: {kind}, as "
            f"of load_scenario(..., method={method!r})"
        )


def in_world(scenario: Scenario, number: int | None) -> Scenario:
    """The scenario in the world of that number, for kinds of numbered worlds; as it is where the number is None."""
    if number is None:
        return scenario
    return dataclasses.replace(scenario, world=dataclasses.replace(scenario.world, id=number))


def parse_scenario(
    text: str,
    *,
    name: str,
    place: str = "scenario",
    method: str = "star",
    overrides: Sequence[str] = (),
    folder: str | Path | None = None,
) -> Scenario:
    """A scenario from YAML text.

    Args:
        text, name, method, overrides: as for `load_scenario`.
        place: names the text in messages.
        folder: that the paths of world and robot in the text are relative to; those of the overrides, and all if it
            is None, are relative to the working directory.
    """
    sections = _read(text, place)
    if "directives" in sections:
        _move_directives(sections, place)
    if folder is not None:
        _make_paths_absolute(sections, Path(folder))
    for override in overrides:
        _override(sections, override)
    _make_paths_absolute(sections, Path.cwd())
    _check_known(method)
    for key in sections:
        if key not in KEYS:
            raise unknown_name(f"key {key} in {place}", str(key), (*KEYS, "directives"))
    parts = {
        key: build(cls, sections.get(key), key, base=build(cls, METHODS[method].get(key), key))
        for key, cls in SECTIONS.items()
    }
    configs: dict[str, Any] = {key: _drake_config(sections.get(key), key) for key in DRAKE_CONFIGS}
    return Scenario(name=name, world=_world(sections.get("world"), place), **parts, **configs)


def save_scenario(scenario: Scenario, path: str | Path) -> None:
    """Write a scenario to a YAML file; `load_scenario` reads back an equal one if the file has the scenario's name.

    Raises:
        StarnavError: the file cannot be written.
    """
    write_text(Path(path), scenario_text(scenario))


def scenario_text(scenario: Scenario) -> str:
    """The scenario as YAML text that `parse_scenario` reads back to an equal one; every key is written out."""
    sections = {"world": _section(_declared(scenario.world), type(scenario.world).__name__)}
    sections |= {key: _section(_declared(getattr(scenario, key))) for key in SECTIONS}
    sections |= {key: _section(getattr(scenario, key)) for key in DRAKE_CONFIGS if getattr(scenario, key)}
    return yaml.dump(
        sections, Dumper=_ScenarioDumper, default_flow_style=None, sort_keys=False, width=math.inf, allow_unicode=True
    )


def _section(values: dict[str, Any], tag: str = "") -> _Tagged:
    section = _Tagged(values)
    section.tag = tag
    return section


def differences(text: str, other: str, sections: Sequence[str], place: str = "scenario") -> list[str]:
    """Where two texts as of `scenario_text` differ in some sections: "robot.radius 0.3 and 0.25".

    Keys of only one of them (from another version) and the folders of the files that they name are ignored.
    """
    both, found = [_read(part, place) for part in (text, other)], []
    for section in sections:
        ours, theirs = ({} if sides.get(section) is None else sides[section] for sides in both)
        tags = [getattr(side, "tag", "") for side in (ours, theirs)]
        if tags[0] != tags[1]:
            found.append(f"{section} !{tags[0]} and !{tags[1]}")
        elif isinstance(ours, dict) and isinstance(theirs, dict):
            pairs = [(key, ours[key], theirs[key]) for key in ours if key in theirs]
            found += [f"{section}.{key} {a} and {b}" for key, a, b in pairs if _without_folder(a) != _without_folder(b)]
    return found


def _drake_config(mapping: Any, key: str) -> dict[str, Any]:
    if mapping is None:
        return {}
    if not isinstance(mapping, dict) or not all(
        isinstance(name, str) and isinstance(value, (bool, int, float, str)) for name, value in mapping.items()
    ):
        raise StarnavError(f"{key} is {shown(mapping)}; allowed: a mapping of names to numbers, texts, true and false")
    return dict(mapping)


def _without_folder(value: Any) -> Any:
    return Path(value).name if isinstance(value, str) else value


def _declared(part: Any) -> dict[str, Any]:
    return {field.name: getattr(part, field.name) for field in declared(part)}


def _read(text: str, place: str) -> dict[str, Any]:
    sections = load_yaml(text, place, _Loader)
    if not isinstance(sections, dict):
        raise StarnavError(f"{place} holds {shown(sections)}; allowed: a mapping with {', '.join(KEYS)}, directives")
    return sections


def _move_directives(sections: dict[str, Any], place: str) -> None:
    directives, world = sections.pop("directives"), sections.get("world")
    if not isinstance(directives, list):
        raise StarnavError(f"directives in {place} is {shown(directives)}; allowed: a list of Drake's model directives")
    if not isinstance(world, _Tagged):
        raise _misplaced(place, "no world" if world is None else f"world: {shown(world)}")
    if world.tag != Model.__name__ or world.get("directives"):
        raise _misplaced(place, f"world: !{world.tag}" if world.tag != Model.__name__ else "world.directives")
    world["directives"] = directives


def _misplaced(place: str, beside: str) -> StarnavError:
    allowed = "beside world: !Model {start: [x, y, yaw], goal: [x, y]}"
    return StarnavError(f"directives in {place} beside {beside}; allowed: {allowed}")


def _override(sections: dict[str, Any], text: str) -> None:
    key, separator, value = text.partition("=")
    names = key.split(".")
    if not separator or len(names) != 2 or not all(names):
        raise StarnavError(f"override {shown(text)}; allowed: section.key=value, e.g. robot.radius=0.3")
    section, name = names
    if section not in KEYS:
        raise unknown_name(f"key {key}", section, KEYS)
    try:
        parsed = load_yaml(value, key, _Loader)
    except StarnavError:
        raise StarnavError(
            f"override {shown(text)}: the value is not valid YAML; allowed: e.g. robot.radius=0.3"
        ) from None
    if not isinstance(sections.get(section), dict):
        sections[section] = {}
    sections[section][name] = parsed


def _make_paths_absolute(sections: dict[str, Any], folder: Path) -> None:
    """Let the paths of world and robot, as read from YAML, begin at a folder.

    Absolute ones, package:// and the names of what is shipped stay.
    """
    world, robot = sections.get("world"), sections.get("robot")
    if isinstance(world, _Tagged) and world.tag in WORLD_KINDS:
        for field_ in dataclasses.fields(WORLD_KINDS[world.tag]):
            if field_.metadata.get("path") and shipped_file(str(world.get(field_.name))) is None:
                _make_absolute(world, "world", field_.name, folder)
        if world.tag == Model.__name__ and "directives" in world:
            world["directives"] = with_absolute_files(world["directives"], folder)
    if isinstance(robot, dict) and str(robot.get("model")).endswith(".urdf"):  # else it names a shipped robot
        _make_absolute(robot, "robot", "model", folder)


def with_absolute_files(directives: Any, folder: Path) -> Any:
    """Model directives, a list or a text that holds one, whose relative paths begin at a folder: Drake takes only URIs.

    What is neither stays as it is, and so does a text without such paths.
    """
    entries = directives
    if isinstance(directives, str) and "\n" in directives:
        try:
            entries = load_yaml(directives, "directives", _Loader)["directives"]
        except (StarnavError, TypeError, KeyError):  # Drake says what is wrong
            return directives
    found = [
        entry[kind]
        for entry in (entries if isinstance(entries, list) else [])
        if isinstance(entry, dict)
        for kind in ("add_model", "add_directives")
        if isinstance(entry.get(kind), dict)
    ]
    relative = [part for part in found if isinstance(part.get("file"), str) and "://" not in part["file"]]
    for part in relative:
        _make_absolute(part, "directives", "file", folder)
        part["file"] = f"file://{part['file']}"
    return _directives_text(entries) if relative else directives


def _directives_text(directives: list[Any]) -> str:
    return yaml.dump({"directives": directives}, Dumper=_TaggedDumper, sort_keys=False)


def _make_absolute(mapping: Any, section: str, key: str, folder: Path) -> None:
    value = mapping.get(key)
    if isinstance(value, str) and value and "://" not in value and "\n" not in value:
        try:
            mapping[key] = str((folder / Path(value).expanduser()).resolve())
        except (OSError, RuntimeError, ValueError) as error:  # a loop of links, nobody's home, a null byte
            raise StarnavError(
                f"{section}.{key} is {shown(value)} ({reason_of(error)}); allowed: the path of a file"
            ) from None


def _world(mapping: Any, place: str) -> Any:
    if not isinstance(mapping, _Tagged):
        tags = ", ".join(f"!{name}" for name in WORLD_KINDS)
        raise StarnavError(f"world in {place} is {shown(mapping)}; allowed: a mapping tagged {tags}")
    if mapping.tag not in WORLD_KINDS:
        raise unknown_name(f"world !{mapping.tag} in {place}", mapping.tag, WORLD_KINDS)
    values = dict(mapping)
    if mapping.tag == Model.__name__ and isinstance(values.get("directives"), list):
        values["directives"] = _directives_text(values["directives"])
    return build(WORLD_KINDS[mapping.tag], values, "world")
