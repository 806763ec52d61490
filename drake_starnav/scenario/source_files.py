"""The files from which a scenario's world and robot are made."""

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from drake_starnav.errors import StarnavError
from drake_starnav.robot import MODEL_FILES
from drake_starnav.scenario.directives import limits_file
from drake_starnav.scenario.scenario_file import scenario_path
from drake_starnav.scenario.schema import Scenario
from drake_starnav.utils.resources import resolve_path
from drake_starnav.worlds.formats.map_file import image_path
from drake_starnav.worlds.formats.model_files import Models
from drake_starnav.worlds.formats.obstacles import Model
from drake_starnav.worlds.formats.ros_map import RosMap
from drake_starnav.worlds.formats.world_file import shipped_file


def input_files(name_or_path: str, scenario: Scenario) -> set[Path]:
    """All files that are read for a scenario loaded by a name or path; none of them may be overwritten."""
    return {scenario_path(name_or_path), *source_files(scenario)}


def source_files(scenario: Scenario) -> set[Path]:
    """The files that a scenario's world and robot are made from, by their real paths: models, meshes, maps, worlds.

    They are found by reading them; where that ends with an error, so will every run.
    """
    models, world = Models(), scenario.world
    with suppress(StarnavError):
        if isinstance(world, Model):
            if "\n" in world.directives:
                models.directives(world.directives, Path.cwd())
            else:
                models.model(resolve_path(world.directives))
    if scenario.robot.model.endswith(MODEL_FILES):
        beside = limits_file(scenario.robot.model)
        models.read |= set() if beside is None else {beside.resolve()}
        with suppress(StarnavError):
            models.model(Path(scenario.robot.model))
    with suppress(OSError, RuntimeError, ValueError):  # too long a name, a loop of links, a null byte
        models.read |= {path.resolve() for path in _data_files(world) if path.is_file()}
    return {path for path in models.read if path.is_file()}


def _data_files(world: object) -> Iterator[Path]:
    if isinstance(world, RosMap):
        path = resolve_path(world.file)
        yield path
        yield image_path(path)
    elif file := getattr(world, "file", ""):
        yield shipped_file(file) or Path(file)
