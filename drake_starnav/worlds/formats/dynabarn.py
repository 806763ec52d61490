"""Worlds of the DynaBARN benchmark, from a file: an arena with three walls and discs that cross it."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from drake_starnav.errors import StarnavError, shown
from drake_starnav.parameters import parameter
from drake_starnav.worlds.formats.listings import check_ends, check_list, check_numbers
from drake_starnav.worlds.formats.world_file import NumberedWorld, WorldFile, check_keys
from drake_starnav.worlds.moving_obstacles import MovingObstacles
from drake_starnav.worlds.outlines import place, rectangle
from drake_starnav.worlds.world import World

MOVING_OBSTACLE_RADIUS = 0.5
"""Of every moving obstacle, m."""
_POSE = ("x", "y", "z", "roll", "pitch", "yaw")


@dataclass(frozen=True)
class DynaBarn(NumberedWorld):
    """A numbered world of a file in the DynaBARN benchmark's form, or of the shipped one with worlds of the same kind.

    The obstacles move uniformly between the file's key frames, which the benchmark's own simulator joins by a spline.

    Source: A. Nair et al., DynaBARN: benchmarking metric ground navigation in dynamic environments, 2022.
    """

    file: str = parameter("dynabarn_like", "shipped file of worlds by name, or the path of a JSON file", path=True)

    KEYS = ("walls", "plugins")

    def _world(self, entry: dict[str, Any], place: str, file: WorldFile) -> World:
        check_keys(file.content, str(file.path), ("meta", "trajectories"))
        meta = file.content["meta"]
        check_keys(meta, f"{file.path}: meta", ("start", "goal"))
        start, goal = check_ends(meta["start"], meta["goal"], f"{file.path}: meta.")
        return World(
            name=f"dynabarn_{self.id}",
            start=start,
            goal=goal,
            polygons=_walls(entry["walls"], f"{place}: walls"),
            timeout=self.TIMEOUT,
            moving_obstacles=_moving_obstacles(file, check_list(entry["plugins"], f"{place}: plugins"), place),
        )


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


def _moving_obstacles(file: WorldFile, plugins: Iterable[Any], name: str) -> MovingObstacles:
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
            path.append([total, *path[-1][1:]])  # it waits until its path begins again
        paths.append(np.array(path).reshape(-1, 3))
    try:
        return MovingObstacles(np.full(len(paths), MOVING_OBSTACLE_RADIUS), tuple(paths))
    except StarnavError as error:
        raise StarnavError(f"{name}: {error}") from None
