"""Write a file of worlds of the BARN benchmark's kind, such as the shipped models/worlds/barn_like.json."""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import convolve

from drake_starnav.geometry.footprint import disc
from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.utils.files import check_writable, write_text
from drake_starnav.worlds.shortest_path import shortest_path
from drake_starnav.worlds.solvable import Drawn
from drake_starnav.worlds.world import World

_CELL = 0.15  # m; an obstacle fills a cell with a cylinder
_COLUMNS, _ROWS = 30, 30  # of the cave, between two walls that reach back behind the start
_FIRST_ROW = 34  # of the cave; the rows before it hold the start
_FILL = (0.15, 0.35)  # share of cells that are obstacles before smoothing
_SMOOTHINGS = (2, 5)  # at least, and less than this many
_START, _GOAL = (-2.25, 3.0, 1.57), (-2.25, 13.0)


class _Cave(Drawn):
    """A cave between two walls."""

    def draw(self, rng: np.random.Generator) -> World:
        full = rng.random((_COLUMNS, _ROWS)) < rng.uniform(*_FILL)
        for _ in range(rng.integers(*_SMOOTHINGS)):  # isolated obstacles vanish, crowded ones grow
            walled = np.pad(full, ((1, 1), (0, 0)), constant_values=True).astype(int)  # on both sides, not at the ends
            neighbours = convolve(walled, np.ones((3, 3), int), mode="constant")[1:-1] - full
            full = np.where(neighbours >= 5, True, np.where(neighbours <= 1, False, full))
        grid = np.zeros((_COLUMNS, _FIRST_ROW + _ROWS), bool)
        grid[:, _FIRST_ROW:] = full
        grid[[0, -1]] = grid[:, 0] = True
        centers = (np.argwhere(grid) + 0.5) * _CELL - (_COLUMNS * _CELL, 0.0)
        cylinders = np.column_stack((np.round(centers, 3), np.full(len(centers), 0.5 * _CELL)))
        return World(name="barn_like", start=_START, goal=_GOAL, cylinders=cylinders)


def barn_like(number: int, seed: int, robot_radius: float) -> dict[str, Any]:
    """One world as an entry of a file that `Barn` reads; the robot can cross it.

    Args:
        number: of the world; seed and number determine everything.
        seed: of the file.
        robot_radius: m.
    """
    world = _Cave().make(np.random.default_rng([seed, number]), disc(robot_radius))
    shortest = shortest_path(world, robot_radius)
    assert shortest is not None  # solvable with more to spare
    return {
        "id": number,
        "cylinders": world.cylinders.tolist(),
        "start": list(world.start),
        "goal": list(world.goal),
        "path_length_official": round(shortest[0], 4),
    }


def file_text(count: int, seed: int) -> str:
    """The text of a file with worlds 0 to `count` - 1, a line for each, for the robot of the scenario `barn`."""
    radius = load_scenario("barn").robot.radius
    lines = [json.dumps(barn_like(number, seed, radius)) for number in range(count)]
    meta = {
        "source": f"scripts/maintenance/make_barn_worlds.py --worlds {count} --seed {seed}",
        "units": "metres, radians",
        "cylinders": "[x, y, radius] each",
        "start": "[x, y, yaw]",
        "goal": "[x, y]",
        "path_length_official": "of the shortest path of the robot",
    }
    return f'{{"meta": {json.dumps(meta)}, "worlds": [\n' + ",\n".join(lines) + "\n]}\n"


def main() -> None:
    """Write the file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path, help="to write")
    parser.add_argument("--worlds", type=int, default=12, help="how many (default: 12)")
    parser.add_argument("--seed", type=int, default=0, help="of the file (default: 0)")
    options = parser.parse_args()
    check_writable(options.file)
    write_text(options.file, file_text(options.worlds, options.seed))


if __name__ == "__main__":
    main()
