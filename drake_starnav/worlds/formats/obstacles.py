"""Worlds that are given: obstacle by obstacle, or as a file of Drake's model formats."""

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from drake_starnav.errors import StarnavError, shown
from drake_starnav.geometry.footprint import Footprint
from drake_starnav.parameters import parameter
from drake_starnav.utils.files import read_bytes
from drake_starnav.utils.resources import PACKAGE_URI, resolve_path
from drake_starnav.worlds.convex_parts import simplify_outline, split_into_convex_parts
from drake_starnav.worlds.world import MOST_SHAPES, ModelFile, World

FORMATS = (".dmd.yaml", ".sdf", ".world", ".urdf")


@dataclass(frozen=True)
class Obstacles:
    """Obstacles, start and goal as given. The goal may be out of reach, but start and goal must be free."""

    cylinders: list[list[float]] = parameter([], "one [x, y, radius] each, m")
    polygons: list[list[list[float]]] = parameter([], "one list of corners [x, y] each, m; simple, of any orientation")
    bounds: list[float] = parameter([], "[x_min, y_min, x_max, y_max] of the walls around, m; empty for an open plane")
    start: list[float] = parameter([0.0, 0.0, 0.0], "[x, y, yaw] of the robot, m and rad")
    goal: list[float] = parameter([5.0, 0.0], "[x, y], m")
    timeout: float = parameter(180.0, "time a trial may take", unit="s", above=0.0)

    def make(self, rng: np.random.Generator, robot: Footprint) -> World:
        """The world as given; nothing in it is random.

        Raises:
            StarnavError: as in `World`, or a polygon is not simple.
        """
        world = World(name="obstacles", **vars(self))
        part_count = len(world.cylinders)
        for k, polygon in enumerate(world.polygons):
            try:
                part_count += len(split_into_convex_parts(polygon))
            except StarnavError as error:
                raise StarnavError(f"Obstacles.polygons[{k}]: {error}") from None
        if part_count > MOST_SHAPES:
            raise StarnavError(
                f"Obstacles has {part_count} cylinders and convex parts of polygons; allowed: at most {MOST_SHAPES}"
            )
        return dataclasses.replace(world, polygons=tuple(map(simplify_outline, world.polygons)))


@dataclass(frozen=True)
class Model:
    """The bodies of a Drake model directives file, an SDF or a URDF on the floor z = 0; start and goal as given."""

    directives: str = parameter(
        "",
        "model directives (.dmd.yaml), an SDF or a URDF file, also as package://...; or the directives, as a list",
        path=True,
    )
    start: list[float] = parameter([0.0, 0.0, 0.0], "[x, y, yaw] of the robot, m and rad")
    goal: list[float] = parameter([], "[x, y], m; it must be given")
    weld: bool = parameter(True, "weld bodies that no joint holds where they stand; false lets them move")

    def make(self, rng: np.random.Generator, robot: Footprint) -> World:
        """The world without its obstacles' footprints: only Drake can read them from the file.

        See `drake_starnav.station.model_world.make_world_with_footprints`.

        Raises:
            StarnavError: there is no such file, it has another ending, or start or goal are not given.
        """
        if "\n" in self.directives:
            name, model = "model", ModelFile("", self.weld, text=self.directives)
        else:
            of_package = "://" in self.directives and not self.directives.startswith(PACKAGE_URI)  # found by Drake
            path = Path(self.directives) if of_package else resolve_path(self.directives)
            allowed_text = f"a {', '.join(FORMATS[:-1])} or {FORMATS[-1]} file"
            if not path.name.endswith(FORMATS):
                raise StarnavError(f"Model.directives is {shown(self.directives)}; allowed: {allowed_text}")
            if not of_package:
                read_bytes(path, f"model {path}", allowed_text)
            model = ModelFile(self.directives if of_package else str(path), self.weld)
            name = path.name.partition(".")[0]
        end_points: dict[str, Any] = {"start": self.start, "goal": self.goal}
        return World(name, model=model, **end_points)
