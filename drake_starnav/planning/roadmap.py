"""The star roadmap: regions are nodes, overlaps are edges, and it grows at frontiers. An immutable snapshot."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import field
from functools import cached_property

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.geometry.polyline import around
from drake_starnav.planning.grid import Coverage, Grid
from drake_starnav.planning.impassable import bridge_observed_hits
from drake_starnav.planning.parameters import PlannerParameters
from drake_starnav.surroundings.margins import Margins
from drake_starnav.surroundings.observation import Observation
from drake_starnav.surroundings.region_union import RegionUnion, covers, measure_excess
from drake_starnav.surroundings.star_region import StarRegion, clear_region, unite_regions
from drake_starnav.utils.snapshot import snapshot

CLOSURE_RADIUS = 0.8
"""Radius of a closure where a way failed, in radii of the robot."""
KEEP_OUT_SPACING = 0.2
"""Between the points of a keep-out, in radii of the robot: it does not fit between two of them."""
AREA_BEARINGS = 4
"""A region's area is sampled along one of this many bearings."""
AREA_STEP = 0.4
"""Largest spacing of the samples of a region's area along a bearing, in radii of the robot."""


@snapshot
class ClosedPlaces:
    """Places that are closed to the robot. Immutable.

    Attributes:
        failed_places: shape (k, 2), where ways failed, W, m: nothing is free within
            CLOSURE_RADIUS of one, until all are tried again.
        keep_out_points: by their cause, places of shape (k, 2), W, m, which stay closed: the robot keeps off them as
            off hits.
    """

    failed_places: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    keep_out_points: Mapping[str, np.ndarray] = field(default_factory=dict)

    @cached_property
    def all_keep_outs(self) -> np.ndarray:
        """The points of all keep-outs, shape (k, 2), W, m."""
        return np.vstack((np.zeros((0, 2)), *self.keep_out_points.values()))

    def add_keep_out(self, polygon: np.ndarray, distance: float, cause: str, cover_radius: float) -> "ClosedPlaces":
        """Add points around a polygon (n, 2), W, at a distance, for a robot of a cover radius, m."""
        places = around(polygon, distance, KEEP_OUT_SPACING * cover_radius)
        known_points = self.keep_out_points.get(cause, places[:0])
        return dataclasses.replace(
            self, keep_out_points={**self.keep_out_points, cause: np.vstack((known_points, places))}
        )

    def find_cause_near(self, places: np.ndarray, reach: float) -> str:
        """Return the cause of a keep-out no farther than `reach` from places (n, 2), W, m; empty: there is none."""
        return next(
            (c for c, wall in self.keep_out_points.items() if np.hypot(*(wall[:, None] - places).T).min() <= reach), ""
        )

    def open_part(self, region: StarRegion) -> StarRegion:
        """Return the part of a region that no closure covers; a robot that is in a keep-out already may leave."""
        if self.keep_out_points:
            room = region.radius + region.margin
            wall_distances = np.hypot(*(self.all_keep_outs - region.center).T)
            region = clear_region(
                region,
                self.all_keep_outs[(wall_distances > region.radius) & (wall_distances < region.reach + room)],
                room,
            )
        return clear_region(region, self.failed_places, CLOSURE_RADIUS * region.radius)


NOTHING_CLOSED = ClosedPlaces()


@snapshot
class StarRoadmap:
    """The robot's map, extended scan by scan. Immutable: every change is a new snapshot that shares unchanged parts.

    Its edges and frontiers are derived, never stored; see `frontiers`.

    Attributes:
        grid: distances to the hits of all node scans, of the scans that blocked an optimistic path, and to keep-outs;
            and how many regions cover a cell.
        nodes: what was observed where each is, oldest first; their regions may be smaller than those of their scans.
        union: their regions.
        closures: the places that are closed: where ways failed, and walls that no lidar sees.
    """

    grid: Grid
    nodes: tuple[Observation, ...] = ()
    union: RegionUnion = field(default_factory=RegionUnion.none)
    closures: ClosedPlaces = NOTHING_CLOSED

    def __len__(self) -> int:
        return len(self.nodes)

    @cached_property
    def regions(self) -> tuple[StarRegion, ...]:
        """The nodes' regions."""
        return tuple(node.region for node in self.nodes if node.region is not None)

    @cached_property
    def edges(self) -> np.ndarray:
        """Shape (e, 2), node indices, the older one first, sorted by the newer: one region contains the other's centre.

        A node without such a region has a single edge, to the older node from which it was most likely reached.
        """
        return _find_edges(self.union)

    @staticmethod
    def empty(
        parameters: PlannerParameters,
        cover_radius: float,
        outer_radius: float = 0.0,
        closures: ClosedPlaces = NOTHING_CLOSED,
    ) -> "StarRoadmap":
        """Return a roadmap before the first scan, of a robot with radii as of `PlannerInput`, m, and with keep-outs."""
        grid = Grid.empty(parameters.cell(cover_radius), max(cover_radius, outer_radius))
        return StarRoadmap(grid.add_hits(closures.all_keep_outs), closures=closures)


def add_node(roadmap: StarRoadmap, node: Observation, margins: Margins, cover_radius: float) -> StarRoadmap:
    """Return the roadmap with one more node and its hits.

    Args:
        roadmap: the roadmap before.
        node: with its region.
        margins: of the regions.
        cover_radius: m.
    """
    return append_node(roadmap, node, roadmap.grid.add_hits(bridge_observed_hits(node, margins, cover_radius)))


def append_node(roadmap: StarRoadmap, node: Observation, grid: Grid) -> StarRoadmap:
    """Return the roadmap with one more node, and with a grid that has other hits."""
    assert node.region is not None
    new_region = node.region.as_union
    union = roadmap.union.join_union(new_region)
    empty_region = new_region._replace(values=np.zeros_like(new_region.values))
    grid = grid.count_regions(empty_region, new_region.values, union.bounds)
    return dataclasses.replace(roadmap, grid=grid, nodes=(*roadmap.nodes, node), union=union)


def replace_regions(
    roadmap: StarRoadmap, regions: Sequence[StarRegion | None], margins: Margins, cover_radius: float
) -> StarRoadmap:
    """Return the roadmap with these regions of its nodes (None: dropped).

    It keeps all hits, unless the pose may err: then only those of the nodes' scans, and walls.
    """
    if regions is roadmap.regions:
        return roadmap
    nodes = tuple(
        node if region is node.region else dataclasses.replace(node, region=region)
        for node, region in zip(roadmap.nodes, regions, strict=True)
        if region is not None
    )
    grid = roadmap.grid
    if margins.drop_seen_through:
        grid = rebuild_grid(grid, roadmap.closures, nodes, margins, cover_radius)
    if not nodes:
        return StarRoadmap(dataclasses.replace(grid, coverage=Coverage()), closures=roadmap.closures)
    changed = np.flatnonzero([new is not old for new, old in zip(regions, roadmap.regions, strict=True)])
    changed_regions = roadmap.union.select(changed)
    new_values = np.zeros_like(changed_regions.values)
    for values, k in zip(new_values, changed.tolist(), strict=True):
        region = regions[k]
        if region is not None:
            values[:] = region.boundary.values
    union = unite_regions(region for region in regions if region is not None)
    return StarRoadmap(grid.count_regions(changed_regions, new_values, union.bounds), nodes, union, roadmap.closures)


def refit_regions(roadmap: StarRoadmap, margins: Margins, cover_radius: float) -> StarRoadmap:
    """Return a roadmap of the same scans and hits, with the open part of each scan's region, fitted anew."""
    whole_regions = [node.refit(cover_radius, margins).region for node in roadmap.nodes]
    regions = [roadmap.closures.open_part(region) for region in whole_regions if region is not None]
    return replace_regions(roadmap, regions, margins, cover_radius)


def rebuild_grid(
    grid: Grid, closures: ClosedPlaces, nodes: Sequence[Observation], margins: Margins, cover_radius: float
) -> Grid:
    """Return a grid with no other hits than keep-outs and those of nodes."""
    grid = grid.without_hits().add_hits(closures.all_keep_outs)
    for node in nodes:
        grid = grid.add_hits(bridge_observed_hits(node, margins, cover_radius))
    return grid


@kernel
def _find_edges(union):
    """Run the loop of `StarRoadmap.edges`.

    Without a region that sees it among the older ones, the robot has come from the region that a centre exceeds least.
    """
    center, bearing_0, values = union.center, union.bearing_0, union.values
    edge_ends = [(0, 0)][:0]
    for j in range(len(center)):
        x, y, begin = center[j, 0], center[j, 1], len(edge_ends)
        for i in range(j):
            u, v = center[i, 0], center[i, 1]
            if covers(center, bearing_0, values, i, x, y, 0.0) or covers(center, bearing_0, values, j, u, v, 0.0):
                edge_ends.append((i, j))
        if j and len(edge_ends) == begin:
            i = j - 1 - int(np.argmin(measure_excess(union, x, y)[:j][::-1]))  # of equals the newest
            edge_ends.append((i, j))
    edges = np.empty((len(edge_ends), 2), np.int64)
    for e in range(len(edge_ends)):
        edges[e, 0], edges[e, 1] = edge_ends[e]
    return edges


def measure_uncovered_share(region: StarRegion, others: RegionUnion) -> float:
    """Return the share of a region's area that no other region covers, in [0, 1]; 0 for a region without area."""
    values = region.boundary.values
    chosen = np.arange(0, len(values), AREA_BEARINGS)
    phi = np.minimum(values[chosen], np.roll(values, -1)[chosen])
    count = np.ceil(phi / (AREA_STEP * region.radius)).astype(np.int64)
    ray = np.repeat(np.arange(len(chosen)), count)
    ray_positions = np.arange(len(ray)) - np.repeat(np.cumsum(count) - count, count) + 0.5
    step = phi[ray] / count[ray]
    bearing = region.bearing_0 + 2.0 * math.pi / len(values) * (chosen[ray] + 0.5)
    places = region.center + (ray_positions * step)[:, None] * np.column_stack((np.cos(bearing), np.sin(bearing)))
    area = ray_positions * step * step
    new = area[~others.contains(places)].sum()
    return float(new / area.sum()) if len(ray) else 0.0
