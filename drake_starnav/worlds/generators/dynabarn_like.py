"""Generated worlds in the form and style of the DynaBARN benchmark: discs that cross an arena."""

import math
from typing import Any

import numpy as np

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
