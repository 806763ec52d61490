"""Worlds of the BARN benchmark, from a file: cylinders, start, goal, and the time that a perfect robot takes."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.parameters import parameter
from drake_starnav.worlds.formats.listings import check_ends, check_list, check_numbers
from drake_starnav.worlds.formats.world_file import NumberedWorld, WorldFile
from drake_starnav.worlds.world import MOST_SHAPES, World

BENCHMARK_SPEED = 2.0
"""The optimal time of a world is its official path length over this speed, m/s."""


@dataclass(frozen=True)
class Barn(NumberedWorld):
    """A numbered world of a file in the BARN benchmark's form, or of the shipped one with worlds of the same kind.

    Source: D. Perille et al., Benchmarking metric ground navigation, 2020; score of the BARN challenge since 2024.
    """

    file: str = parameter("barn_like", "shipped file of worlds by name, or the path of a JSON file", path=True)

    KEYS = ("cylinders", "start", "goal", "path_length_official")

    def _world(self, entry: dict[str, Any], place: str, file: WorldFile) -> World:
        cylinders = check_list(entry["cylinders"], f"{place}: cylinders")
        if len(cylinders) > MOST_SHAPES:
            raise StarnavError(f"{place} has {len(cylinders)} cylinders; allowed: at most {MOST_SHAPES}")
        for k, cylinder in enumerate(cylinders):
            check_numbers(cylinder, f"{place}: cylinders[{k}]", ("x", "y", "radius"))
        start, goal = check_ends(entry["start"], entry["goal"], f"{place}: ")
        (length,) = check_numbers([entry["path_length_official"]], f"{place}: path_length_official", ("a length in m",))
        if length <= 0.0:
            raise StarnavError(f"{place}: path_length_official is {length:g}; allowed: 0 < x m")
        return World(
            name=f"barn_{self.id}",
            start=start,
            goal=goal,
            cylinders=np.array(cylinders),
            timeout=self.TIMEOUT,
            optimal_time=length / BENCHMARK_SPEED,
        )
