"""Functions that take the place of others in an ablation, and a pool whose workers use them.

A name says where a function is looked up by its caller. Compiled functions do not look anything up: where one calls
what is to be replaced, it is itself replaced by the Python that it is compiled from.
"""

import dataclasses
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor, Future
from contextlib import AbstractContextManager, ExitStack, contextmanager
from typing import Any
from unittest.mock import patch

import numpy as np

from drake_starnav.baselines.paper.control import modulated_vector
from drake_starnav.baselines.paper.frontiers import frontier_points
from drake_starnav.baselines.paper.perception import sight_range
from drake_starnav.control.modulation import SIGMA
from drake_starnav.control.motion import Actuation
from drake_starnav.control.path_following import _followed, guided
from drake_starnav.control.shield import ramped_twist
from drake_starnav.evaluation.workers import Pool
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.planning import PlannerInput, PlannerState, StarRoadmap
from drake_starnav.planning.cost_field import CostField
from drake_starnav.planning.frontiers import PROBE_DISTANCE, Frontiers, edge_frontiers
from drake_starnav.planning.map_revision import revised
from drake_starnav.planning.roadmap import extended
from drake_starnav.planning.search import Route, find_route, optimistic_cost
from drake_starnav.regions import Margins, Observation, StarRegion
from drake_starnav.regions.erosion import smoothed_distances
from drake_starnav.regions.piecewise_cubic import adaptive_fit
from drake_starnav.regions.region_union import RegionUnion
from drake_starnav.regions.star_region import fit_region
from scripts.experiments.ablate_segments import fit_equal

Replaced = Mapping[str, Any]
"""By dotted name, what takes a function's place."""
SEGMENTS = 16
"""Number of segments of equal length."""
WAY_POINT_REACHED = 0.25
"""A node this near is reached where the path runs over the nodes, m."""


def run_replaced(replaced: Replaced, function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a function while others are replaced."""
    with ExitStack() as stack:
        for name, value in replaced.items():
            stack.enter_context(patch(name, value))
        return function(*arguments)


def replacing_pool(pool: Pool, replaced: Replaced) -> Pool:
    """A pool whose workers run each trial with functions replaced."""
    return Pool(lambda: _replacing(pool.make_executor(), replaced), pool.in_flight)


@contextmanager
def _replacing(made: AbstractContextManager[Executor], replaced: Replaced) -> Iterator[Executor]:
    with made as executor:
        yield _ReplacingExecutor(executor, replaced)


class _ReplacingExecutor(Executor):
    """Submits each call with functions replaced."""

    def __init__(self, executor: Executor, replaced: Replaced) -> None:
        self._executor, self._replaced = executor, replaced

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **named: Any) -> Future[Any]:
        return self._executor.submit(run_replaced, dict(self._replaced), function, *arguments, **named)


def interpreted_followed(*arguments: Any) -> float:
    """For `path_following._followed`: not compiled."""
    return _followed.py_func(*arguments)


def interpreted_guided(*arguments: Any) -> tuple:
    """For `path_following.guided`: not compiled."""
    return guided.py_func(*arguments)


def same_direction(x: float, y: float, ux: float, uy: float, *others: Any) -> tuple[float, float]:
    """For functions of a position or a guiding vector, and a direction, which stays as it is."""
    return ux, uy


def first_argument(first: Any, *others: Any) -> Any:
    """For functions of a state, which stays as it is, or of a path."""
    return first


def nothing(*arguments: Any) -> None:
    """For functions that may find nothing."""
    return


def uncertified_twist(
    pose: np.ndarray, twist: np.ndarray, desired: np.ndarray, certificates: tuple, actuation: Actuation
) -> tuple[np.ndarray, bool]:
    """For `shielded`: whatever is desired, ramped."""
    return ramped_twist(twist, desired, actuation), True


def shortened_region(scan: LaserScan, pose: np.ndarray, radius: float, margins: Margins, *others: Any) -> StarRegion:
    """For `scan_region`: ranges less the radius."""
    distance = smoothed_distances(scan, margins.smoothing_slack)
    profile = sight_range(scan, distance, radius=radius + margins.preferred)._replace(margin=margins.preferred)
    return fit_region(profile, pose[:2], float(pose[2]) + scan.angle_min)


def two_sided_fit(samples: np.ndarray, tolerance: float, one_sided: bool) -> tuple:
    """For `adaptive_fit`: cubics through the samples."""
    return adaptive_fit(samples, tolerance, False)


def equal_segments(samples: np.ndarray, tolerance: float, one_sided: bool) -> tuple:
    """For `adaptive_fit`: SEGMENTS segments of equal length."""
    fit = fit_equal(samples, SEGMENTS, one_sided)
    return fit.starts, fit.values, fit.slopes


def _frontiers_at_clusters(node: Observation) -> AbstractContextManager:
    """For `edge_frontiers` while a node is added: its own between clusters of hits."""

    def clusters(region: StarRegion, owner: int) -> Frontiers:
        if region is not node.region:
            return edge_frontiers(region, owner)
        points = frontier_points(region, node.scan, node.pose)
        away = points - region.center
        probe = points + PROBE_DISTANCE * away / np.hypot(*away.T)[:, None]
        return Frontiers(points, probe, np.full(len(points), owner))

    return patch("drake_starnav.planning.roadmap.edge_frontiers", clusters)


def extended_at_clusters(roadmap: StarRoadmap, node: Observation, *others: Any) -> StarRoadmap:
    """For `extended`: frontiers between clusters of hits."""
    with _frontiers_at_clusters(node):
        return extended(roadmap, node, *others)


def revised_at_clusters(
    roadmap: StarRoadmap, regions: Any, margins: Margins, robot_radius: float, news: tuple[Observation]
) -> StarRoadmap:
    """For `revised`: frontiers of the new node between clusters of hits."""
    with _frontiers_at_clusters(news[0]):
        return revised(roadmap, regions, margins, robot_radius, news)


def full_cost(
    roadmap: StarRoadmap, inputs: PlannerInput, cost_to_come: np.ndarray, at_robot: bool = True, doubting: bool = False
) -> CostField:
    """For `optimistic_cost`: exact at all frontiers, not only where they are cheaper than a virtual one."""
    return optimistic_cost(roadmap, inputs, cost_to_come, False, doubting)


def searched_once(state: PlannerState, region: StarRegion, inputs: PlannerInput) -> tuple[Route | None, PlannerState]:
    """For `planner._searched`: what was tried in vain stays closed."""
    current = None if state.target is None else state.target[0]
    return find_route(state.roadmap, region, inputs, current), state


def route_without_bonus(
    roadmap: StarRoadmap, here: StarRegion, inputs: PlannerInput, *current: Any, **named: Any
) -> Any:
    """For `find_route`: the current target has no bonus."""
    return find_route(roadmap, here, inputs, **named)


def straight_estimates(field: Any, frontiers: Frontiers, goal: np.ndarray) -> np.ndarray:
    """For `estimates`: the straight line to the goal."""
    return np.hypot(*(frontiers.probe - goal).T)


def nodes_ahead(roadmap: StarRoadmap, path: np.ndarray, position: np.ndarray) -> np.ndarray:
    """For `_path_ahead`: way points are driven to."""
    while len(path) > 1 and np.hypot(*(path[0] - position)) < WAY_POINT_REACHED:
        path = path[1:]
    return path


def along_nodes(state: PlannerState, check: Any, position: np.ndarray) -> PlannerState:
    """For `_along_path`: way points are driven to, whatever is in sight."""
    return dataclasses.replace(state, path=nodes_ahead(state.roadmap, state.path, position))


def paper_direction(x: float, y: float, ux: float, uy: float, regions: RegionUnion, _radius: float) -> np.ndarray:
    """For `modulated_direction`: the paper's sum, normalised."""
    vector = modulated_vector(np.array((x, y)), np.array((ux, uy)), regions, SIGMA)
    length = np.hypot(*vector)
    return vector / length if length > 1e-9 else np.array((ux, uy))
