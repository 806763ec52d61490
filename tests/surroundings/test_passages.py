"""The margin is reduced in passages that it would close, and kept everywhere else."""

import dataclasses

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.surroundings.bearing_hits import convert_beams_to_bearings, measure_half_chords
from drake_starnav.surroundings.erosion import (
    FreeRange,
    compute_free_limit,
    compute_free_range,
    erode,
    find_field_of_view,
    limit_by_moving_obstacles,
    make_bearing_tables,
    smooth_distances,
)
from drake_starnav.surroundings.margins import Margins
from drake_starnav.surroundings.passages import PASSAGE_DEPTH, SHUT, add_passages
from drake_starnav.surroundings.star_region import make_scan_region
from drake_starnav.worlds.world import World
from tests.helpers.scans import MARGINS, RADIUS, cast, scattered, seeds

PLAIN = dataclasses.replace(MARGINS, least=MARGINS.preferred)
MARGIN, LEAST = MARGINS.preferred, MARGINS.least


def profile(scan: LaserScan, margins: Margins = MARGINS) -> FreeRange:
    return compute_free_range(scan, scan.distances, RADIUS, margins)


def eroded(scan: LaserScan, margin: float) -> np.ndarray:
    """The free range with a margin, m, that no passage changes."""
    samples, inflated = 720, RADIUS + margin
    limit = compute_free_limit(find_field_of_view(scan), samples, scan.range_max - RADIUS - MARGIN)
    hits = convert_beams_to_bearings(
        scan.distances, measure_half_chords(scan.distances, scan.beams), scan.beams, samples
    )
    return erode(
        *hits, inflated, limit_by_moving_obstacles(limit, scan.beams, RADIUS + MARGIN), *make_bearing_tables(samples)
    )


def door(half: float, x: float = 0.3) -> World:
    """A wall ahead with a door of twice `half` (m), its near side at x, and plenty of room behind."""
    sides = [[(x, low), (x + 0.1, low), (x + 0.1, high), (x, high)] for low, high in ((-3.0, -half), (half, 3.0))]
    return World("door", (0, 0, 0), (2, 0), polygons=sides, bounds=(-3.0, -3.0, 4.0, 3.0))


def ahead(found: np.ndarray) -> float:
    """The free range straight ahead, m."""
    return float(found[len(found) // 2])


@pytest.mark.parametrize("margin", [0.5 * (MARGIN + LEAST), LEAST])
def test_a_narrow_door_is_entered_at_once_with_the_widest_margin_that_opens_it(margin):
    """Two are tried: the mean of the full and the least margin, and the least."""
    scan = cast(door(RADIUS + margin + 0.004))
    assert ahead(eroded(scan, MARGIN)) < SHUT * RADIUS
    found = profile(scan)
    assert ahead(found.values) > 3.0 and found.margin == pytest.approx(margin)


@pytest.mark.parametrize("half", [RADIUS - 0.03, RADIUS + LEAST - 0.005])
def test_a_door_that_leaves_too_little_stays_shut(half):
    scan = cast(door(half))
    found = profile(scan)
    assert ahead(found.values) < SHUT * RADIUS and found.margin == MARGIN
    np.testing.assert_array_equal(found.values, eroded(scan, MARGIN))


def test_a_robot_nearer_to_walls_than_the_margin_sees_along_them():
    half = RADIUS + 0.5 * (MARGIN + LEAST)
    scan = cast(World("lane", (0, 0, 0), (2, 0), bounds=(-2.0, -half, 3.0, half)))
    assert eroded(scan, MARGIN).max() < 0.05
    found = profile(scan)
    assert ahead(found.values) > 1.0 and found.margin < MARGIN


@settings(max_examples=60)
@given(seeds)
def test_between_the_margin_and_the_least_one(seed):
    """In any world: never less than with the full margin, never more than with the least margin."""
    scan = cast(scattered(np.random.default_rng(seed), discs=12, walls=10, clear=0.3))
    found, plain, narrow = profile(scan), eroded(scan, MARGIN), eroded(scan, LEAST)
    assert (found.values >= plain).all() and (found.values <= narrow).all()
    assert (found.values <= eroded(scan, found.margin)).all()
    assert LEAST - 1e-9 < found.margin <= MARGIN
    opened = found.values > plain + 1e-12
    assert (opened.any()) == (found.margin < MARGIN)
    np.testing.assert_array_equal(profile(scan, PLAIN).values, plain)
    np.testing.assert_array_equal(found.limit, profile(scan, PLAIN).limit)
    assert (plain[opened] < SHUT * RADIUS).all()  # no corner is cut of a way that is open


@settings(max_examples=20)
@given(seeds)
def test_a_region_s_passages_are_those_of_smoothed_ranges(seed):
    scan = cast(scattered(np.random.default_rng(seed), discs=12, walls=10, clear=0.3))
    region = make_scan_region(scan, np.zeros(3), RADIUS, MARGINS)
    smoothed = compute_free_range(scan, smooth_distances(scan), RADIUS, MARGINS)
    np.testing.assert_array_equal(region.free_range, smoothed.values)
    assert region.margin == smoothed.margin


def opened(scan: LaserScan) -> np.ndarray:
    """The free range with its passages, from erosions of the whole scan."""
    free, narrowest = eroded(scan, MARGIN), eroded(scan, LEAST)
    if add_passages(free, narrowest, RADIUS)[1]:
        for narrow in (eroded(scan, 0.5 * (MARGIN + LEAST)), narrowest):
            free, _ = add_passages(free, narrow, RADIUS)
    return free


@settings(max_examples=100)
@given(seeds)
def test_the_narrower_robot_is_only_looked_at_where_a_passage_can_be(seed):
    scan = cast(scattered(np.random.default_rng(seed), discs=12, walls=10, clear=0.3))
    np.testing.assert_array_equal(profile(scan).values, opened(scan))


def runs(flags: np.ndarray) -> list[np.ndarray]:
    """The indices of each run of set flags, around the end of the array."""
    if flags.all() or not flags.any():
        return [np.arange(len(flags))] if flags.all() else []
    start = int(np.flatnonzero(~flags)[0])
    index = (start + np.arange(len(flags))) % len(flags)
    return [part[flags[part]] for part in np.split(index, np.flatnonzero(np.diff(flags[index].astype(int)) == 1) + 1)
            if flags[part].any()]  # fmt: skip


@settings(max_examples=200)
@given(seeds, st.integers(3, 40))
@example(0, 3)
def test_passages_are_whole_runs_between_ends_that_are_shut(seed, n):
    rng = np.random.default_rng(seed)
    free = rng.choice((0.0, 0.2, 0.45, 0.8, 2.0), n)
    narrow = free + rng.choice((0.0, 0.1, 1.0), n)
    before = free.copy(), narrow.copy()
    out, opened = add_passages(free, narrow, RADIUS)
    np.testing.assert_array_equal(free, before[0])
    np.testing.assert_array_equal(narrow, before[1])
    expected = free.copy()
    for run in runs(narrow > free + PASSAGE_DEPTH * RADIUS):
        whole = np.concatenate(((run[:1] - 1) % n, run, (run[-1:] + 1) % n))
        if len(run) == n or free[whole].max() < SHUT * RADIUS:
            expected[run] = narrow[run]
    np.testing.assert_array_equal(out, expected)
    assert opened == bool((expected != free).any())
