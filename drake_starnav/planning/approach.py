"""Places to drive to instead of a goal that is too close to a wall."""

from typing import NamedTuple

import numpy as np

from drake_starnav.planning.grid import HIT_ERROR, Grid

INSIDE_TOLERANCE = 0.2
"""The place lies inside the goal's tolerance by this much, in radii of the robot."""
LINE_CLEARANCE = 0.4
"""Clearance of the line from the place to the goal, in radii: no obstacle stands between them."""


class GoalCandidates(NamedTuple):
    """Where the robot may arrive.

    Attributes:
        goal: where it heads while none of the places is known to be free, shape (2,), W, m.
        places: places within the goal's tolerance and in sight of it, nearest first, shape (k, 2), W, m.
    """

    goal: np.ndarray
    places: np.ndarray


def list_goal_candidates(
    grid: Grid, goal: np.ndarray, tolerance: float, radius: float, margin: float
) -> GoalCandidates:
    """Return the goal if it is clear of known hits; else all suitable places, and the nearest clear one as the goal.

    If no place is clear, the goal is the place farthest from hits.

    Args:
        grid: hits known so far; unknown places count as clear.
        goal: shape (2,), W, m.
        tolerance: a robot this near to the goal has reached it, m.
        radius: of the robot, m.
        margin: that it keeps beyond, m.
    """
    needed_distance, farthest_offset = radius + margin + HIT_ERROR * radius, tolerance - INSIDE_TOLERANCE * radius
    goal_alone = GoalCandidates(goal, goal[None, :])
    if farthest_offset <= 0.0 or grid.distance(goal_alone.places)[0] >= needed_distance:
        return goal_alone
    steps = np.arange(0.0, farthest_offset + 1e-9, min(grid.resolution, farthest_offset))
    steps = np.concatenate((-steps[:0:-1], steps))
    offsets = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    goal_distances = np.hypot(*offsets.T)
    nearest_order = np.argsort(goal_distances, kind="stable")
    places = goal + offsets[nearest_order[goal_distances[nearest_order] <= farthest_offset]]
    goal_lines = goal + np.linspace(0.0, 1.0, 6)[:, None, None] * (places - goal)
    is_seen = (grid.distance(goal_lines.reshape(-1, 2)).reshape(goal_lines.shape[:2]) > LINE_CLEARANCE * radius).all(
        axis=0
    )
    if not is_seen.any():
        return goal_alone
    places = places[is_seen]
    distance = grid.distance(places)
    clear_places = np.flatnonzero(distance >= needed_distance)
    return GoalCandidates(places[clear_places[0] if len(clear_places) else np.argmax(distance)], places)
