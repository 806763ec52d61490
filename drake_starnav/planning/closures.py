"""Closures: places where a way that looked open has failed. They are the only memory of failure."""

import math

import numpy as np

from drake_starnav.geometry.polyline import measure_arc_lengths, measure_segment_distance
from drake_starnav.planning.grid import HIT_ERROR
from drake_starnav.planning.impassable import find_narrowest_gap
from drake_starnav.planning.map_revision import forget_contradicted
from drake_starnav.planning.roadmap import CLOSURE_RADIUS, add_node, rebuild_grid, refit_regions, replace_regions
from drake_starnav.planning.route import build_cost_field
from drake_starnav.planning.state import EMPTY_PATH, PlannerInput, PlannerState
from drake_starnav.surroundings.erosion import smooth_distances
from drake_starnav.surroundings.scan_averaging import AVERAGED_WITHIN, average_scans
from drake_starnav.surroundings.star_region import clear_region
from drake_starnav.utils.snapshot import replace_fields

CLOSED_AHEAD = 3.2
"""A way that failed is closed at its narrowest place within this distance, in radii of the robot."""
LEAST_CLOSURE_DISTANCE = 1.0
"""A closure is no nearer to the robot than this, in its radii, so that the robot is not in it."""
AVERAGED_SCANS = 16
"""What a way leads past is judged by the mean of this many scans, which nearly removes the bias of the nearest hit, and
by hits that more than half of them confirm."""


def close_path(state: PlannerState, way: np.ndarray, inputs: PlannerInput) -> PlannerState:
    """Return the state with a closure at the narrowest place of a way (k, 2) that failed, and without a path."""
    places, closure_radius = _find_places_to_close(way, inputs), CLOSURE_RADIUS * inputs.cover_radius
    regions = [
        clear_region(region, places, closure_radius)
        if np.hypot(*(places - region.center).T).min() > closure_radius
        else None
        for region in state.roadmap.regions
    ]
    roadmap = replace_regions(state.roadmap, regions, inputs.margins, inputs.cover_radius)
    closures = replace_fields(roadmap.closures, failed_places=np.vstack((roadmap.closures.failed_places, places)))
    route = state.route._replace(path=EMPTY_PATH)
    state = replace_fields(state, roadmap=replace_fields(roadmap, closures=closures), route=route)
    return state if len(roadmap) else add_latest_node(state, inputs)


def reopen_closures(state: PlannerState, inputs: PlannerInput) -> PlannerState:
    """Return the state with closures reopened after no route was found; `state` itself if there is nothing to reopen.

    Where the robot stands in closures, only these are removed, as it has come there. Where it stands in none, or has
    waited for an obstacle, which may have been what closed its ways, all are removed, and `is_retrying` is set: an exit
    whose probe is not seen is no longer closed. Keep-outs stay. Hits that the latest scans saw through are removed, and
    the regions are fitted again.
    """
    failed_places, nodes = state.roadmap.closures.failed_places, state.roadmap.nodes
    lasting_nodes = forget_contradicted(nodes, state.recent_observations, inputs.cover_radius)
    if lasting_nodes is nodes and state.is_retrying and not len(failed_places):
        return state
    has_waited = state.progress.dead_end is not None
    is_reopened = (np.hypot(*(failed_places - inputs.position).T) <= CLOSURE_RADIUS * inputs.cover_radius) | has_waited
    closures = replace_fields(
        state.roadmap.closures, failed_places=failed_places[~is_reopened] if is_reopened.any() else EMPTY_PATH
    )
    roadmap = replace_fields(state.roadmap, closures=closures, nodes=lasting_nodes)
    if lasting_nodes is not nodes:
        grid = rebuild_grid(roadmap.grid, closures, lasting_nodes, inputs.margins, inputs.cover_radius)
        roadmap = replace_fields(roadmap, grid=grid)
    roadmap = refit_regions(roadmap, inputs.margins, inputs.cover_radius)
    state = replace_fields(state, roadmap=roadmap, is_retrying=state.is_retrying or has_waited or not is_reopened.any())
    latest = len(roadmap) > 0 and roadmap.nodes[-1].scan is inputs.observation.scan
    return state if latest else add_latest_node(state, inputs)


def add_latest_node(state: PlannerState, inputs: PlannerInput) -> PlannerState:
    """Return the state with a node at the latest scan, and without a path."""
    observation = inputs.observation
    assert observation.region is not None
    node = replace_fields(observation, region=state.roadmap.closures.open_part(observation.region))
    return replace_fields(
        state,
        roadmap=add_node(state.roadmap, node, inputs.margins, inputs.cover_radius),
        route=state.route._replace(path=EMPTY_PATH),
        progress=state.progress._replace(node_position=inputs.position.copy()),
    )


def find_blocking_keep_outs(state: PlannerState, inputs: PlannerInput) -> str:
    """Return the names of the keep-outs without which there might be a way to the goal; empty: there are none."""
    roadmap, walls = state.roadmap, state.roadmap.closures.keep_out_points

    def is_open(*causes: str) -> bool:
        closures = replace_fields(roadmap.closures, keep_out_points={cause: walls[cause] for cause in causes})
        grid = rebuild_grid(roadmap.grid, closures, roadmap.nodes, inputs.margins, inputs.cover_radius)
        tried_state = replace_fields(state, roadmap=replace_fields(roadmap, grid=grid, closures=closures))
        return len(build_cost_field(tried_state, inputs.goal, inputs).path(inputs.position)) > 0

    if not walls or not is_open() or is_open(*walls):
        return ""
    blocking_causes = [cause for cause in walls if not is_open(cause)]
    return blocking_causes[0] if blocking_causes else " and ".join(walls)


def _find_places_to_close(way: np.ndarray, inputs: PlannerInput) -> np.ndarray:
    """Return where a way (k, 2) on from the robot is narrowest between hits, else a place just ahead; shape (n, 2).

    In a wide gap several places across it are returned, so that no part of it stays open.
    """
    position, scan, margins = inputs.position, inputs.observation.scan, inputs.margins
    radius = inputs.cover_radius
    least_distance = LEAST_CLOSURE_DISTANCE * inputs.cover_radius
    closure_radius = CLOSURE_RADIUS * inputs.cover_radius
    whole_line = np.vstack((position, way))
    near_line = whole_line[
        : 1 + max(int(np.searchsorted(measure_arc_lengths(whole_line)[1:], CLOSED_AHEAD * radius)), 1)
    ]
    hits = scan.points_at(smooth_distances(scan, margins.smoothing_slack), scan.hits, inputs.observation.pose)
    gap = find_narrowest_gap(hits, near_line, 2.0 * (inputs.outer_radius + margins.preferred + HIT_ERROR * radius))
    first_step = whole_line[1] - position
    places = (position + first_step * (least_distance / max(float(np.hypot(*first_step)), 1e-9)))[None]
    if gap is None:
        return places
    gap_width = math.dist(*gap)
    widest_share = max(0.5 * gap_width - radius - 0.5 * closure_radius, 0.0) / gap_width
    shares = np.linspace(
        0.5 - widest_share, 0.5 + widest_share, 1 + math.ceil(2.0 * widest_share * gap_width / closure_radius)
    )
    across = gap[0] + shares[:, None] * (gap[1] - gap[0])
    is_clear = np.hypot(*(across - position).T) >= least_distance
    return across if is_clear.all() else np.vstack((across[is_clear], places))


def find_narrow_gap_hits(state: PlannerState, inputs: PlannerInput) -> np.ndarray:
    """Return what shows that the robot does not fit through a gap ahead which hits seem to close, shape (n, 2), W, m.

    Nothing, shape (0, 2), if nothing does.

    That is where two hits on both sides of the way are nearer to each other than its diameter: the hits around the
    robot and the place between those two.
    """
    hits, way = _find_averaged_hits(state, inputs), np.vstack((inputs.position, state.route.path, state.route.beyond))
    narrow = find_narrowest_gap(hits, way, 2.0 * inputs.cover_radius)
    return EMPTY_PATH if narrow is None else np.vstack((hits, narrow.mean(axis=0)))


def is_probe_occluded(state: PlannerState, viewpoint: np.ndarray, probe: np.ndarray, inputs: PlannerInput) -> bool:
    """Return whether hits show that no straight way leads from a viewpoint (2,) near the robot to the probe (2,).

    In one scan, from beside the viewpoint, noise may hide it behind a gap through which the robot just fits. The least
    margin allows for the error of one scan; of that, a mean has only the share that is left out here.
    """
    hits = _find_averaged_hits(state, inputs)
    hits_ahead = hits[(hits - viewpoint) @ (probe - viewpoint) > 0.0]
    needed_distance = inputs.cover_radius + (1.0 - AVERAGED_SCANS**-0.5) * inputs.margins.least
    return bool((measure_segment_distance(hits_ahead, viewpoint, probe) < needed_distance).any())


def _find_averaged_hits(state: PlannerState, inputs: PlannerInput) -> np.ndarray:
    """Return hits near the robot in the mean of AVERAGED_SCANS scans, shape (n, 2), W, m; none of fewer scans."""
    if len(state.recent_observations) < AVERAGED_SCANS:
        return EMPTY_PATH
    scan, scan_counts = average_scans(
        state.recent_observations, inputs.cover_radius + AVERAGED_WITHIN * inputs.cover_radius
    )
    distance = smooth_distances(scan, inputs.margins.smoothing_slack)
    return scan.points_at(distance, scan.hits & (2 * scan_counts > AVERAGED_SCANS), state.recent_observations[-1].pose)
