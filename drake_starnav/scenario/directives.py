"""Model directives in a scenario, the files that world and robot name, and the limits beside a robot's URDF."""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from drake_starnav.errors import StarnavError, shown
from drake_starnav.parameters import build
from drake_starnav.robot import MODEL_FILES, RobotParameters
from drake_starnav.utils.files import extract_reason, read_text
from drake_starnav.utils.resources import find_model_path
from drake_starnav.utils.yaml_text import Loader, SectionDumper, Tagged, load_yaml
from drake_starnav.worlds import WORLD_KINDS, Model
from drake_starnav.worlds.formats.world_file import find_shipped_file

READ_MAPPINGS = ("robot", "lidar")
"""Mappings that the YAML file beside a robot's model may hold, beside the list `lidars`; all else is not read."""
SHAPE = ("radius", "footprint")
"""Either of these says what a robot covers."""


def move_directives(sections: dict[str, Any], place: str) -> None:
    """Move `directives` of a scenario into its world, which must be a `!Model`."""
    directives, world = sections.pop("directives"), sections.get("world")
    if not isinstance(directives, list):
        raise StarnavError(f"directives in {place} is {shown(directives)}; allowed: a list of Drake's model directives")
    if not isinstance(world, Tagged):
        raise _find_misplaced(place, "no world" if world is None else f"world: {shown(world)}")
    if world.tag != Model.__name__ or world.get("directives"):
        raise _find_misplaced(place, f"world: !{world.tag}" if world.tag != Model.__name__ else "world.directives")
    world["directives"] = directives


def _find_misplaced(place: str, sections: str) -> StarnavError:
    allowed_text = "beside world: !Model {start: [x, y, yaw], goal: [x, y]}"
    return StarnavError(f"directives in {place} beside {sections}; allowed: {allowed_text}")


def make_paths_absolute(sections: dict[str, Any], folder: Path) -> None:
    """Let the paths of world and robot, as read from YAML, begin at a folder, but for absolute ones, URIs and shipped
    names."""
    world, robots = sections.get("world"), sections.get("robots")
    if isinstance(world, Tagged) and world.tag in WORLD_KINDS:
        for field_ in dataclasses.fields(WORLD_KINDS[world.tag]):
            if field_.metadata.get("path") and find_shipped_file(str(world.get(field_.name))) is None:
                _make_absolute(world, "world", field_.name, folder)
        if world.tag == Model.__name__ and "directives" in world:
            world["directives"] = make_files_absolute(world["directives"], folder)
    for robot in [sections.get("robot"), *(robots if isinstance(robots, list) else [])]:
        if isinstance(robot, dict) and str(robot.get("model")).endswith(MODEL_FILES):  # else it names a shipped robot
            _make_absolute(robot, "robot", "model", folder)


def make_files_absolute(directives: Any, folder: Path) -> Any:
    """Model directives, a list or a text that holds one, whose relative paths begin at a folder: Drake takes only URIs.

    What is neither stays as it is, and so does a text without such paths.
    """
    directive_entries = directives
    if isinstance(directives, str) and "\n" in directives:
        try:
            directive_entries = load_yaml(directives, "directives", Loader)["directives"]
        except (StarnavError, TypeError, KeyError):  # Drake says what is wrong
            return directives
    found_files = [
        entry[kind]
        for entry in (directive_entries if isinstance(directive_entries, list) else [])
        if isinstance(entry, dict)
        for kind in ("add_model", "add_directives")
        if isinstance(entry.get(kind), dict)
    ]
    relative_parts = [part for part in found_files if isinstance(part.get("file"), str) and "://" not in part["file"]]
    for part in relative_parts:
        _make_absolute(part, "directives", "file", folder)
        part["file"] = f"file://{part['file']}"
    return format_directives(directive_entries) if relative_parts else directives


def format_directives(directives: list[Any]) -> str:
    """Directives as the text of a file of Drake's."""
    return yaml.dump({"directives": directives}, Dumper=SectionDumper, sort_keys=False)


def _make_absolute(mapping: Any, section: str, key: str, folder: Path) -> None:
    path_text = mapping.get(key)
    if isinstance(path_text, str) and path_text and "://" not in path_text and "\n" not in path_text:
        try:
            mapping[key] = str((folder / Path(path_text).expanduser()).resolve())
        except (OSError, RuntimeError, ValueError) as error:  # a loop of links, nobody's home, a null byte
            raise StarnavError(
                f"{section}.{key} is {shown(path_text)} ({extract_reason(error)}); allowed: the path of a file"
            ) from None


def find_limits_file(model: str) -> Path | None:
    """The file `X.yaml` beside the `X.urdf` or `X.urdf.xacro` of `robot.model`, if there is one."""
    is_own_model = model.endswith(MODEL_FILES)
    path = Path(model) if is_own_model else find_model_path("robots", model)
    neighbour_file = path.with_name(f"{path.name.partition('.')[0] if is_own_model else path.name}.yaml")
    return neighbour_file if neighbour_file.is_file() else None


def read_model_sections(model: str, sections: Mapping[str, Any]) -> dict[str, Any]:
    """The sections `robot`, `lidar` and `lidars` of a model's file, over which those of a scenario are to be laid.

    Without `model`, and without what the scenario's sections say otherwise; empty where there is no file.

    Raises:
        StarnavError: the file is no YAML file, or a section no mapping.
    """
    path = find_limits_file(model)
    if path is None:
        return {}
    file_content = load_yaml(read_text(path, f"{path} beside robot.model"), str(path), Loader)
    if not isinstance(file_content, dict):
        return {}
    model_sections: dict[str, Any] = {"lidars": file_content["lidars"]} if "lidars" in file_content else {}
    for name in READ_MAPPINGS:
        model_section, own = file_content.get(name) or {}, sections.get(name)
        if not isinstance(model_section, dict):
            raise StarnavError(f"{path}: {name} is {shown(model_section)}; allowed: a mapping, as in a scenario")
        model_sections[name] = {key: value for key, value in lay_beneath(model_section, own).items() if key != "model"}
    return model_sections


def lay_beneath(lower: Any, upper: Any) -> dict[str, Any]:
    """What a mapping says beneath another one, or nothing if it is none: no shape, if the upper one says a shape."""
    has_own = isinstance(upper, dict) and any(key in upper for key in SHAPE)
    return {
        key: value
        for key, value in (lower if isinstance(lower, dict) else {}).items()
        if not (has_own and key in SHAPE)
    }


def keep_one_shape(robot: Any) -> Any:
    """The section `robot` of a scenario with `radius` or `footprint`: [] is no footprint, 0 beside one no radius.

    Raises:
        StarnavError: it says both, and they differ.
    """
    if not isinstance(robot, dict):
        return robot
    kept_fields = {key: value for key, value in robot.items() if key != "footprint" or value != []}
    if all(key in kept_fields for key in SHAPE):
        RobotParameters.check_beside(
            build(RobotParameters, {"footprint": kept_fields["footprint"]}, "robot"), kept_fields.pop("radius")
        )
    return kept_fields
