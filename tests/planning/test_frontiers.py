"""Frontiers are the runs of a region's boundary beyond which nothing is known that stops the robot."""

import dataclasses

import numpy as np
from hypothesis import given, settings

from drake_starnav.planning.frontiers import BEYOND, COVER_SLACK, LEAST, STEP, find_frontiers, find_region_frontiers
from drake_starnav.planning.grid import HIT_ERROR
from drake_starnav.planning.roadmap import CLOSURE_RADIUS, ClosedPlaces
from drake_starnav.worlds.world import World
from tests.helpers.scans import RADIUS, distance, explored, length, seeds, segment_distance, wandered


def with_failed(roadmap, places):
    """The roadmap with places (k, 2) where ways failed."""
    return dataclasses.replace(roadmap, closures=ClosedPlaces(places))


@settings(max_examples=15)
@given(seeds)
def test_beyond_a_gap_is_no_region_no_hit_and_no_closure(seed):
    _, roadmap = wandered(seed)
    closures = roadmap.regions[-1].outline()[::60]
    closed = with_failed(roadmap, closures)
    gaps = [(owner, gap) for owner in range(len(closed)) for gap in find_region_frontiers(closed, RADIUS, owner)]
    assert len(gaps) == len(find_frontiers(closed, RADIUS))
    for owner, gap in gaps:
        assert len(gap.boundary) == len(gap.probes) and length(gap.boundary) >= LEAST * RADIUS
        assert (np.hypot(*np.diff(gap.boundary, axis=0).T) < 2.0 * STEP * RADIUS).all()
        np.testing.assert_allclose(np.hypot(*(gap.probes - gap.boundary).T), BEYOND * RADIUS)
        outline = roadmap.regions[owner].outline()
        start, end = outline[None], np.roll(outline, -1, axis=0)[None]
        assert segment_distance(gap.boundary[::4, None], start, end).min(axis=1).max() < 1e-9
        assert not roadmap.union.contains(gap.probes, COVER_SLACK * RADIUS).any()
        assert (roadmap.grid.distance(gap.probes) > RADIUS - HIT_ERROR * RADIUS).all()
        assert (np.hypot(*np.moveaxis(gap.probes[:, None] - closures, -1, 0)) > CLOSURE_RADIUS * RADIUS).all()


@settings(max_examples=15)
@given(seeds)
def test_every_open_run_of_a_boundary_is_a_gap(seed):
    """Sampled by plain NumPy: a place beyond the boundary that nothing covers lies near a gap, or in a short run."""
    _, roadmap = wandered(seed, nodes=3)
    for owner, region in enumerate(roadmap.regions):
        outline = region.outline()
        ahead = np.roll(outline, -1, axis=0) - outline
        middle = outline + 0.5 * ahead
        out = np.column_stack((ahead[:, 1], -ahead[:, 0])) / np.hypot(*ahead.T)[:, None]
        probe = middle + BEYOND * RADIUS * out
        is_open = ~roadmap.union.contains(probe, COVER_SLACK * RADIUS) & (
            roadmap.grid.distance(probe) > RADIUS - HIT_ERROR * RADIUS
        )
        gaps = find_region_frontiers(roadmap, RADIUS, owner)
        lines = np.vstack([gap.boundary for gap in gaps]) if gaps else np.zeros((0, 2))
        covered = (np.hypot(*np.moveaxis(middle[is_open, None] - lines, -1, 0)) < STEP * RADIUS).any(axis=1)
        missed = np.hypot(*ahead[is_open][~covered].T).sum()
        assert missed < 0.25 * np.hypot(*ahead.T).sum()


def test_a_gap_is_between_hits_and_gone_once_it_was_looked_through():
    walls = [[(1.0, low), (1.1, low), (1.1, high), (1.0, high)] for low, high in ((-3.0, -0.5), (0.5, 3.0))]
    world = World("door", (0, 0, 0), (3, 0), polygons=walls, bounds=(-1.5, -2.0, 4.0, 2.0))
    before, after = explored(world, np.array(((0.0, 0.0),))), explored(world, np.array(((0.0, 0.0), (1.6, 0.0))))
    behind = [gap for gap in find_frontiers(before, RADIUS) if (gap.probes[:, 0] > 1.0).all()]
    assert len(behind) == 2  # on both sides of the cone that is seen through the door
    assert all((distance(world, gap.boundary) > RADIUS - HIT_ERROR * RADIUS).all() for gap in behind)
    assert not find_frontiers(after, RADIUS)


def test_what_is_closed_is_no_frontier():
    roadmap = explored(World("open", (0, 0, 0), (9, 0)), np.zeros((1, 2)))
    (whole,) = find_frontiers(roadmap, RADIUS)
    closure = whole.probes[len(whole.probes) // 3]
    parts = find_frontiers(with_failed(roadmap, closure[None]), RADIUS)
    lost = length(whole.boundary) - sum(length(gap.boundary) for gap in parts)
    assert (
        2.0 * CLOSURE_RADIUS * RADIUS - 3.0 * STEP * RADIUS < lost < 2.0 * CLOSURE_RADIUS * RADIUS + 6.0 * STEP * RADIUS
    )
