"""Write a file of worlds of the DynaBARN benchmark's kind, such as the shipped models/worlds/dynabarn_like.json."""

import argparse
import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from drake_starnav.utils.files import check_writable, write_text

_HALF = 10.0  # m, of the arena's side; it is open towards the start
_WALL = 0.5  # m, thickness
START, GOAL = (11.0, 0.0, 3.14), (-9.0, 0.0)
_MOVING_OBSTACLES = (5, 19)
_SPEEDS = (0.5, 1.95)  # m/s
_TURNS = (1, 4)  # places that an obstacle passes between two sides
_INNER = 9.0  # m, those are at most so far from the middle along x and y


def dynabarn_like(number: int, seed: int) -> tuple[dict[str, Any], dict[str, Any]]:
    """One world of a file and its trajectories; seed and number determine everything.

    Each obstacle enters anywhere on one side, passes some places at its own constant speed, leaves by another side, and
    enters again.

    Args:
        number: of the world.
        seed: of the file.
    """
    rng = np.random.default_rng([seed, number])
    trajectories = {}
    for k in range(rng.integers(*_MOVING_OBSTACLES, endpoint=True)):
        sides = rng.permutation(4)[:2]
        inner = rng.uniform(-_INNER, _INNER, (rng.integers(*_TURNS, endpoint=True), 2))
        places = np.vstack((_at_side(sides[0], rng), inner, _at_side(sides[1], rng))).round(2)
        lengths = np.hypot(*np.diff(places, axis=0).T)
        times = np.concatenate(([0.0], np.cumsum(lengths) / rng.uniform(*_SPEEDS))).round(2)
        keys = np.column_stack((times, places)).tolist()
        trajectories[f"crossing_{number}_{k}"] = {"total": keys[-1][0], "keys": keys}
    walls = [
        ("back_wall", (-_HALF, 0.0), (_WALL, 2.0 * _HALF)),
        ("top_wall", (0.0, _HALF), (2.0 * _HALF, _WALL)),
        ("bottom_wall", (0.0, -_HALF), (2.0 * _HALF, _WALL)),
    ]
    world = {
        "id": number,
        "plugins": list(trajectories),
        "walls": [
            {"name": name, "pose": [*middle, 0.5, 0.0, 0.0, 0.0], "size": [*size, 1.0]} for name, middle, size in walls
        ],
    }
    return world, trajectories


def _at_side(side: int, rng: np.random.Generator) -> np.ndarray:
    """A random place on a side of the arena: right, top, left or bottom."""
    angle = 0.5 * math.pi * side
    outward = np.array([round(math.cos(angle)), round(math.sin(angle))])
    return _HALF * outward + rng.uniform(-_INNER, _INNER) * np.array([-outward[1], outward[0]])


def file_text(count: int, seed: int) -> str:
    """The text of a file with worlds 0 to `count` - 1 and their trajectories, a line for each."""
    meta = {
        "source": f"scripts/maintenance/make_dynabarn_worlds.py --worlds {count} --seed {seed}",
        "units": "metres, radians, seconds",
        "start": list(START),
        "goal": list(GOAL),
    }
    worlds, trajectories = [], []
    for number in range(count):
        world, crossings = dynabarn_like(number, seed)
        worlds.append(json.dumps(world))
        trajectories += [f"{json.dumps(name)}: {json.dumps(crossing)}" for name, crossing in crossings.items()]
    return (
        f'{{"meta": {json.dumps(meta)}, "worlds": [\n' + ",\n".join(worlds) + "\n],"
        '"trajectories": {\n' + ",\n".join(trajectories) + "\n}}\n"
    )


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
