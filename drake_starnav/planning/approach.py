"""Where to go for a goal that is too close to a wall to be driven to."""

from typing import NamedTuple

import numpy as np

from drake_starnav.planning.cost_field import HitMemory

INSIDE = 0.05
"""The place lies within the goal's tolerance by this much, m."""
SPARE = 0.03
"""Beyond radius and margin it keeps this much more off known hits, for the grid's cells and the sensor's noise, m."""
SIGHT = 0.1
"""The line from the place to the goal keeps this much off known hits: nothing stands between, m."""


class Approach(NamedTuple):
    """Where the robot may arrive.

    Attributes:
        goal: where it heads for while none of the places is known to be free, shape (2,), W, m.
        places: within the goal's tolerance and in sight of it, the nearest to the goal first, shape (k, 2), W, m.
    """

    goal: np.ndarray
    places: np.ndarray


def approach(hits: HitMemory, goal: np.ndarray, tolerance: float, clearance: float) -> Approach:
    """The goal alone if it is clear of known hits, else all places that serve, and the nearest clear one of them.

    Where none is clear, the robot heads for the one farthest from hits.

    Args:
        hits: known so far; unknown places count as clear.
        goal: shape (2,), W, m.
        tolerance: a robot this near to the goal has reached it, m.
        clearance: that its centre should keep, radius and margin, m.
    """
    needed, reach = clearance + SPARE, tolerance - INSIDE
    alone = Approach(goal, goal[None, :])
    if reach <= 0.0 or hits.distance(alone.places)[0] >= needed:
        return alone
    steps = np.arange(0.0, reach + 1e-9, min(hits.resolution, reach))
    steps = np.concatenate((-steps[:0:-1], steps))
    offsets = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    away = np.hypot(*offsets.T)
    order = np.argsort(away, kind="stable")
    places = goal + offsets[order[away[order] <= reach]]
    line = goal + np.linspace(0.0, 1.0, 6)[:, None, None] * (places - goal)
    seen = (hits.distance(line.reshape(-1, 2)).reshape(line.shape[:2]) > SIGHT).all(axis=0)
    if not seen.any():
        return alone
    places = places[seen]
    distance = hits.distance(places)
    clear = np.flatnonzero(distance >= needed)
    return Approach(places[clear[0] if len(clear) else np.argmax(distance)], places)
