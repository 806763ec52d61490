"""Worlds of the BARN benchmark, from a file: cylinders, start, goal, and the time that a perfect robot takes."""

import json
import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.models import model_path
from drake_starnav.parameters import check_parameters, parameter
from drake_starnav.worlds.clearance import nearest_obstacle
from drake_starnav.worlds.solvable import check_robot_radius
from drake_starnav.worlds.world import World

BENCHMARK_SPEED = 2.0
"""The optimal time of a world is its official path length over this speed, m/s."""
_KEYS = ("cylinders", "start", "goal", "path_length_official")


@dataclass(frozen=True)
class Barn:
    """A numbered world of a file in the BARN benchmark's form, or of the shipped one with worlds of the same kind.

    Source: D. Perille et al., Benchmarking metric ground navigation, 2020; score of the BARN challenge, 2022.
    """

    file: str = parameter("barn_like", "shipped file of worlds by name, or the path of a JSON file")
    id: int = parameter(0, "number of the world in the file", low=0)
    timeout: float = parameter(100.0, "time a trial may take", unit="s", above=0.0)

    def make(self, rng: np.random.Generator, robot_radius: float) -> World:
        """The world as the file has it; nothing in it is random.

        Args:
            rng: not used.
            robot_radius: m.

        Raises:
            StarnavError: the file is missing or not one of worlds, it has no world of that number or one that lacks
                something, or the robot touches an obstacle at the start or the goal.
        """
        check_parameters(self, "Barn")
        check_robot_radius(robot_radius)
        path, worlds = _read(self.file)
        _check_numbers(path, worlds, [self.id])
        place, entry = f"{path}: world {self.id}", worlds[self.id]
        missing = [key for key in _KEYS if key not in entry]
        if missing:
            raise StarnavError(f"{place} has no {', '.join(missing)}; allowed: a world with {', '.join(_KEYS)}")
        if not isinstance(entry["cylinders"], list):
            raise StarnavError(f"{place}: cylinders is {entry['cylinders']!r}; allowed: a list of [x, y, radius]")
        cylinders = [
            _numbers(row, f"{place}: cylinders[{k}]", ("x", "y", "radius")) for k, row in enumerate(entry["cylinders"])
        ]
        x, y, yaw = _numbers(entry["start"], f"{place}: start", ("x", "y", "yaw"))
        goal_x, goal_y = _numbers(entry["goal"], f"{place}: goal", ("x", "y"))
        (length,) = _numbers([entry["path_length_official"]], f"{place}: path_length_official", ("a length in m",))
        if length <= 0.0:
            raise StarnavError(f"{place}: path_length_official is {length:g}; allowed: 0 < x m")
        world = World(
            name=f"barn_{self.id}",
            start=(x, y, yaw),
            goal=(goal_x, goal_y),
            cylinders=np.array(cylinders),
            timeout=self.timeout,
            optimal_time=length / BENCHMARK_SPEED,
        )
        for name, point in (("start", world.start[:2]), ("goal", world.goal)):
            obstacle, distance = nearest_obstacle(world, point)
            if distance <= robot_radius:
                raise StarnavError(
                    f"{place}: {name} is [{point[0]:g}, {point[1]:g}], {distance:g} m from {obstacle}; "
                    f"allowed: more than robot_radius {robot_radius:g} m from every obstacle"
                )
        return world

    def check_numbers(self, numbers: Iterable[int]) -> None:
        """Raise `StarnavError` unless the file has a world of each number."""
        _check_numbers(*_read(self.file), numbers)


def _read(file: str) -> tuple[Path, dict[int, dict[str, Any]]]:
    """The path of a file of worlds, and its worlds by number."""
    path = model_path("worlds", f"{file}.json")
    if not path.is_file():
        path = Path(file)
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        names = ", ".join(sorted(p.stem for p in model_path("worlds").glob("*.json")))
        raise StarnavError(
            f"Barn.file is {file!r}, which cannot be read ({error.strerror}); "
            f"allowed: {names}, or the path of a JSON file of worlds"
        ) from None
    except ValueError as error:  # neither text nor JSON
        raise StarnavError(f"{path} is not JSON: {error}; allowed: a JSON file of worlds") from None
    entries = content.get("worlds") if isinstance(content, dict) else None
    if not isinstance(entries, list) or not entries:
        raise StarnavError(f"{path} has no list of worlds; allowed: {{'worlds': [...]}} with at least one")
    worlds: dict[int, dict[str, Any]] = {}
    for k, entry in enumerate(entries):
        number = entry.get("id") if isinstance(entry, dict) else None
        if isinstance(number, bool) or not isinstance(number, int) or number < 0 or number in worlds:
            raise StarnavError(f"{path}: worlds[{k}] has the id {number!r}; allowed: a whole number >= 0, each once")
        worlds[number] = entry
    return path, worlds


def _check_numbers(path: Path, worlds: dict[int, dict[str, Any]], numbers: Iterable[int]) -> None:
    for number in numbers:
        if number not in worlds:
            raise StarnavError(f"Barn.id is {number}; allowed: a world of {path}: {_ranges(sorted(worlds))}")


def _numbers(value: Any, place: str, entries: tuple[str, ...]) -> list[float]:
    numbers = value if isinstance(value, list) else []
    good = all(isinstance(x, (int, float)) and not isinstance(x, bool) and math.isfinite(x) for x in numbers)
    if len(numbers) != len(entries) or not good:
        raise StarnavError(f"{place} is {value!r}; allowed: finite [{', '.join(entries)}]")
    return numbers


def _ranges(numbers: list[int]) -> str:
    """Ascending numbers as text: [0, 1, 2, 5] is "0-2, 5"."""
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][-1] + 1:
            runs[-1][1:] = [number]
        else:
            runs.append([number])
    return ", ".join("-".join(str(x) for x in run) for run in runs)
