"""Hits as chords."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given

from drake_starnav.lidar.laser_scan import DYNAMIC, USUAL_COVER_RADIUS, Beams, LaserScan
from drake_starnav.surroundings.bearing_hits import CONNECTED_CHORD
from drake_starnav.surroundings.chords import (
    BINS,
    Chords,
    make_occluding_chords,
    make_surface_chords,
    measure_visible_ranges,
)
from tests.helpers.scans import seeds

CHORD = CONNECTED_CHORD * USUAL_COVER_RADIUS


def chords(hits: np.ndarray, newest: int, center: np.ndarray) -> Chords:
    """Hits as surfaces, of which the last scan's begin at an index."""
    pose = *map(float, center), 0.0
    ends, occludes = make_surface_chords(hits[newest:], hits[:newest], pose, USUAL_COVER_RADIUS)
    return Chords(ends, np.ones(len(ends), bool), occludes, center)


def expected(points: np.ndarray, closed: bool) -> list[tuple]:
    """Pairs of neighbours nearer than CHORD, and points without such a neighbour twice."""
    count = len(points)
    pairs = [(i, (i + 1) % count) for i in range(count if closed else count - 1) if count > 1]
    joined = [(i, j) for i, j in pairs if math.dist(points[i], points[j]) < CHORD]
    alone = [(i, i) for i in range(count) if not any(i in pair for pair in joined)]
    return sorted((*points[i].tolist(), *points[j].tolist()) for i, j in joined + alone)


@pytest.mark.parametrize("count", [1, 2, 3, 5, 12])
@given(seeds)
def test_each_hit_is_joined_to_its_neighbours_on_the_surface_or_stands_alone(count: int, seed: int) -> None:
    """Of the last scan in the order of its bearings from its place, all around; of the earlier as they come."""
    rng = np.random.default_rng(seed)
    center = rng.uniform(-5.0, 5.0, 2)
    steps = rng.choice([0.5, 2.0], (2, count)) * CHORD
    turns = rng.uniform(-math.pi, math.pi) + np.cumsum(steps, axis=1) * rng.choice([0.5, 1.0])
    turns = turns[:, (turns - turns[:, :1]).max(axis=0) < 2.0 * math.pi]
    earlier, latest = (center + np.column_stack((np.cos(t), np.sin(t))) for t in turns)
    latest = latest[rng.permutation(len(latest))]  # as of several lidars
    found = chords(np.vstack((earlier, latest)), len(earlier), center)
    bearings = np.arctan2(*(latest - center).T[::-1])
    last = expected(latest[np.argsort(bearings, kind="stable")], closed=True)
    assert sorted(map(tuple, found.ends.tolist())) == sorted(expected(earlier, closed=False) + last)
    shading = [ends for ends in last if ends[:2] != ends[2:]]
    assert sorted(map(tuple, found.ends[found.occludes].tolist())) == shading


def test_hits_as_far_apart_as_a_chord_may_be_long_stay_alone():
    for length, joined in ((CHORD, False), (math.nextafter(CHORD, 0.0), True)):
        ends = chords(np.array(((0.0, 0.0), (length, 0.0))), 2, np.zeros(2)).ends
        assert (ends[:, :2] != ends[:, 2:]).any() == joined


def blind(beams: Beams, place: tuple[float, float, float]) -> shapely.Geometry:
    """What chords that hide without being surfaces hide, as far as 9 m."""
    center, wedges = np.array(place[:2]), []
    for ends in make_occluding_chords(beams, place).reshape(-1, 2, 2):
        far = center + 9.0 / np.hypot(*(ends - center).T)[:, None] * (ends - center)
        wedges.append(shapely.MultiPoint(np.vstack((ends, far))).convex_hull)
    return shapely.union_all(wedges)


@given(seeds)
def test_lost_beams_what_moves_and_bearings_beside_the_view_hide(seed: int) -> None:
    """Half a beam more to each side, and nothing else."""
    rng, place = np.random.default_rng(seed), (0.3, -0.2, 1.0)
    ranges = np.full(61, np.inf)
    lost, moving, lone = rng.choice(np.arange(5, 56, 5), 3, replace=False)
    ranges[lost], ranges[moving], ranges[lone] = np.nan, 1.0, 2.0
    motion = np.where(np.arange(61) == moving, DYNAMIC, 0)
    scan = LaserScan(0.0, -1.5, 0.05, 0.0, 5.0, ranges, lost_beams=True, motion=motion)
    hidden = blind(scan.beams, place)
    for beam, distance in ((lost, scan.distances[lost]), (moving, 1.0), (lone, 2.0)):
        for beside in (-0.4, 0.0, 0.4):
            bearing = place[2] - 1.5 + 0.05 * (beam + beside)
            ray = np.array(place[:2]) + np.outer((distance - 0.05, distance + 0.05), (np.cos(bearing), np.sin(bearing)))
            assert [hidden.contains(shapely.Point(p)) for p in ray] == [False, True]
    for off in np.arange(1.6, 4.6, 0.2):
        assert hidden.contains(shapely.Point(place[0] + 0.1 * np.cos(off + 1.0), place[1] + 0.1 * np.sin(off + 1.0)))
    free = np.setdiff1d(np.arange(1, 60), [k for beam in (lost, moving, lone) for k in (beam - 1, beam, beam + 1)])
    for bearing in place[2] - 1.5 + 0.05 * free:
        assert not hidden.contains(shapely.Point(place[0] + 4.0 * np.cos(bearing), place[1] + 4.0 * np.sin(bearing)))


def test_a_lidar_that_sees_all_around_and_hits_surfaces_hides_nothing_else() -> None:
    scan = LaserScan(0.0, -np.pi, 2.0 * np.pi / 90, 0.0, 5.0, np.full(90, 2.0))
    assert len(make_occluding_chords(scan.beams, (0.0, 0.0, 0.0))) == 0


@given(seeds)
def test_no_bin_says_free_where_a_chord_is(seed: int) -> None:
    rng, place = np.random.default_rng(seed), (0.5, 0.5, 2.0)
    ends = rng.uniform(-2.0, 2.0, (6, 4))
    ends[:, 2:] = ends[:, :2] + rng.uniform(-0.3, 0.3, (6, 2)) * rng.integers(0, 2, (6, 1))
    free = measure_visible_ranges(ends, place, 3.0)
    assert free.shape == (BINS,) and free.max() <= 3.0
    for share in np.linspace(0.0, 1.0, 30):
        away = ends[:, :2] + share * (ends[:, 2:] - ends[:, :2]) - place[:2]
        bins = np.floor((np.arctan2(away[:, 1], away[:, 0]) - place[2]) / (2.0 * np.pi / BINS)).astype(int) % BINS
        assert (free[bins] <= np.hypot(*away.T) + 1e-9).all()
