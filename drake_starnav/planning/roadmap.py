"""The star roadmap: regions are nodes, overlaps are edges, and it grows at frontiers. An immutable snapshot."""

import dataclasses
import math
from collections.abc import Iterable
from dataclasses import field

import numpy as np
from numba import njit

from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.planning.distance_grid import DistanceGrid, distances
from drake_starnav.planning.edge_coverage import EdgeCoverage, with_newest
from drake_starnav.planning.frontiers import PROBE_DISTANCE, PROBE_REACHED, Frontiers, edge_frontiers
from drake_starnav.planning.impassable import impassable_points
from drake_starnav.planning.parameters import PlannerParameters
from drake_starnav.planning.roadmap_edges import revised_edges
from drake_starnav.regions.margins import Margins
from drake_starnav.regions.region_index import indexed
from drake_starnav.regions.region_union import RegionUnion, covers, newest_cover
from drake_starnav.regions.star_region import StarRegion, scan_region, united
from drake_starnav.utils.shared_rows import SharedRows
from drake_starnav.utils.snapshot import snapshot

STANDING_THERE = 0.12
"""A frontier nearer than this to the newest node is at the robot's own position, m."""
AREA_BEARINGS = 4
"""A region's area is sampled along one of this many bearings."""
AREA_STEP = 0.1
"""Largest spacing of the samples of a region's area along a bearing, m."""
COVER_SLACK = PROBE_REACHED * PROBE_DISTANCE
"""A probe this far beyond a region's boundary counts as covered, m."""
PROBE_SLACK = 0.04
"""A probe nearer to a hit than the robot's radius minus this leads nowhere, m."""


@snapshot
class StarRoadmap:
    """The robot's map, extended scan by scan. Immutable: every change is a new snapshot that shares unchanged parts.

    Attributes:
        hits: distances to the hits of all node scans and of the scans that blocked an optimistic path.
        regions: one per node, oldest first.
        union: the same regions.
        rows: the memory of the union, which roadmaps share that extend one another.
        scans: per node, the scan and the sensor's pose (x, y, yaw) in W it was made from.
        edges: shape (e, 2), node indices; one of the two regions contains the other's centre. A node without such a
            region has a single edge, to the older node from which it was most likely reached.
        lengths: shape (e,), m.
        frontiers: where unknown space may be entered.
        blacklisted_targets: shape (k, 3), discs (x, y, radius) around targets that led nowhere; frontiers inside one
            are discarded.
        blacklisted_probes: shape (k, 2), probes of these targets; the cost-to-go treats narrow space around them as
            closed.
        closed_places: shape (c, 2), the same where the robot would not fit even without a margin.
        inspection_points: shape (v, 2), places from which a target was inspected without seeing past it, but kept.
        stall_points: shape (b, 2), places in front of which the robot stalled: no region lets it touch one, and they
            are obstacles for the cost-to-go.
        coverage: of the edge frontiers of all nodes.
    """

    hits: DistanceGrid
    regions: tuple[StarRegion, ...] = ()
    union: RegionUnion = field(default_factory=RegionUnion.none)
    rows: SharedRows = field(default_factory=lambda: SharedRows((), 0), compare=False)
    scans: tuple[tuple[LaserScan, np.ndarray], ...] = ()
    edges: np.ndarray = field(default_factory=lambda: np.zeros((0, 2), np.int64))
    lengths: np.ndarray = field(default_factory=lambda: np.zeros(0))
    frontiers: Frontiers = field(default_factory=Frontiers.none)
    blacklisted_targets: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    blacklisted_probes: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    closed_places: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    inspection_points: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    stall_points: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    coverage: EdgeCoverage = field(default_factory=EdgeCoverage.none)

    def __len__(self) -> int:
        return len(self.regions)

    @staticmethod
    def empty(parameters: PlannerParameters, robot_radius: float) -> "StarRoadmap":
        """A roadmap before the first scan."""
        return StarRoadmap(DistanceGrid.empty(parameters.grid_resolution, robot_radius))


def extended(
    roadmap: StarRoadmap,
    region: StarRegion,
    scan: LaserScan,
    pose: np.ndarray,
    margins: Margins,
    robot_radius: float,
    stamp: bool = True,
) -> StarRoadmap:
    """The roadmap with one more node.

    Args:
        roadmap: the roadmap before.
        region: the new node's region, made from `scan`.
        scan: in the sensor frame S at the robot's centre.
        pose: (x, y, yaw) of S in W when the scan was taken.
        margins: of the regions.
        robot_radius: m.
        stamp: whether to add the scan's hits to the distance grid.
    """
    hits = roadmap.hits
    if stamp:
        hits = hits.stamped(impassable_points(scan, pose, margins, robot_radius))
    grown = with_node(roadmap, region, scan, pose, hits)
    rows = edge_rows(region, hits, robot_radius)
    coverage = with_newest(roadmap.coverage, rows, grown.union, COVER_SLACK)
    old = roadmap.frontiers
    frontiers = _grown_frontiers(
        (old.stand, old.probe, old.owner), coverage.arrays, _bars(grown, robot_radius), grown.union, COVER_SLACK
    )
    return dataclasses.replace(grown, frontiers=Frontiers(*frontiers), coverage=coverage)


def edge_rows(region: StarRegion, hits: DistanceGrid, robot_radius: float) -> np.ndarray:
    """Stands and probes of a region's edge frontiers that are not at a hit, shape (n, 4), W, m."""
    edges = edge_frontiers(region, 0)
    return np.hstack((edges.stand, edges.probe))[hits.distance(edges.probe) > robot_radius - PROBE_SLACK]


def with_node(
    roadmap: StarRoadmap, region: StarRegion, scan: LaserScan, pose: np.ndarray, hits: DistanceGrid
) -> StarRoadmap:
    """The roadmap with one more node and its edges, other hits and the same frontiers; arguments as for `extended`."""
    known = len(roadmap)
    rows = roadmap.rows.extended(known, 1, region.row) if known else SharedRows(united((region,)).rows, 1)
    union = indexed(RegionUnion(*rows.in_use), roadmap.union, np.array([known]))
    numbers, before = np.arange(known + 1), (roadmap.edges, roadmap.lengths)
    edges, lengths = revised_edges(before, roadmap.union.center, numbers[:-1], numbers == known, union)
    return dataclasses.replace(
        roadmap,
        regions=(*roadmap.regions, region),
        union=union,
        rows=rows,
        scans=(*roadmap.scans, (scan, np.array(pose, dtype=float))),
        edges=edges,
        lengths=lengths,
        hits=hits,
    )


def with_nodes(
    roadmap: StarRoadmap,
    nodes: Iterable[tuple[StarRegion, LaserScan, np.ndarray]],
    margins: Margins,
    robot_radius: float,
    *,
    stamp: bool,
) -> StarRoadmap:
    """The roadmap extended by nodes (region, scan, pose) in turn; arguments as for `extended`."""
    for region, scan, pose in nodes:
        roadmap = extended(roadmap, region, scan, pose, margins, robot_radius, stamp)
    return roadmap


def without_nodes(roadmap: StarRoadmap) -> StarRoadmap:
    """The roadmap without nodes and frontiers; it keeps its hits, and its retired, inspected and blocked places."""
    return StarRoadmap(
        roadmap.hits,
        blacklisted_targets=roadmap.blacklisted_targets,
        blacklisted_probes=roadmap.blacklisted_probes,
        closed_places=roadmap.closed_places,
        inspection_points=roadmap.inspection_points,
        stall_points=roadmap.stall_points,
    )


def blacklist_target(roadmap: StarRoadmap, place: np.ndarray, radius: float, probe: np.ndarray) -> StarRoadmap:
    """The roadmap without frontiers within `radius` (m) of a place (2,) in W, and with a probe (2,) closed."""
    keep = np.hypot(*(roadmap.frontiers.stand - place).T) > radius
    return dataclasses.replace(
        roadmap,
        frontiers=roadmap.frontiers.where(keep),
        blacklisted_targets=np.vstack((roadmap.blacklisted_targets, [[place[0], place[1], radius]])),
        blacklisted_probes=np.vstack((roadmap.blacklisted_probes, probe)),
    )


def rebuilt(roadmap: StarRoadmap, margins: Margins, robot_radius: float) -> StarRoadmap:
    """A roadmap of the same scans, in which nothing was tried in vain but what is closed for good."""
    empty = StarRoadmap(roadmap.hits, closed_places=roadmap.closed_places)
    nodes = ((scan_region(scan, pose, robot_radius, margins), scan, pose) for scan, pose in roadmap.scans)
    return with_nodes(empty, nodes, margins, robot_radius, stamp=False)


def uncovered_share(region: StarRegion, others: RegionUnion) -> float:
    """The share of a region's area that no other region covers, in [0, 1]; 0 for a region without area."""
    return float(_uncovered_share(region.alone, others))


def enterable(frontiers: Frontiers, roadmap: StarRoadmap, robot_radius: float) -> np.ndarray:
    """Frontiers that are not at the newest node, in a retired place, or at a hit or blocked place; shape (n,)."""
    return _enterable(frontiers.stand, frontiers.probe, _bars(roadmap, robot_radius))


def _bars(roadmap: StarRoadmap, robot_radius: float) -> tuple:
    """What bars frontiers, for compiled loops."""
    places = roadmap.stall_points, roadmap.blacklisted_targets
    return roadmap.union.center[-1], roadmap.hits.arrays, *places, robot_radius


@njit(cache=True)
def _enterable(stand, probe, bars):
    """The loop of `enterable`."""
    newest, grid, stall_points, blacklisted, robot_radius = bars
    out = np.empty(len(stand), np.bool_)
    for i in range(len(stand)):
        x, y = stand[i, 0], stand[i, 1]
        out[i] = math.hypot(x - newest[0], y - newest[1]) > STANDING_THERE
        for k in range(len(blacklisted)):
            out[i] &= math.hypot(x - blacklisted[k, 0], y - blacklisted[k, 1]) > blacklisted[k, 2]
        x, y = probe[i, 0], probe[i, 1]
        for k in range(len(stall_points)):
            out[i] &= math.hypot(x - stall_points[k, 0], y - stall_points[k, 1]) > robot_radius
    away = distances(grid, probe)
    for i in range(len(stand)):
        out[i] &= away[i] > robot_radius - PROBE_SLACK
    return out


@njit(cache=True)
def _grown_frontiers(old, coverage, bars, union, slack):
    """Stands, probes and owners of the old frontiers that the newest region does not cover, and of its own open ones.

    Only those that are `enterable`.
    """
    old_stand, old_probe, old_owner = old
    center, bearing_0, values = union.center, union.bearing_0, union.values
    (rows, row_owner, _, is_open), newest = coverage, len(center) - 1
    first = len(is_open)
    while first > 0 and row_owner[is_open[first - 1]] == newest:
        first -= 1
    most = len(old_owner) + len(is_open) - first
    stand, probe, owner = np.empty((most, 2)), np.empty((most, 2)), np.empty(most, np.int64)
    n = 0
    for i in range(len(old_owner)):
        x, y = old_probe[i, 0], old_probe[i, 1]
        if not covers(center, bearing_0, values, newest, x, y, slack):
            stand[n, 0], stand[n, 1], probe[n, 0], probe[n, 1] = old_stand[i, 0], old_stand[i, 1], x, y
            owner[n] = old_owner[i]
            n += 1
    for k in is_open[first:]:
        stand[n, 0], stand[n, 1], probe[n, 0], probe[n, 1] = rows[k, 0], rows[k, 1], rows[k, 2], rows[k, 3]
        owner[n] = newest
        n += 1
    keep = _enterable(stand[:n], probe[:n], bars)
    return stand[:n][keep], probe[:n][keep], owner[:n][keep]


@njit(cache=True)
def _uncovered_share(own, others):
    """`uncovered_share` of a union of one region and a union."""
    center, bearing_0, values = others.center, others.bearing_0, others.values
    marks, corner, bounds = others.marks, others.corner, own.values[0]
    samples = len(bounds)
    area = new = 0.0
    last = -1
    for i in range(0, samples, AREA_BEARINGS):
        bearing = own.bearing_0[0] + 2.0 * math.pi / samples * (i + 0.5)
        ux, uy = math.cos(bearing), math.sin(bearing)
        phi = min(bounds[i], bounds[i + 1 if i + 1 < samples else 0])
        count = int(math.ceil(phi / AREA_STEP))
        for k in range(count):
            distance = (k + 0.5) * phi / count
            piece = distance * phi / count
            area += piece
            x, y = own.center[0, 0] + distance * ux, own.center[0, 1] + distance * uy
            if last < 0 or not covers(center, bearing_0, values, last, x, y, 0.0):
                last = newest_cover(center, bearing_0, values, marks, corner, (x, y), 0.0)
            if last < 0:
                new += piece
    return new / area if area > 0.0 else 0.0
