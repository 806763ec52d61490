"""A world from a file of Drake's model formats."""

import os
from dataclasses import dataclass

import numpy as np

from drake_starnav.errors import StarnavError, shown
from drake_starnav.parameters import parameter
from drake_starnav.utils.resources import resolve_path
from drake_starnav.worlds.formats.listings import check_ends
from drake_starnav.worlds.world import ModelFile, World

FORMATS = (".dmd.yaml", ".sdf", ".world", ".urdf")


@dataclass(frozen=True)
class Model:
    """The bodies of a Drake model directives file, an SDF or a URDF on the floor z = 0; start and goal as given."""

    directives: str = parameter(
        "", "model directives (.dmd.yaml), an SDF or a URDF file; or the directives themselves, as a list", path=True
    )
    start: list[float] = parameter([0.0, 0.0, 0.0], "[x, y, yaw] of the robot, m and rad")
    goal: list[float] = parameter([], "[x, y], m; it must be given")
    weld: bool = parameter(True, "weld bodies that no joint holds where they stand; false lets them move")

    def make(self, rng: np.random.Generator, robot_radius: float) -> World:
        """The world without its obstacles' footprints: only Drake can read them from the file.

        See `drake_starnav.station.model_world.make_world_with_footprints`.

        Raises:
            StarnavError: there is no such file, it has another ending, or start or goal are not given.
        """
        start, goal = check_ends(self.start, self.goal, "Model.")
        if "\n" in self.directives:
            name, model = "model", ModelFile("", self.weld, text=self.directives)
        else:
            path = resolve_path(self.directives)
            allowed = f"allowed: a {', '.join(FORMATS[:-1])} or {FORMATS[-1]} file"
            if not path.name.endswith(FORMATS):
                raise StarnavError(f"Model.directives is {shown(self.directives)}; {allowed}")
            if not os.path.isfile(path):
                raise StarnavError(f"model {path}: no such file; {allowed}")
            name, model = path.name.partition(".")[0], ModelFile(str(path), self.weld)
        return World(name=name, start=start, goal=goal, model=model)
