"""The star roadmap: regions are nodes, overlaps are edges, and it grows at frontiers. An immutable snapshot."""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import field
from functools import cached_property

import numpy as np
from numba import njit

from drake_starnav.planning.distance_grid import HIT_ERROR, DistanceGrid
from drake_starnav.planning.frontiers import ARRIVAL_DISTANCE, PROBE_DISTANCE, PROBE_REACHED, Frontiers, edge_frontiers
from drake_starnav.planning.impassable import impassable_points
from drake_starnav.planning.parameters import PlannerParameters
from drake_starnav.regions.margins import Margins
from drake_starnav.regions.observation import Observation
from drake_starnav.regions.region_index import indexed
from drake_starnav.regions.region_union import CELL, WORD, RegionUnion, covers, excess
from drake_starnav.regions.star_region import StarRegion, united
from drake_starnav.utils.snapshot import snapshot

AREA_BEARINGS = 4
"""A region's area is sampled along one of this many bearings."""
AREA_STEP = 0.1
"""Largest spacing of the samples of a region's area along a bearing, m."""
COVER_SLACK = PROBE_REACHED * PROBE_DISTANCE
"""A probe this far beyond a region's boundary counts as covered, m."""


@snapshot
class StarRoadmap:
    """The robot's map, extended scan by scan. Immutable: every change is a new snapshot that shares unchanged parts.

    Attributes:
        hits: distances to the hits of all node scans and of the scans that blocked an optimistic path.
        nodes: what was observed where each is, oldest first; their regions may be smaller than those of their scans.
        union: their regions.
        edges: shape (e, 2), node indices; one of the two regions contains the other's centre. A node without such a
            region has a single edge, to the older node from which it was most likely reached.
        lengths: shape (e,), m.
        frontiers: where unknown space may be entered.
        blacklisted_targets: shape (k, 3), discs (x, y, radius) around targets that led nowhere; frontiers inside one
            are discarded.
        blacklisted_probes: shape (k, 2), probes of these targets; the cost-to-go treats narrow space around them as
            closed.
        inspection_points: shape (v, 2), places from which a target was inspected without seeing past it, but kept.
        stall_points: shape (b, 2), places in front of which the robot stalled: no region lets it touch one, and they
            are obstacles for the cost-to-go.
        edge_frontiers: of all nodes, m of them sorted by node, covered ones too, except those at hits.
        covers: shape (m,), index of a region that covers each one's probe, or -1.
    """

    hits: DistanceGrid
    nodes: tuple[Observation, ...] = ()
    union: RegionUnion = field(default_factory=RegionUnion.none)
    edges: np.ndarray = field(default_factory=lambda: np.zeros((0, 2), np.int64))
    lengths: np.ndarray = field(default_factory=lambda: np.zeros(0))
    frontiers: Frontiers = field(default_factory=Frontiers.none)
    blacklisted_targets: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    blacklisted_probes: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    inspection_points: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    stall_points: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    edge_frontiers: Frontiers = field(default_factory=Frontiers.none)
    covers: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))

    def __len__(self) -> int:
        return len(self.nodes)

    @cached_property
    def regions(self) -> tuple[StarRegion, ...]:
        """Of the nodes."""
        return tuple(node.region for node in self.nodes if node.region is not None)

    @staticmethod
    def empty(parameters: PlannerParameters, robot_radius: float) -> "StarRoadmap":
        """A roadmap before the first scan."""
        return StarRoadmap(DistanceGrid.empty(parameters.grid_resolution, robot_radius))


def extended(roadmap: StarRoadmap, node: Observation, margins: Margins, robot_radius: float) -> StarRoadmap:
    """The roadmap with one more node.

    Args:
        roadmap: the roadmap before.
        node: with its region.
        margins: of the regions.
        robot_radius: m.
    """
    region, hits = node.region, roadmap.hits.stamped(impassable_points(node, margins, robot_radius))
    assert region is not None
    grown = with_node(roadmap, node, hits)
    own = _edges_off_hits(region, len(roadmap), hits, robot_radius)
    own_covers = grown.union.covers(own.probe, COVER_SLACK)
    covers = roadmap.covers.copy()
    seen = region.alone.contains(roadmap.edge_frontiers.where(covers < 0).probe, COVER_SLACK)
    covers[covers < 0] = np.where(seen, len(roadmap), -1)
    known = roadmap.frontiers.where(~region.alone.contains(roadmap.frontiers.probe, COVER_SLACK))
    frontiers = known.joined(own.where(own_covers < 0))
    return dataclasses.replace(
        grown,
        frontiers=frontiers.where(enterable(frontiers, grown, robot_radius)),
        edge_frontiers=roadmap.edge_frontiers.joined(own),
        covers=np.concatenate((covers, own_covers)),
    )


def with_node(roadmap: StarRoadmap, node: Observation, hits: DistanceGrid) -> StarRoadmap:
    """The roadmap with one more node and its edges, other hits and the same frontiers; arguments as for `extended`."""
    known, region = len(roadmap), node.region
    assert region is not None
    union = indexed(roadmap.union.joined(region.alone), roadmap.union, np.array([known]))
    edges, lengths = edges_from(union, known)
    return dataclasses.replace(
        roadmap,
        nodes=(*roadmap.nodes, node),
        union=union,
        edges=np.vstack((roadmap.edges, edges)),
        lengths=np.concatenate((roadmap.lengths, lengths)),
        hits=hits,
    )


def remade(roadmap: StarRoadmap, nodes: Sequence[Observation], robot_radius: float) -> StarRoadmap:
    """The roadmap with nodes in place of its own, and their edge frontiers in place of all others.

    It keeps its hits, and its retired, inspected and blocked places.
    """
    new, old = dataclasses.replace(roadmap, nodes=tuple(nodes)), roadmap.edge_frontiers
    regions = new.regions
    number = {region: k for k, region in enumerate(regions)}
    renumbered = np.array([number.pop(region, -1) for region in roadmap.regions], np.int64)
    news = np.array(list(number.values()), np.int64)
    kept = np.flatnonzero(renumbered >= 0)
    same = len(regions) >= len(roadmap) and (renumbered[kept] == kept).all()  # else they have other bits in the index
    before, changed = (roadmap.union, news) if same else (RegionUnion.none(), np.arange(len(regions)))
    union = indexed(united(regions), before, changed)
    edges, lengths = edges_from(union, 0)
    fresh = [_edges_off_hits(regions[k], k, roadmap.hits, robot_radius) for k in news.tolist()]
    every = Frontiers(old.viewpoint, old.probe, renumbered[old.owner]).joined(*fresh)
    covers = np.full(len(every), -1)
    covers[: len(old)] = np.append(renumbered, -1)[roadmap.covers]
    doubtful = covers < 0  # those of new regions, and those whose region has changed that covered them
    doubtful[: len(old)] &= roadmap.covers >= 0
    order = np.argsort(every.owner, kind="stable")[(every.owner < 0).sum() :]
    every, covers, doubtful = every.where(order), covers[order], doubtful[order]
    covers[doubtful] = union.covers(every.where(doubtful).probe, COVER_SLACK)
    others = (covers < 0) & ~doubtful
    found = united(regions[k] for k in news.tolist()).covers(every.where(others).probe, COVER_SLACK)
    covers[others] = np.append(news, -1)[found]
    roadmap = dataclasses.replace(
        new,
        union=union,
        edges=edges,
        lengths=lengths,
        frontiers=Frontiers.none(),
        edge_frontiers=every,
        covers=covers,
    )
    if not regions:
        return roadmap
    frontiers = every.where(covers < 0)
    frontiers = frontiers.where(enterable(frontiers, roadmap, robot_radius))
    order = np.argsort(union.center[:, 0])
    places = union.center[order]
    first = np.searchsorted(places[:, 0], frontiers.viewpoint[:, 0] - 1.001 * ARRIVAL_DISTANCE)
    near = _near_nodes(frontiers.viewpoint, frontiers.owner, places, order, first)
    return dataclasses.replace(roadmap, frontiers=frontiers.where(~near))


@njit(cache=True)
def edges_from(union, first):
    """Edges (e, 2) from nodes of an index from `first` on to older ones, sorted by the newer node; their lengths, m.

    Of an indexed union. An edge joins two nodes if one's region contains the other's centre. Without such a node among
    the older ones, the robot has come from the region that a centre exceeds least.
    """
    center, bearing_0, values, marks = union.center, union.bearing_0, union.values, union.marks
    cell, one = np.floor(center / CELL).astype(np.int64) - union.corner, np.uint64(1)
    ends, lengths = [(0, 0)][:0], [0.0][:0]
    for j in range(first, len(center)):
        x, y, begin = center[j, 0], center[j, 1], len(ends)
        for i in range(j):
            u, v = center[i, 0], center[i, 1]
            older = marks[cell[j, 0], cell[j, 1], i // WORD] >> np.uint64(i % WORD) & one
            newer = marks[cell[i, 0], cell[i, 1], j // WORD] >> np.uint64(j % WORD) & one
            if (older and covers(center, bearing_0, values, i, x, y, 0.0)) or (
                newer and covers(center, bearing_0, values, j, u, v, 0.0)
            ):
                ends.append((i, j))
                lengths.append(math.hypot(u - x, v - y))
        if j and len(ends) == begin:
            i = j - 1 - int(np.argmin(excess(union, x, y)[:j][::-1]))  # of equals the newest
            ends.append((i, j))
            lengths.append(math.hypot(center[i, 0] - x, center[i, 1] - y))
    edges = np.empty((len(ends), 2), np.int64)
    for e in range(len(ends)):
        edges[e, 0], edges[e, 1] = ends[e]
    return edges, np.array(lengths)


def blacklist_target(roadmap: StarRoadmap, place: np.ndarray, radius: float, probe: np.ndarray) -> StarRoadmap:
    """The roadmap without frontiers within `radius` (m) of a place (2,) in W, and with a probe (2,) closed."""
    keep = np.hypot(*(roadmap.frontiers.viewpoint - place).T) > radius
    return dataclasses.replace(
        roadmap,
        frontiers=roadmap.frontiers.where(keep),
        blacklisted_targets=np.vstack((roadmap.blacklisted_targets, [[place[0], place[1], radius]])),
        blacklisted_probes=np.vstack((roadmap.blacklisted_probes, probe)),
    )


def rebuilt(roadmap: StarRoadmap, margins: Margins, robot_radius: float) -> StarRoadmap:
    """A roadmap of the same scans and hits, in which nothing was tried in vain."""
    nodes = [node.refitted(robot_radius, margins) for node in roadmap.nodes]
    return remade(StarRoadmap(roadmap.hits), nodes, robot_radius)


def refitted(roadmap: StarRoadmap, margins: Margins, robot_radius: float, swept_radius: float) -> StarRoadmap:
    """A roadmap of the same scans for another footprint; radii as of `PlannerInput`, m."""
    hits = DistanceGrid.empty(roadmap.hits.resolution, swept_radius)
    for node in roadmap.nodes:
        hits = hits.stamped(impassable_points(node, margins, robot_radius))
    return rebuilt(dataclasses.replace(roadmap, hits=hits), margins, robot_radius)


def _edges_off_hits(region: StarRegion, owner: int, hits: DistanceGrid, robot_radius: float) -> Frontiers:
    """The edge frontiers of a region that are not at a hit."""
    edges = edge_frontiers(region, owner)
    return edges.where(hits.distance(edges.probe) > robot_radius - HIT_ERROR)


def uncovered_share(region: StarRegion, others: RegionUnion) -> float:
    """The share of a region's area that no other region covers, in [0, 1]; 0 for a region without area."""
    values = region.boundary.values
    chosen = np.arange(0, len(values), AREA_BEARINGS)
    phi = np.minimum(values[chosen], np.roll(values, -1)[chosen])
    count = np.ceil(phi / AREA_STEP).astype(np.int64)
    ray = np.repeat(np.arange(len(chosen)), count)
    along = np.arange(len(ray)) - np.repeat(np.cumsum(count) - count, count) + 0.5
    step = phi[ray] / count[ray]
    bearing = region.bearing_0 + 2.0 * math.pi / len(values) * (chosen[ray] + 0.5)
    places = region.center + (along * step)[:, None] * np.column_stack((np.cos(bearing), np.sin(bearing)))
    area = along * step * step
    new = area[~others.contains(places)].sum()
    return float(new / area.sum()) if len(ray) else 0.0


def is_blacklisted(roadmap: StarRoadmap, places: np.ndarray) -> np.ndarray:
    """Which places of shape (n, 2) in W lie in a blacklisted disc, shape (n,)."""
    x, y, radius = roadmap.blacklisted_targets.T[..., None]
    return ((places[:, 0] - x) ** 2 + (places[:, 1] - y) ** 2 <= radius**2).any(axis=0)


def enterable(frontiers: Frontiers, roadmap: StarRoadmap, robot_radius: float) -> np.ndarray:
    """Frontiers that are not at the newest node, in a retired place, or at a hit or blocked place; shape (n,)."""
    viewpoint, probe = frontiers.viewpoint, frontiers.probe
    away = np.hypot(*(viewpoint - roadmap.union.center[-1]).T) > ARRIVAL_DISTANCE
    stalled = np.hypot(*(probe[:, None] - roadmap.stall_points).T) <= robot_radius
    free = roadmap.hits.distance(probe) > robot_radius - HIT_ERROR
    return away & free & ~is_blacklisted(roadmap, viewpoint) & ~stalled.any(axis=0)


@njit(cache=True)
def _near_nodes(viewpoint, owner, center, number, first):
    """Whether each viewpoint (n, 2) is at its node or a newer one: one loop, as there are 10^7 pairs in a building.

    Of the nodes, sorted by x, it takes the centres (k, 2) and the numbers (k,); and the `first` to look at (n,).
    """
    out = np.zeros(len(viewpoint), np.bool_)
    for i in range(len(viewpoint)):
        k = first[i]
        while k < len(center) and center[k, 0] <= viewpoint[i, 0] + 1.001 * ARRIVAL_DISTANCE:
            away = math.hypot(viewpoint[i, 0] - center[k, 0], viewpoint[i, 1] - center[k, 1])
            if number[k] >= owner[i] and away <= ARRIVAL_DISTANCE:
                out[i] = True
            k += 1
    return out
