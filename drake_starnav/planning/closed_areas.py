"""Areas that the robot must stay out of, on the planner's map: walls that no lidar sees."""

import dataclasses
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.polyline import subdivided
from drake_starnav.planning.cost_field import Terrain, cost_to_go
from drake_starnav.planning.distance_grid import DistanceGrid
from drake_starnav.planning.impassable import impassable_points
from drake_starnav.planning.state import PlannerState
from drake_starnav.surroundings.margins import Margins
from drake_starnav.surroundings.observation import Observation
from drake_starnav.surroundings.star_region import clear_of

SPACING = 0.2
"""Between points on the border of an area, in radii of the robot: it does not fit between two of them."""
AROUND = 8.0
"""How far beyond all hits, areas, robot and goal a way is looked for, in radii of the robot."""


class ClosedArea(NamedTuple):
    """An area that is closed to the robot.

    Attributes:
        name: in messages.
        border: points on it, shape (n, 2), W, m.
        margin: that the robot keeps beyond its radius, m.
    """

    name: str
    border: np.ndarray
    margin: float


def closed_area(name: str, polygon: np.ndarray, margin: float, robot_radius: float) -> ClosedArea:
    """An area by the corners of a polygon, shape (n, 2), W, m, for a robot of a narrow radius, m."""
    border = subdivided(np.vstack((polygon, polygon[:1])), SPACING * robot_radius)[:-1]
    return ClosedArea(name, border, margin)


def mapped(state: PlannerState, areas: Sequence[ClosedArea]) -> PlannerState:
    """The state with the areas' borders among its hits; they are lost where the map is made anew."""
    hits = state.roadmap.hits
    for area in areas:
        if hits.distance(area.border).max() > hits.resolution:
            hits = hits.stamped(area.border)
    if hits is state.roadmap.hits:
        return state
    return dataclasses.replace(state, roadmap=dataclasses.replace(state.roadmap, hits=hits))


def kept_clear(seen: Observation, areas: Sequence[ClosedArea], robot_radius: float) -> Observation:
    """An observation whose region keeps off the areas; a robot that is too near to a border already may leave."""
    region = seen.region
    if region is None:
        return seen
    for area in areas:
        room = robot_radius + max(area.margin, region.margin)
        away = np.hypot(*(area.border - region.center).T)
        near = (away < region.reach + room) & (away > room)
        region = clear_of(region, area.border[near], room)
    return seen if region is seen.region else dataclasses.replace(seen, region=region)


def closing(
    state: PlannerState, areas: Sequence[ClosedArea], ends: np.ndarray, margins: Margins, robot_radius: float
) -> str:
    """The name of the area without which a way from start to goal, `ends` (2, 2) in W, might be left; or empty."""
    nodes = [impassable_points(node, margins, robot_radius) for node in state.roadmap.nodes]
    seen = np.vstack((np.zeros((0, 2)), *nodes))
    around = np.vstack((seen, ends, *(area.border for area in areas)))
    border = AROUND * robot_radius
    low, high = around.min(axis=0) - border, around.max(axis=0) + border

    def is_open(points: np.ndarray) -> bool:
        grid = DistanceGrid.empty(state.roadmap.hits.resolution, robot_radius).stamped(points)
        return len(cost_to_go(grid, ends[1], low, high, Terrain(robot_radius), ends[0]).path(ends[0])) > 0

    if not areas or not is_open(seen):
        return ""
    alone = [area.name for area in areas if not is_open(np.vstack((seen, area.border)))]
    return alone[0] if alone else " and ".join(area.name for area in areas)
