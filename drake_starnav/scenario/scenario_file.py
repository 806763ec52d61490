"""Scenarios: typed parameters <-> YAML."""

import dataclasses
import math
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml

from drake_starnav.errors import StarnavError, shown
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.parameters import build, declared, unknown_name
from drake_starnav.robot import MODEL_FILES, RobotParameters
from drake_starnav.safety.zones import ZONE_KINDS
from drake_starnav.scenario import directives
from drake_starnav.scenario.schema import DRAKE_CONFIGS, KEYS, LISTS, SECTIONS, Scenario
from drake_starnav.scenario.shipped import check_method_name, import_method, list_scenario_names
from drake_starnav.utils.files import read_text, write_text
from drake_starnav.utils.imported import import_named
from drake_starnav.utils.resources import find_model_path
from drake_starnav.utils.yaml_text import Loader, SectionDumper, Tagged, format_section, load_yaml, read_mapping
from drake_starnav.worlds import WORLD_KINDS, Model, is_world_kind
from drake_starnav.worlds.world import check_numbers

NOT_IN_NAMES = r"[^\w.-]"
"""Characters that no robot's name has, as it is part of the names of systems and of paths."""
GIVEN_ENDS = ("Obstacles", "RosMap", "Model")
"""Kinds of worlds with a `start` and a `goal`, which are those of the first of several robots."""


def find_scenario(name_or_path: str | Path) -> Path:
    """The file of a shipped scenario, or the one at a path; a `StarnavError` if there is neither."""
    path, name_or_path = Path(name_or_path), str(name_or_path)
    if path.suffix in MODEL_FILES:
        raise StarnavError(
            f"scenario {shown(name_or_path)} is the model of a robot; allowed: a scenario, with "
            f"robot.model={name_or_path}"
        )
    if path.suffix in (".yaml", ".yml") or os.path.isfile(path):
        return path
    if name_or_path not in list_scenario_names():
        known_names = [*list_scenario_names(), "a path to a YAML file"]
        raise unknown_name(f"scenario {shown(name_or_path)}", "" if path.suffix else name_or_path, known_names)
    return find_model_path("scenarios", f"{name_or_path}.yaml")


def load_scenario(name_or_path: str | Path, *, method: str = "star", overrides: Sequence[str] = ()) -> Scenario:
    """A shipped scenario by name, or one from a YAML file by path; arguments and errors as in `loading.load_scenario`.

    What the scenario does not say is taken from the YAML file beside the robot's model, see `read_model_sections`.
    """
    path = find_scenario(name_or_path)
    import_method(method)  # a module that is missing is told before anything runs
    text = read_text(path, f"scenario file {path}")
    name = os.fsencode(path.stem).decode("utf-8", errors="replace")
    return parse_scenario(
        text, name=name, place=str(path), method=method, overrides=overrides, folder=path.absolute().parent
    )


def parse_scenario(
    text: str,
    *,
    name: str,
    place: str = "scenario",
    method: str = "star",
    overrides: Sequence[str] = (),
    folder: str | Path | None = None,
) -> Scenario:
    """A scenario from YAML text, as `loading.parse_scenario`, but without the footprint of the robot's model.

    Paths of world and robot in the text begin at `folder`; those in overrides, and all without it, where the program
    runs.
    """
    sections = read_mapping(text, place, (*KEYS, "directives"))
    if "directives" in sections:
        directives.move_directives(sections, place)
    if folder is not None:
        directives.make_paths_absolute(sections, Path(folder))
    for override in overrides:
        _read_override(sections, override)
    directives.make_paths_absolute(sections, Path.cwd())
    check_method_name(method)
    for key in sections:
        if key not in KEYS:
            raise unknown_name(f"key {key} in {place}", str(key), (*KEYS, "directives"))
    robot_scenarios = _make_robot_scenarios(sections, place, method)
    if robot_scenarios:
        world, (start, goal) = sections.get("world"), (robot_scenarios[0].start, robot_scenarios[0].goals[-1][:2])
        if isinstance(world, Tagged) and world.tag in GIVEN_ENDS:
            sections["world"] = format_section({"start": list(start or ()), "goal": list(goal), **world}, world.tag)
    scenario = _make_scenario(sections, name, place, method)
    shared_robots = [dataclasses.replace(robot, world=scenario.world) for robot in robot_scenarios]
    return dataclasses.replace(scenario, robots=tuple(shared_robots)) if robot_scenarios else scenario


def _make_scenario(sections: dict[str, Any], name: str, place: str, method: str) -> Scenario:
    robot = sections["robot"] = directives.keep_one_shape(sections.get("robot"))
    model = str(robot.get("model", RobotParameters.model) if isinstance(robot, dict) else RobotParameters.model)
    limits, parts = directives.read_model_sections(model, sections), {}
    robot_section = {**limits.get("robot", {}), **(robot if isinstance(robot, dict) else {})}
    if model.endswith(MODEL_FILES) and not robot_section.keys() & set(directives.SHAPE):
        sections["robot"]["radius"] = 0.0  # as of the model
    for key, cls in SECTIONS.items():
        base = build(cls, limits.get(key), f"{directives.find_limits_file(model)}: {key}" if key in limits else key)
        parts[key] = build(cls, sections.get(key), key, base=base)
    parts |= _make_lidar_sections(sections.get("lidars", limits.get("lidars")), parts["lidar"])
    configs: dict[str, Any] = {key: _read_drake_config(sections.get(key), key) for key in DRAKE_CONFIGS}
    parts["goals"] = _read_goals(sections.get("goals"))
    parts["zones"] = _read_zones(sections.get("zones"))
    return Scenario(name=name, world=_read_world(sections.get("world"), place), method=method, **parts, **configs)


def _make_robot_scenarios(sections: dict[str, Any], place: str, method: str) -> list[Scenario]:
    """A scenario for each of the `robots` in the sections of a scenario, which are taken out of them."""
    entries = sections.pop("robots", None)
    if entries is None:
        return []
    if not isinstance(entries, list) or len(entries) < 2 or not all(isinstance(each, dict) for each in entries):
        raise StarnavError(f"robots is {shown(entries)}; allowed: a list of two or more mappings, one for each robot")
    if sections.get("goals") is not None:
        raise StarnavError(f"goals in {place} beside robots; allowed: goals of each of the robots")
    robots = [_make_robot_scenario(sections, entry, k, place, method) for k, entry in enumerate(entries)]
    if len({robot.name for robot in robots}) < len(robots):
        raise StarnavError(f"robots are named {', '.join(robot.name for robot in robots)}; allowed: each name once")
    return declare_each_other(robots)


def _make_robot_scenario(sections: dict[str, Any], entry: dict[str, Any], k: int, place: str, method: str) -> Scenario:
    """The scenario of an entry of `robots`, by its number, from 0."""
    own, at = dict(entry), f"robots[{k}]"
    if ("goal" in own) == ("goals" in own) or "start" not in own:
        raise StarnavError(f"{at} has {', '.join(map(str, own)) or 'nothing'}; allowed: start, and goal or goals")
    (x, y, yaw), goals = check_numbers(own.pop("start"), f"{at}.start", ("x", "y", "yaw")), own.pop("goals", None)
    goals = [own.pop("goal")] if goals is None else goals
    parts: dict[str, Any] = {key: own.pop(key) for key in ("lidar", "lidars") if key in own}
    common_robot = sections.get("robot")
    model = Path(str({**(common_robot or {}), **own}.get("model", "starbot"))).stem
    name = own.pop("name", f"{re.sub(NOT_IN_NAMES, '_', model)}_{k + 1}")
    if not isinstance(name, str) or not name or re.search(NOT_IN_NAMES, name):
        raise StarnavError(f"{at}.name is {shown(name)}; allowed: a text of letters, digits, _, - and .")
    own = {**sections, **parts, "robot": {**directives.lay_beneath(common_robot, own), **own}, "goals": goals}
    try:
        robot = _make_scenario(own, name, place, method)
    except StarnavError as error:
        raise StarnavError(f"{at}: {error}") from None
    return dataclasses.replace(robot, start=(float(x), float(y), float(yaw)))


def declare_each_other(robots: Sequence[Scenario]) -> list[Scenario]:
    """The scenarios of robots to each of which the others are obstacles that move, as fast and as large as they are."""
    declared_robots = []
    for robot in robots:
        others, obstacles = [other.robot for other in robots if other is not robot], robot.obstacles
        max_speed = max(obstacles.max_speed, *(other.max_speed for other in others))
        max_radius = max(obstacles.max_radius, *(other.radius for other in others))
        obstacles = dataclasses.replace(obstacles, max_speed=max_speed, max_radius=max_radius)
        declared_robots.append(dataclasses.replace(robot, obstacles=obstacles))
    return declared_robots


def save_scenario(scenario: Scenario, path: str | Path) -> None:
    """Write a scenario to a YAML file; `load_scenario` reads back an equal one if the file has its name."""
    write_text(Path(path), format_scenario(scenario))


def format_scenario(scenario: Scenario) -> str:
    """The scenario as YAML text that `parse_scenario` reads back to an equal one; every key is written out."""
    sections: dict[str, Any] = {}
    if scenario.world is not None:
        kind = type(scenario.world)
        is_shipped = kind.__module__.startswith("drake_starnav.")  # another is found by its module, also by workers
        world_tag = kind.__name__ if is_shipped else f"{kind.__module__}:{kind.__qualname__}"
        sections["world"] = format_section(_list_declared(scenario.world), world_tag)
    sections |= {key: format_section(_list_declared(getattr(scenario, key))) for key in SECTIONS}
    if scenario.lidars:
        sections["lidars"] = [format_section(_list_declared(each)) for each in scenario.lidars]
    if scenario.goals:
        sections["goals"] = [list(goal) for goal in scenario.goals]
    if scenario.zones:
        sections["zones"] = [
            format_section({**dataclasses.asdict(zone), "polygon": [*map(list, zone.polygon)]}, type(zone).__name__)
            for zone in scenario.zones
        ]
    if scenario.robots:
        sections["robots"] = [_make_robot_section(robot) for robot in scenario.robots]
    sections |= {key: format_section(getattr(scenario, key)) for key in DRAKE_CONFIGS if getattr(scenario, key)}
    return yaml.dump(
        sections, Dumper=SectionDumper, default_flow_style=None, sort_keys=False, width=math.inf, allow_unicode=True
    )


def _make_robot_section(robot: Scenario) -> Tagged:
    own_keys = {"name": robot.name, "start": list(robot.start or ()), "goals": [list(goal) for goal in robot.goals]}
    lidars = {"lidars": [format_section(_list_declared(each)) for each in robot.lidars]} if robot.lidars else {}
    return format_section(
        {**own_keys, **_list_declared(robot.robot), "lidar": format_section(_list_declared(robot.lidar)), **lidars}
    )


def _make_lidar_sections(lidar_parameters: Any, base: LidarParameters) -> dict[str, Any]:
    """The sections `lidar` and `lidars` of a scenario that lists lidars, each with the values of a base."""
    if lidar_parameters is None:
        return {}
    if not isinstance(lidar_parameters, list) or not lidar_parameters:
        raise StarnavError(f"lidars is {shown(lidar_parameters)}; allowed: a list of mappings, one for each lidar")
    lidars = tuple(build(LidarParameters, each, f"lidars[{k}]", base=base) for k, each in enumerate(lidar_parameters))
    return {"lidar": lidars[0], "lidars": lidars}


def _read_goals(entries: Any) -> tuple[tuple[float, ...], ...]:
    if entries is None:
        return ()
    if not isinstance(entries, list) or not entries or not all(isinstance(goal, list) for goal in entries):
        raise StarnavError(f"goals is {shown(entries)}; allowed: a list of [x, y] or [x, y, yaw]")
    return tuple(map(tuple, entries))


def _read_zones(entries: Any) -> tuple[Any, ...]:
    if entries is None:
        return ()
    zone_tags = ", ".join(f"!{name}" for name in ZONE_KINDS)
    if not isinstance(entries, list):
        raise StarnavError(f"zones is {shown(entries)}; allowed: a list of mappings tagged {zone_tags}")
    zones = []
    for k, entry in enumerate(entries):
        zone_kind = ZONE_KINDS.get(getattr(entry, "tag", ""))
        if zone_kind is None:
            raise StarnavError(f"zones[{k}] is {shown(entry)}; allowed: a mapping tagged {zone_tags}")
        field_names = [field.name for field in dataclasses.fields(zone_kind)]
        for key in entry:
            if key not in field_names:
                raise unknown_name(f"key {key} in zones[{k}]", str(key), field_names)
        needed_fields = [each.name for each in dataclasses.fields(zone_kind) if each.default is dataclasses.MISSING]
        if missing := [name for name in needed_fields if name not in entry]:
            raise StarnavError(f"zones[{k}] has no {missing[0]}; allowed: {', '.join(field_names)}")
        try:
            zones.append(zone_kind(**{"name": f"zones[{k}]", **entry}))
        except StarnavError as error:
            raise StarnavError(f"zones[{k}]: {error}") from None
    return tuple(zones)


def _read_drake_config(mapping: Any, key: str) -> dict[str, Any]:
    if mapping is None:
        return {}
    if not isinstance(mapping, dict) or not all(
        isinstance(name, str) and isinstance(value, (bool, int, float, str)) for name, value in mapping.items()
    ):
        raise StarnavError(f"{key} is {shown(mapping)}; allowed: a mapping of names to numbers, texts, true and false")
    return dict(mapping)


def _list_declared(part: Any) -> dict[str, Any]:
    return {field.name: getattr(part, field.name) for field in declared(part)}


def _read_override(sections: dict[str, Any], text: str) -> None:
    key, separator, value_text = text.partition("=")
    key_parts = key.split(".")
    if key not in LISTS and (not separator or len(key_parts) != 2 or not all(key_parts)):
        matching_keys = [
            f"{part}.{each.name}" for part, kind in SECTIONS.items() for each in declared(kind) if each.name == key
        ]
        hint_text = f": did you mean {' or '.join(matching_keys)}?" if matching_keys else ";"
        raise StarnavError(
            f"override {shown(text)}{hint_text} allowed: section.key=value, e.g. robot.radius=0.3, or a list: "
            f"{', '.join(LISTS)}"
        )
    part = key_parts[0]
    if part not in KEYS:
        raise unknown_name(f"key {key}", part, KEYS)
    try:
        parsed_value = load_yaml(value_text, key, Loader)
    except StarnavError:
        raise StarnavError(
            f"override {shown(text)}: the value is not valid YAML; allowed: e.g. robot.radius=0.3"
        ) from None
    if key in LISTS:
        sections[part] = parsed_value
        return
    if not isinstance(sections.get(part), dict):
        sections[part] = {}
    sections[part][key_parts[1]] = parsed_value


def _read_world(mapping: Any, place: str) -> Any:
    if mapping is None:  # of a robot that is not simulated
        return None
    if not isinstance(mapping, Tagged):
        world_tags = ", ".join(f"!{name}" for name in WORLD_KINDS)
        raise StarnavError(f"world in {place} is {shown(mapping)}; allowed: a mapping tagged {world_tags}")
    kind = import_named("world", mapping.tag) if ":" in mapping.tag else WORLD_KINDS.get(mapping.tag)
    if kind is None:
        raise unknown_name(f"world !{mapping.tag} in {place}", mapping.tag, (*WORLD_KINDS, "module:class"))
    if not is_world_kind(kind):
        raise StarnavError(f"world !{mapping.tag} in {place} is {shown(kind)}; allowed: a dataclass with a method make")
    world_values = dict(mapping)
    if mapping.tag == Model.__name__ and isinstance(world_values.get("directives"), list):
        world_values["directives"] = directives.format_directives(world_values["directives"])
    return build(kind, world_values, "world")
