"""Files of numbered worlds, as benchmarks have them: {"worlds": [{"id": 0, ...}, ...]} in JSON; their one reader."""

import json
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from drake_starnav.errors import StarnavError, shown
from drake_starnav.geometry.footprint import Footprint
from drake_starnav.parameters import parameter
from drake_starnav.utils.files import explain_read_errors, read_text
from drake_starnav.utils.resources import find_model_path
from drake_starnav.worlds.moving_obstacles import MovingObstacles
from drake_starnav.worlds.outlines import make_rectangle, place
from drake_starnav.worlds.world import MOST_SHAPES, World, check_keys, check_numbers

_POSE = ("x", "y", "z", "roll", "pitch", "yaw")


def find_shipped_file(name: str) -> Path | None:
    """The shipped file of worlds of that name, if there is one."""
    path = find_model_path("worlds", f"{name}.json")
    return path if Path(name).name == name and os.path.isfile(path) else None


@dataclass(frozen=True)
class WorldFile:
    """The content of a file at a path, and its worlds by number."""

    path: Path
    content: dict[str, Any]
    worlds: dict[int, dict[str, Any]]

    @classmethod
    def read(cls, kind: str, file: str) -> "WorldFile":
        """The file that `file` names: shipped (`models/worlds/<kind>_....json`) or a path.

        Raises:
            StarnavError: the file is missing or not one of worlds.
        """
        path = find_shipped_file(file) or Path(file)
        shipped_names = ", ".join(sorted(p.stem for p in find_model_path("worlds").glob(f"{kind.lower()}_*.json")))
        place, allowed_text = f"world.file {shown(file)}", f"{shipped_names}, or the path of a JSON file of worlds"
        text = read_text(path, place, allowed_text)
        with explain_read_errors(place, allowed_text):
            file_content = json.loads(text)
        world_entries = file_content.get("worlds") if isinstance(file_content, dict) else None
        if not isinstance(world_entries, list) or not world_entries:
            raise StarnavError(f"{path} has no list of worlds; allowed: {{'worlds': [...]}} with at least one")
        worlds: dict[int, dict[str, Any]] = {}
        for k, entry in enumerate(world_entries):
            number = entry.get("id") if isinstance(entry, dict) else None
            if isinstance(number, bool) or not isinstance(number, int) or number < 0 or number in worlds:
                raise StarnavError(
                    f"{path}: worlds[{k}] has the id {shown(number)}; allowed: a whole number >= 0, each once"
                )
            worlds[number] = entry
        return cls(path, file_content, worlds)

    def check_numbers(self, numbers: Iterable[int]) -> None:
        """Raise `StarnavError` unless the file has a world of each number."""
        for number in numbers:
            if number not in self.worlds:
                known_ids = shown(sorted(self.worlds))
                raise StarnavError(f"world.id is {number}; allowed: a world of {self.path}: {known_ids}")

    def world(self, number: int, keys: Sequence[str]) -> tuple[str, dict[str, Any]]:
        """A world's name in messages and its entry, or a `StarnavError` if the entry lacks one of the keys."""
        self.check_numbers([number])
        place, entry = f"{self.path}: world {number}", self.worlds[number]
        check_keys(entry, place, keys)
        return place, entry


@dataclass(frozen=True)
class NumberedWorld:
    """One world of a file; each benchmark's form is a subclass, which says what an entry holds."""

    file: str = parameter("", "shipped file of worlds by name, or the path of a JSON file", path=True)
    id: int = parameter(0, "number of the world in the file", low=0)

    TIMEOUT: ClassVar[float] = 100.0
    """Time a trial may take, s, that of the BARN challenge."""
    KEYS: ClassVar[tuple[str, ...]] = ()
    """What an entry must have."""

    def make(self, rng: np.random.Generator, robot: Footprint) -> World:
        """The world as in the file; nothing in it is random.

        Raises:
            StarnavError: the file is missing or holds no worlds, it has no world of that number or an incomplete one.
        """
        file = WorldFile.read(type(self).__name__, self.file)
        place, entry = file.world(self.id, self.KEYS)
        try:
            return self._world(entry, file.content)
        except StarnavError as error:
            raise StarnavError(f"{place}: {error}") from None

    @property
    def place(self) -> str:
        """Its name in messages."""
        return f"{self.file}: world {self.id}"

    def check_numbers(self, numbers: Iterable[int]) -> None:
        """Raise `StarnavError` unless the file has a world of each number."""
        WorldFile.read(type(self).__name__, self.file).check_numbers(numbers)

    def _world(self, entry: dict[str, Any], content: dict[str, Any]) -> World:
        """The world of an entry of a file of that content."""
        raise NotImplementedError


@dataclass(frozen=True)
class Barn(NumberedWorld):
    """A numbered world of a file in the BARN benchmark's form, or of the shipped one with worlds of the same kind.

    Source: D. Perille et al., Benchmarking metric ground navigation, 2020; score of the BARN challenge since 2024.
    """

    file: str = parameter("barn_like", "shipped file of worlds by name, or the path of a JSON file", path=True)

    KEYS = ("cylinders", "start", "goal", "path_length_official")

    def _world(self, entry: dict[str, Any], content: dict[str, Any]) -> World:
        (length,) = check_numbers([entry["path_length_official"]], "path_length_official", ("a length in m",))
        if length <= 0.0:
            raise StarnavError(f"path_length_official is {length:g}; allowed: 0 < x m")
        world = World(
            name=f"barn_{self.id}",
            start=entry["start"],
            goal=entry["goal"],
            cylinders=entry["cylinders"],
            timeout=self.TIMEOUT,
            optimal_time=length / 2.0,  # as the benchmark takes it: at 2 m/s
        )
        if len(world.cylinders) > MOST_SHAPES:
            raise StarnavError(f"it has {len(world.cylinders)} cylinders; allowed: at most {MOST_SHAPES}")
        return world


@dataclass(frozen=True)
class DynaBarn(NumberedWorld):
    """A numbered world of a file in the DynaBARN benchmark's form, or of the shipped one with worlds of the same kind.

    The obstacles move uniformly between the file's key frames, which the benchmark's own simulator joins by a spline.

    Source: A. Nair et al., DynaBARN: benchmarking metric ground navigation in dynamic environments, 2022.
    """

    file: str = parameter("dynabarn_like", "shipped file of worlds by name, or the path of a JSON file", path=True)

    KEYS = ("walls", "plugins")

    def _world(self, entry: dict[str, Any], content: dict[str, Any]) -> World:
        check_keys(content, "the file", ("meta", "trajectories"))
        meta = content["meta"]
        check_keys(meta, "meta", ("start", "goal"))
        return World(
            name=f"dynabarn_{self.id}",
            start=meta["start"],
            goal=meta["goal"],
            polygons=_read_walls(_list_world_numbers(entry, "walls")),
            timeout=self.TIMEOUT,
            moving_obstacles=_read_moving_obstacles(content["trajectories"], _list_world_numbers(entry, "plugins")),
        )


def _list_world_numbers(mapping: dict[str, Any], key: str) -> list:
    if not isinstance(mapping[key], list):
        raise StarnavError(f"{key} is {shown(mapping[key])}; allowed: a list")
    return mapping[key]


def _read_walls(walls: list) -> tuple[np.ndarray, ...]:
    polygons = []
    for k, wall in enumerate(walls):
        check_keys(wall, f"walls[{k}]", ("pose", "size"))
        x, y, *_, yaw = check_numbers(wall["pose"], f"walls[{k}].pose", _POSE)
        length, width, height = check_numbers(wall["size"], f"walls[{k}].size", ("x", "y", "z"))
        if min(length, width, height) <= 0.0:
            raise StarnavError(f"walls[{k}].size is {shown(wall['size'])}; allowed: positive lengths, m")
        polygons.append(place(make_rectangle(-0.5 * length, -0.5 * width, 0.5 * length, 0.5 * width), (x, y), yaw))
    return tuple(polygons)


def _read_moving_obstacles(trajectories: Any, plugins: list) -> MovingObstacles:
    paths = []
    for k, plugin in enumerate(plugins):
        if not isinstance(trajectories, dict) or not isinstance(plugin, str) or plugin not in trajectories:
            raise StarnavError(f"plugins[{k}] is {shown(plugin)}; allowed: the name of one of the trajectories")
        trajectory, trajectory_place = trajectories[plugin], f"trajectories.{plugin}"
        check_keys(trajectory, trajectory_place, ("total", "keys"))
        key_frames = enumerate(_list_world_numbers(trajectory, "keys"))
        way_points = [check_numbers(key, f"{trajectory_place}.keys[{n}]", ("t", "x", "y")) for n, key in key_frames]
        (total_time,) = check_numbers([trajectory["total"]], f"{trajectory_place}.total", ("a time in s",))
        if way_points and total_time > way_points[-1][0]:
            way_points.append((total_time, *way_points[-1][1:]))  # it waits until its path begins again
        paths.append(np.array(way_points).reshape(-1, 3))
    return MovingObstacles(np.full(len(paths), 0.5), tuple(paths))
