"""Map revision: regions are cut back or discarded where later observations contradict them.

An obstacle thinner than the distance between two beams is detected only from nearby, inside regions observed from
afar. If the estimated pose drifts, hits of a new scan fall inside old regions, and old hits fall into free space of the
new scan; the new scan is right about the robot's current surroundings.
"""

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.lidar.field_of_view import TURN
from drake_starnav.lidar.outlier_filter import lose_beams
from drake_starnav.planning.roadmap import StarRoadmap
from drake_starnav.surroundings.bearing_hits import measure_half_chords
from drake_starnav.surroundings.margins import Margins
from drake_starnav.surroundings.observation import Observation
from drake_starnav.surroundings.piecewise_cubic import JUMP
from drake_starnav.surroundings.star_region import StarRegion, cut_back, refit_region

CONTRADICTION = 0.8
"""A region with hits of a new scan deeper inside than this is contradicted, in radii of the robot: smaller
contradictions stem from coarse older scans."""
KEPT_SHARE = 0.7
"""A region is discarded if less than this share of its free range remains, summed over all bearings."""
SEEN_THROUGH_SHARE = 0.1
"""A node is discarded if the new scan observed free space at more than this share of its hits."""
FEWEST_HITS = 5
"""A new scan must observe free space at this many of a node's hits to contradict them."""
SAME_RUN = 3.0
"""Neighbouring hits are one surface up to this distance, as a multiple of that between two beams there."""
RUN_BEAMS = 3.0
"""A surface is gone if a new scan sees through a part of it that is at least this many of its beams wide."""


def find_mappable_hits(observation: Observation) -> tuple[np.ndarray, np.ndarray]:
    """Return static hits of an observation: points, shape (k, 2), W, and their half chords, shape (k,), m."""
    scan, hit = observation.scan, observation.scan.mappable_hits
    return scan.points_at(scan.distances, hit, observation.pose), measure_half_chords(scan.distances, scan.beams)[hit]


def measure_share_seen_through(old: Observation, new: Observation, slack: float) -> float:
    """Return the share of an old scan's hits around which a new scan observed free space, by `slack` (m) on all sides.

    Only hits within the new scan's range count; 0 if fewer than FEWEST_HITS of them were seen through.
    """
    free_behind, _ = _measure_free_range(find_mappable_hits(old)[0], new, slack)
    through = np.count_nonzero(free_behind > slack)
    return 0.0 if through < FEWEST_HITS else through / np.count_nonzero(free_behind == free_behind)


@kernel
def _find_shortest_range(beam, distance, ranges, increment, slack, wrap):
    """Return the shortest range among the beams that pass within `slack` of a place at `beam` and `distance`."""
    n = len(ranges)
    out = np.full(len(beam), np.inf)
    for i in range(len(beam)):
        half = min(slack / max(distance[i], slack) / increment, 0.25 * n)
        for k in range(int(math.floor(beam[i] - half)), int(math.ceil(beam[i] + half)) + 1):
            if wrap or 0 <= k < n:
                out[i] = min(out[i], ranges[k % n])
    return out


def forget_contradicted(
    nodes: tuple[Observation, ...], observers: Sequence[Observation], cover_radius: float
) -> tuple[Observation, ...]:
    """Return nodes without the hits that later observations saw through, such as those of a door that has opened.

    Hits go with the run of their neighbours on one surface, so that several beams must have passed where it was: an
    obstacle that beams may miss is kept. Without any change these are `nodes`.

    Args:
        nodes: with their scans, and where these were taken.
        observers: the later observations.
        cover_radius: m; by CONTRADICTION of it, there must be free space around and behind a hit.
    """
    if not nodes:
        return nodes
    hits = [node.scan.mappable_hits for node in nodes]
    hit_counts = [np.count_nonzero(each) for each in hits]
    points = np.concatenate([find_mappable_hits(node)[0] for node in nodes])
    spacing = np.concatenate(
        [node.scan.distances[each] * node.scan.angle_increment for node, each in zip(nodes, hits, strict=True)]
    )
    surface_ends = np.hypot(*np.diff(points, axis=0).T) > SAME_RUN * np.maximum(spacing[1:], spacing[:-1])
    hit_times = np.repeat([node.time for node in nodes], hit_counts)
    is_hit_gone = _find_hits_seen_through(points, hit_times, surface_ends, observers, CONTRADICTION * cover_radius)
    if not is_hit_gone.any():
        return nodes
    gone_hits = np.split(is_hit_gone, np.cumsum(hit_counts)[:-1])
    return tuple(
        dataclasses.replace(node, scan=lose_beams(node.scan, np.flatnonzero(is_hit)[is_gone]))
        if is_gone.any()
        else node
        for node, is_hit, is_gone in zip(nodes, hits, gone_hits, strict=True)
    )


def _find_hits_seen_through(
    points: np.ndarray, hit_times: np.ndarray, surface_ends: np.ndarray, observers: Sequence[Observation], slack: float
) -> np.ndarray:
    """Return which of n hits (n, 2), W, some later observation saw free space around and behind, by `slack`, m.

    Args:
        points, hit_times: of the hits, m and s.
        surface_ends: shape (n - 1,), whether two neighbours lie on different surfaces.
        observers: the observations.
        slack: m.
    """
    is_hit_gone = np.zeros(len(points), bool)
    for observation in observers:
        free_behind, beam = _measure_free_range(points, observation, slack)
        is_seen_through = (free_behind > slack) & (hit_times < observation.time)
        if is_seen_through.any():
            run_indices, run_widths = _measure_runs(
                surface_ends | np.diff(is_seen_through), beam, observation.scan.angle_increment
            )
            is_hit_gone |= is_seen_through & (run_widths >= RUN_BEAMS)[run_indices]
    return is_hit_gone


def _measure_runs(run_ends: np.ndarray, beam: np.ndarray, increment: float) -> tuple[np.ndarray, np.ndarray]:
    """Return which run each of n hits is in, and how many beams of an observer each run is wide.

    Args:
        run_ends: shape (n - 1,), whether a run ends between two neighbours.
        beam: shape (n,), on which of the observer's beams each lies, a real number.
        increment: between two of its beams, rad.
    """
    run_indices = np.cumsum(np.append(False, run_ends))
    beam_steps = np.abs(np.diff(beam))
    beam_steps = np.minimum(beam_steps, TURN / increment - beam_steps)
    is_same_run = run_indices[1:] == run_indices[:-1]
    return run_indices, np.bincount(
        run_indices[1:], np.where(is_same_run, beam_steps, 0.0), minlength=run_indices[-1] + 1
    )


def _measure_free_range(points: np.ndarray, observation: Observation, slack: float) -> tuple[np.ndarray, np.ndarray]:
    """Return how far behind points (n, 2), W, and `slack` beside them an observation saw free space, and their beams.

    The former is NaN for points that are out of its view, m; a beam is a real number.
    """
    scan = observation.scan
    distance, beam = scan.polar(points, observation.pose)
    is_judged = (distance < scan.range_max) & (scan.full_circle | (beam <= len(scan.ranges) - 1))
    free_behind = np.full(len(points), np.nan)
    ranges, step = scan.distances, scan.angle_increment
    free_behind[is_judged] = _find_shortest_range(
        beam[is_judged], distance[is_judged], ranges, step, slack, scan.full_circle
    )
    return free_behind - distance, beam


def find_consistent_regions(
    roadmap: StarRoadmap, observation: Observation, margins: Margins, cover_radius: float
) -> Sequence[StarRegion | None]:
    """Return the nodes' regions without the parts that a new scan contradicts by more than CONTRADICTION.

    Regions are cut back where new hits lie deeper inside them than that. Nodes are discarded (None) if too little of
    them remains or, with `drop_seen_through`, if the new scan saw through their hits. Without any change these are
    `roadmap.regions`.

    Args:
        roadmap: the roadmap before.
        observation: the latest observation.
        margins: of the regions.
        cover_radius: m.
    """
    if not len(roadmap):
        return roadmap.regions
    new_hits = find_mappable_hits(observation)
    regions = list[StarRegion | None](roadmap.regions)
    slack, gap = CONTRADICTION * cover_radius, float(new_hits[1].max(initial=0.0))
    sizes = max(cover_radius + margins.preferred - slack, 0.0), JUMP * cover_radius - slack
    for k in _find_contradicted_regions(roadmap.union, new_hits[0], sizes, gap).tolist():
        region = roadmap.regions[k]
        regions[k] = _cut_back_to_hits(region, *new_hits, cover_radius + region.margin)
    if margins.drop_seen_through:
        reach = roadmap.union.reach + observation.scan.range_max
        is_near = np.hypot(*(roadmap.union.center - observation.pose[:2]).T) <= reach
        for k in np.flatnonzero(is_near).tolist():
            if measure_share_seen_through(roadmap.nodes[k], observation, slack) > SEEN_THROUGH_SHARE:
                regions[k] = None
    is_unchanged = all(new is old for new, old in zip(regions, roadmap.regions, strict=True))
    return roadmap.regions if is_unchanged else regions


def _cut_back_to_hits(region: StarRegion, points: np.ndarray, gaps: np.ndarray, radius: float) -> StarRegion | None:
    """Return the region cut back where hits contradict it by more than CONTRADICTION; None if too little remains."""
    slack = CONTRADICTION * region.radius
    smaller = max(radius - slack, 0.0)
    # the disc is smaller, as a bearing that grazes a hit would lose much of its range at once
    if not (region.free_range - cut_back(region, points, gaps, smaller)).max() > slack:
        return region
    values = cut_back(region, points, gaps, radius)
    return None if values.sum() < KEPT_SHARE * region.free_range.sum() else refit_region(region, values)


@kernel
def _find_contradicted_regions(union, points, sizes, gap):
    """Return the indices of the regions of a union that some points (n, 2), hits, may contradict.

    That is where, at some bearing, a region may reach farther by CONTRADICTION than to a disc about a hit with half
    gaps of at most `gap`; `sizes` are its radius, and by how much a fit is below its samples at most, less
    CONTRADICTION. In m.
    """
    (radius, jump), is_contradicted = sizes, np.zeros(len(union.center), np.bool_)
    half_step = math.pi / union.values.shape[1]
    for k in range(len(is_contradicted)):
        for n in range(len(points)):
            dx, dy = points[n, 0] - union.center[k, 0], points[n, 1] - union.center[k, 1]
            distance = math.sqrt(dx * dx + dy * dy)
            disc = math.sqrt((radius + half_step * distance) ** 2 + gap * gap)
            if distance - disc < union.reach[k] + jump and (
                distance <= disc
                or _reaches_disc(union.values[k], math.atan2(dy, dx) - union.bearing_0[k], distance, disc, jump)
            ):
                is_contradicted[k] = True
                break
    return np.flatnonzero(is_contradicted)


@kernel
def _reaches_disc(values, bearing, distance, disc, jump):
    """Return whether a region's values (M,) with `jump` reach a disc, at a bearing from sample 0 and a distance, m."""
    samples = len(values)
    sample_angle = 2.0 * math.pi / samples
    nearest_sample, sample_width = (
        int(math.floor(bearing / sample_angle + 0.5)),
        int(math.asin(disc / distance) / sample_angle),
    )
    for m in range(nearest_sample - sample_width, nearest_sample + sample_width + 1):
        farthest_range = values[m % samples] + jump
        if farthest_range > distance - disc:
            off_angle = sample_angle * (m - nearest_sample)
            half_chord = math.sqrt(max(disc * disc - (distance * math.sin(off_angle)) ** 2, 0.0))
            if farthest_range > distance * math.cos(off_angle) - half_chord:
                return True
    return False
