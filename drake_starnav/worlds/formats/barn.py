"""Worlds of the BARN benchmark, from a file: cylinders, start, goal, and the time that a perfect robot takes."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.parameters import check_parameters, parameter
from drake_starnav.worlds.endpoints import check_free_ends
from drake_starnav.worlds.formats.listings import check_list, check_numbers
from drake_starnav.worlds.formats.world_file import WorldFile
from drake_starnav.worlds.solvable import check_robot_radius
from drake_starnav.worlds.world import MOST_SHAPES, World

BENCHMARK_SPEED = 2.0
"""The optimal time of a world is its official path length over this speed, m/s."""
_KEYS = ("cylinders", "start", "goal", "path_length_official")


@dataclass(frozen=True)
class Barn:
    """A numbered world of a file in the BARN benchmark's form, or of the shipped one with worlds of the same kind.

    Source: D. Perille et al., Benchmarking metric ground navigation, 2020; score of the BARN challenge since 2024.
    """

    file: str = parameter("barn_like", "shipped file of worlds by name, or the path of a JSON file", path=True)
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
        place, entry = WorldFile.read("Barn", self.file).world(self.id, _KEYS)
        cylinders = check_list(entry["cylinders"], f"{place}: cylinders")
        if len(cylinders) > MOST_SHAPES:
            raise StarnavError(f"{place} has {len(cylinders)} cylinders; allowed: at most {MOST_SHAPES}")
        for k, cylinder in enumerate(cylinders):
            check_numbers(cylinder, f"{place}: cylinders[{k}]", ("x", "y", "radius"))
        x, y, yaw = check_numbers(entry["start"], f"{place}: start", ("x", "y", "yaw"))
        goal_x, goal_y = check_numbers(entry["goal"], f"{place}: goal", ("x", "y"))
        (length,) = check_numbers([entry["path_length_official"]], f"{place}: path_length_official", ("a length in m",))
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
        check_free_ends(world, robot_radius, place)
        return world

    def check_numbers(self, numbers: Iterable[int]) -> None:
        """Raise `StarnavError` unless the file has a world of each number."""
        WorldFile.read("Barn", self.file).check_numbers(numbers)
