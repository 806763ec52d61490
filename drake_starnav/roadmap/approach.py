"""Where to go for a goal that is too close to a wall to be driven to."""

import numpy as np

from drake_starnav.roadmap.hit_memory import HitMemory
from drake_starnav.roadmap.state import PlannerInput

INSIDE = 0.05
"""The place lies within the goal's tolerance by this much, m."""
SPARE = 0.03
"""Beyond radius and margin it keeps this much more off known hits, for the grid's cells and the sensor's noise, m."""
SIGHT = 0.1
"""The line from the place to the goal keeps this much off known hits: nothing stands between, m."""


def approach(hits: HitMemory, now: PlannerInput) -> np.ndarray:
    """The goal if it is free of known hits, else the nearest free place within its tolerance that sees it; shape (2,).

    Where no such place is free, the one with most clearance.

    Args:
        hits: known so far; unknown places count as free.
        now: goal, goal_tolerance, robot_radius, margin.
    """
    needed = now.robot_radius + now.parameters.margin + SPARE
    reach = now.goal_tolerance - INSIDE
    if reach <= 0.0 or hits.distance(now.goal[None, :])[0] >= needed:
        return now.goal
    steps = np.arange(-reach, reach + 1e-9, min(hits.resolution, reach))
    offsets = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    away = np.hypot(*offsets.T)
    places = now.goal + offsets[away <= reach]
    away = away[away <= reach]
    line = now.goal + np.linspace(0.0, 1.0, 6)[:, None, None] * (places - now.goal)
    seen = (hits.distance(line.reshape(-1, 2)).reshape(line.shape[:2]) > SIGHT).all(axis=0)
    clearance = np.where(seen, hits.distance(places), -np.inf)
    if not seen.any():
        return now.goal
    free = clearance >= needed
    return places[np.argmin(np.where(free, away, np.inf))] if free.any() else places[np.argmax(clearance)]
