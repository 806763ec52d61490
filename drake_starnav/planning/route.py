"""The route: along the one optimistic path, to the goal or to where that path leaves the regions."""

import math
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.geometry.polyline import measure_arc_lengths
from drake_starnav.planning.cost_field import CostField, CostmapParams, compute_cost_to_go
from drake_starnav.planning.frontiers import find_region_frontiers
from drake_starnav.planning.grid import HIT_ERROR, STRIDE, Grid
from drake_starnav.planning.state import PlannerInput, PlannerState, Route
from drake_starnav.planning.string_pulling import pull_string
from drake_starnav.surroundings.region_union import find_covering_region, find_first_departure
from drake_starnav.surroundings.star_region import StarRegion

LENGTH_OUTSIDE = 0.8
"""The optimistic path leaves the regions where it stays outside for this length, in radii of the robot."""
LARGEST_EXIT_SHIFT = 1.2
"""The exit is moved from where the path crosses its frontier by at most this, in radii, towards the frontier's
middle."""
CROSSING_DISTANCE = 1.2
"""The path crosses a frontier that is no farther from it, in radii."""
UNCERTAIN_MARGINS = 3.0
"""Hits may err by this many times the least margin, which allows for the errors of most."""
SEARCH_BORDER = 2.0
"""The optimistic path is searched this far beyond all that is known, in radii: no way is shorter farther out."""
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


def find_route(state: PlannerState, current_region: StarRegion, inputs: PlannerInput) -> Route | None:
    """Return the route along the optimistic path; None if the hits leave no way even if all unknown space were free.

    It ends at the goal if a region contains that; for a goal beside a wall, at the place nearest to it that a region
    contains (see `list_goal_candidates`). Else it ends at the exit: of all frontiers, the one of least cost to come
    and to go.

    Args:
        state: with the roadmap.
        current_region: of the latest scan.
        inputs: where the robot is and shall go, and the parameters.

    Source: in the place of Eq. (6) of the paper, section III-C.2.
    """
    roadmap, position, union = state.roadmap, inputs.position, state.roadmap.union
    tolerance, margin = inputs.goal_tolerance, inputs.margins.preferred
    candidates = list_goal_candidates(roadmap.grid, inputs.goal, tolerance, inputs.cover_radius, margin)
    known_places = np.flatnonzero(
        current_region.as_union.contains(candidates.places) | union.contains(candidates.places)
    )
    goal = candidates.places[known_places[0]] if len(known_places) else candidates.goal
    straight = tuple(position), tuple(goal), 0.0, inputs.cover_radius
    if len(known_places) and (
        find_covering_region(current_region.as_union, *goal, 0.0) >= 0 or find_first_departure(union, *straight) < 0.0
    ):
        return Route(goal[None].copy())
    path = build_cost_field(state, goal, inputs).path(position)
    if not len(path):
        return None
    sight = current_region.as_union if state.is_retrying else union
    path, last, first = _find_exit(
        path, 0.5 * STRIDE * roadmap.grid.resolution, union, LENGTH_OUTSIDE * inputs.cover_radius
    )
    if first < 0:
        return Route(
            pull_string(np.vstack((path, goal)) if len(known_places) else path, position, sight, inputs.cover_radius)
        )
    way, path_beyond = path[: last + 1], path[first:]
    aim = find_frontier_point(state, inputs.cover_radius, path[last], path[first]) if last else None
    if aim is not None and find_first_departure(union, tuple(path[last]), tuple(aim), 0.0, inputs.cover_radius) < 0.0:
        way = np.vstack((way, aim))
    return Route(pull_string(way, position, sight, inputs.cover_radius), np.vstack((way[-1], path[first])), path_beyond)


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


def find_frontier_point(
    state: PlannerState, cover_radius: float, last_inside: np.ndarray, first_outside: np.ndarray
) -> np.ndarray | None:
    """Return the frontier point (2,) of the frontier that the path crosses between two places (2,); None without one.

    It lies as far inside the boundary as its probe lies outside.
    """
    owner = find_covering_region(state.roadmap.union, *last_inside, 0.0)
    frontiers = find_region_frontiers(state.roadmap, cover_radius, owner) if owner >= 0 else []
    crossing = 0.5 * (last_inside + first_outside)
    frontier_distances = [np.hypot(*(frontier.boundary - crossing).T) for frontier in frontiers]
    nearest = [float(each.min()) for each in frontier_distances]
    if not frontiers or min(nearest) > CROSSING_DISTANCE * cover_radius:
        return None
    k = nearest.index(min(nearest))
    boundary, probes = frontiers[k].boundary, frontiers[k].probes
    arc_lengths = measure_arc_lengths(boundary)
    at = arc_lengths[frontier_distances[k].argmin()]
    at += np.clip(0.5 * arc_lengths[-1] - at, -LARGEST_EXIT_SHIFT * cover_radius, LARGEST_EXIT_SHIFT * cover_radius)
    on, out = (np.array([np.interp(at, arc_lengths, side) for side in points.T]) for points in (boundary, probes))
    return 2.0 * on - out


def build_cost_field(state: PlannerState, goal: np.ndarray, inputs: PlannerInput) -> CostField:
    """Return the optimistic cost-to-go over hits and closures, from the goal (2,) to the robot."""
    roadmap, position = state.roadmap, inputs.position
    places = np.vstack((roadmap.grid.bounds, roadmap.union.bounds, goal, position))
    border = SEARCH_BORDER * inputs.cover_radius
    failed_places, uncertainty = roadmap.closures.failed_places, compute_clearance_uncertainty(inputs)
    params = CostmapParams(inputs.cover_radius, failed_places, uncertainty, inputs.outer_radius)
    return compute_cost_to_go(
        roadmap.grid, goal, places.min(axis=0) - border, places.max(axis=0) + border, params, position
    )


def compute_clearance_uncertainty(inputs: PlannerInput) -> float:
    """Return by how much a cell's distance from the hits may be too small, m; less for a robot as small as a cell."""
    cell = inputs.parameters.cell(inputs.cover_radius)
    half_diagonal, most_uncertainty = math.hypot(0.5, 0.5) * cell, inputs.cover_radius - STRIDE * cell
    return max(min(half_diagonal + UNCERTAIN_MARGINS * inputs.margins.least, most_uncertainty), 0.0)


@kernel
def _find_exit(path, half_cell, union, outside_length):
    """Return where a path (k, 2) leaves a union for longer than `outside_length`, m, or ends outside.

    Returns the path, each point moved to a place inside in its cell if there is one, the index of the last one inside,
    or 0, as the robot may stand a little outside, and of the one where the path has left; -1 if it does not.
    """
    path, last, driven_outside = path.copy(), 0, 0.0
    for i in range(len(path)):
        is_inside = False
        for k in range(9):  # the centre, then around it
            turn = 0.25 * math.pi * (k - 1)
            x = path[i, 0] + (half_cell * math.cos(turn) if k else 0.0)
            y = path[i, 1] + (half_cell * math.sin(turn) if k else 0.0)
            if find_covering_region(union, x, y, 0.0) >= 0:
                path[i, 0], path[i, 1], is_inside = x, y, True
                break
        if is_inside:
            last, driven_outside = i, 0.0
        elif i > 0:
            driven_outside += math.hypot(path[i, 0] - path[i - 1, 0], path[i, 1] - path[i - 1, 1])
            if driven_outside >= outside_length or i == len(path) - 1:
                return path, last, i
    return path, last, -1
