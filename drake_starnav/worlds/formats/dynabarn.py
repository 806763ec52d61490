"""Worlds of the DynaBARN benchmark, from a file: an arena with three walls and discs that cross it."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from drake_starnav.errors import StarnavError, shown
from drake_starnav.parameters import check_parameters, parameter
from drake_starnav.worlds.endpoints import check_free_ends
from drake_starnav.worlds.formats.listings import check_list, check_numbers
from drake_starnav.worlds.formats.world_file import WorldFile, check_keys
from drake_starnav.worlds.moving_obstacles import Movers
from drake_starnav.worlds.outlines import place, rectangle
from drake_starnav.worlds.solvable import check_robot_radius
from drake_starnav.worlds.world import World

MOVER_RADIUS = 0.5
"""Of every obstacle that moves, m."""
_POSE = ("x", "y", "z", "roll", "pitch", "yaw")


@dataclass(frozen=True)
class DynaBarn:
    """A numbered world of a file in the DynaBARN benchmark's form, or of the shipped one with worlds of the same kind.

    The obstacles move evenly between the file's key frames, which the benchmark's own simulator joins by a spline.

    Source: A. Nair et al., DynaBARN: benchmarking metric ground navigation in dynamic environments, 2022.
    """

    file: str = parameter("dynabarn_like", "shipped file of worlds by name, or the path of a JSON file", path=True)
    id: int = parameter(0, "number of the world in the file", low=0)
    timeout: float = parameter(100.0, "time a trial may take", unit="s", above=0.0)

    def make(self, rng: np.random.Generator, robot_radius: float) -> World:
        """The world as the file has it; nothing in it is random.

        Args:
            rng: not used.
            robot_radius: m.

        Raises:
            StarnavError: the file is missing or not one of worlds, it has no world of that number or one that lacks
                something, or the robot touches a wall at the start or the goal.
        """
        check_parameters(self, "DynaBarn")
        check_robot_radius(robot_radius)
        file = WorldFile.read("DynaBarn", self.file)
        name, entry = file.world(self.id, ("walls", "plugins"))
        check_keys(file.content, str(file.path), ("meta", "trajectories"))
        meta = file.content["meta"]
        check_keys(meta, f"{file.path}: meta", ("start", "goal"))
        x, y, yaw = check_numbers(meta["start"], f"{file.path}: meta.start", ("x", "y", "yaw"))
        goal_x, goal_y = check_numbers(meta["goal"], f"{file.path}: meta.goal", ("x", "y"))
        world = World(
            name=f"dynabarn_{self.id}",
            start=(x, y, yaw),
            goal=(goal_x, goal_y),
            polygons=_walls(entry["walls"], f"{name}: walls"),
            timeout=self.timeout,
            movers=_movers(file, check_list(entry["plugins"], f"{name}: plugins"), name),
        )
        check_free_ends(world, robot_radius, name)
        return world

    def check_numbers(self, numbers: Iterable[int]) -> None:
        """Raise `StarnavError` unless the file has a world of each number."""
        WorldFile.read("DynaBarn", self.file).check_numbers(numbers)


def _walls(walls: Any, name: str) -> tuple[np.ndarray, ...]:
    polygons = []
    for k, wall in enumerate(check_list(walls, name)):
        check_keys(wall, f"{name}[{k}]", ("pose", "size"))
        x, y, *_, yaw = check_numbers(wall["pose"], f"{name}[{k}].pose", _POSE)
        length, width, height = check_numbers(wall["size"], f"{name}[{k}].size", ("x", "y", "z"))
        if min(length, width, height) <= 0.0:
            raise StarnavError(f"{name}[{k}].size is {shown(wall['size'])}; allowed: positive lengths, m")
        polygons.append(place(rectangle(-0.5 * length, -0.5 * width, 0.5 * length, 0.5 * width), (x, y), yaw))
    return tuple(polygons)


def _movers(file: WorldFile, plugins: Iterable[Any], name: str) -> Movers:
    """The obstacles of the trajectories that a world names."""
    trajectories, paths = file.content["trajectories"], []
    for k, plugin in enumerate(plugins):
        if not isinstance(trajectories, dict) or not isinstance(plugin, str) or plugin not in trajectories:
            raise StarnavError(f"{name}: plugins[{k}] is {shown(plugin)}; allowed: the name of one of the trajectories")
        where = f"{file.path}: trajectories.{plugin}"
        check_keys(trajectories[plugin], where, ("total", "keys"))
        keys = check_list(trajectories[plugin]["keys"], f"{where}.keys")
        path = [list(check_numbers(key, f"{where}.keys[{n}]", ("t", "x", "y"))) for n, key in enumerate(keys)]
        (total,) = check_numbers([trajectories[plugin]["total"]], f"{where}.total", ("a time in s",))
        if path and total > path[-1][0]:
            path.append([total, *path[-1][1:]])  # it waits until it begins anew
        paths.append(np.array(path).reshape(-1, 3))
    try:
        return Movers(np.full(len(paths), MOVER_RADIUS), tuple(paths))
    except StarnavError as error:
        raise StarnavError(f"{name}: {error}") from None
