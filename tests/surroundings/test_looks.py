"""Looks: what one of them saw is free, what none saw is unknown, and which are kept."""

import dataclasses
import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings

from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.surroundings.looks import (
    MOST_LOOKS,
    Kept,
    Known,
    Look,
    Looks,
    Start,
    clipped,
    known,
    remembered,
    saw,
)
from tests.helpers.scans import cast, scattered, seeds

HERE = (0.0, 0.0, 0.0)


def look_of(scan: LaserScan, place: tuple[float, float, float], reach: float = 3.0) -> Look:
    """What one lidar alone saw in one scan."""
    hits = scan.points(place)
    return Look(hits, (0, len(hits)), scan.beams, place, reach)


def shadows(look: Look) -> shapely.Geometry:
    """All that a look did not see, as far as 9 m."""
    chords, center, hidden = look.chords, np.array(look.place[:2]), []
    for ends in chords.ends[chords.shades].reshape(-1, 2, 2):
        away = np.hypot(*(ends - center).T)
        if away.min() > 0.0:
            far = center + 9.0 / away[:, None] * (ends - center)
            hidden.append(shapely.MultiPoint(np.vstack((ends, far))).convex_hull)
    return shapely.union_all(hidden)


def asked() -> np.ndarray:
    return np.zeros(2, np.int64)


def piece(rng: np.random.Generator, size: float, reach: float = 2.5) -> np.ndarray:
    """Corners of a convex polygon somewhere, counterclockwise."""
    hull = shapely.MultiPoint(rng.uniform(-reach, reach, 2) + rng.uniform(-size, size, (6, 2))).convex_hull
    return shapely.get_coordinates(shapely.orient_polygons(hull))[:-1]


@settings(max_examples=60)
@given(seeds)
def test_what_looks_saw_is_in_none_of_their_shadows(seed: int) -> None:
    """Whole parts, and parts that several looks saw together, with views all around and limited ones."""
    rng, views = np.random.default_rng(seed), ({}, {"angle_min": -1.5, "angle_increment": 3.0 / 359})
    world = scattered(rng, discs=10, walls=6, clear=0.3)
    places = [(*rng.uniform(-0.25, 0.25, 2).tolist(), float(rng.uniform(-3.0, 3.0))) for _ in range(3)]
    seen = [look_of(cast(world, np.array(p), **views[rng.integers(2)]), p) for p in places]
    looks = Looks.of(tuple(Known(look, look.place, 0.0) for look in seen))
    dark = [shadows(look).buffer(-1e-6) for look in seen]
    for _ in range(20):
        corners = piece(rng, rng.choice([0.02, 0.1, 0.3]))
        area = shapely.Polygon(corners)
        for k, hidden in enumerate(dark):
            if saw(k, looks, corners, len(corners)):
                assert not area.intersects(hidden)
        if known(corners, len(corners), looks, asked()):
            assert area.intersection(shapely.intersection_all(dark)).area < 1e-9


def test_most_of_what_a_look_saw_it_knows() -> None:
    rng = np.random.default_rng(3)
    look = look_of(cast(scattered(rng, discs=6, walls=2), np.zeros(3)), HERE)
    looks, dark = Looks.of((Known(look, HERE, 0.0),)), shadows(look)
    parts = [piece(rng, 0.03, 1.5) for _ in range(300)]
    free = [part for part in parts if shapely.distance(shapely.Polygon(part), dark) > 0.05]
    assert len(free) > 150
    assert np.mean([known(part, len(part), looks, asked()) for part in free]) > 0.95


def test_two_looks_know_together_what_none_saw_whole() -> None:
    views = ({"angle_min": -0.1, "angle_increment": 3.0 / 359}, {"angle_min": -2.9, "angle_increment": 3.0 / 359})
    world = scattered(np.random.default_rng(0), discs=0, walls=0)
    seen = tuple(Known(look_of(cast(world, np.zeros(3), **view), HERE), HERE, 0.0) for view in views)
    ahead = np.array([(0.4, -0.2), (0.6, -0.2), (0.6, 0.2), (0.4, 0.2)])
    assert known(ahead, 4, Looks.of(seen), asked())
    for one in seen:
        assert not known(ahead, 4, Looks.of((one,)), asked())
    assert not known(ahead, 4, Looks.of(()), asked())


@given(seeds)
def test_what_is_clipped_off_lies_beyond_the_line(seed: int) -> None:
    rng, out = np.random.default_rng(seed), np.empty((9, 2))
    corners, angle, offset = piece(rng, 1.0, 0.1), rng.uniform(-3.0, 3.0), rng.uniform(-0.8, 0.8)
    normal = np.array((math.cos(angle), math.sin(angle)))
    size = clipped(corners, len(corners), *normal, offset, out)
    side = np.array((-normal[1], normal[0]))
    ends = ((1, 0), (1, 1), (-1, 1), (-1, 0))
    half = shapely.Polygon([offset * normal + 9.0 * (s * side - d * normal) for s, d in ends])
    kept = shapely.Polygon(out[:size]) if size > 2 else shapely.Polygon()
    assert kept.symmetric_difference(shapely.Polygon(corners).intersection(half)).area < 1e-9


def test_looks_are_kept_as_far_apart_as_they_tell_anything_new_and_no_more_than_so_many() -> None:
    look, known_before, last = Look.none(), (), None
    start = Known(Start.of(0.3), HERE, 0.0)
    for k in range(400):
        x = 0.01 * k
        pose = np.array((x, 0.0, 0.0))
        new = () if last is None else (last,)
        known_before = remembered(known_before or (start,), new, (x, 0.0), (pose, 0.1 * k), Kept(9.0, 0.04))
        last = Known(look, (x, 0.0, 0.0), 0.1 * k, x)
    assert len(known_before) == MOST_LOOKS + 1 and isinstance(known_before[-1].look, Start)
    steps = np.diff([each.place[0] for each in known_before[1:-1]])  # the first is the last, however near
    assert (steps < -0.039).all() and (steps > -0.4).all()  # all along the way
    assert known_before[-2].place[0] < 0.1
    assert known_before[0].place[0] == pytest.approx(3.98)
    back = remembered(known_before, (last._replace(place=(3.9, 0.0, 0.0)),), (4.1, 0.0), (pose, 41.0), Kept(9.0, 0.04))
    assert len(back) <= len(known_before)  # of places where it was before only the last look counts


def test_what_was_seen_is_not_forgotten_while_a_robot_manoeuvres() -> None:
    """A lidar that does not look behind it has seen the place to which it turns its back."""
    scan = LaserScan(0.0, -2.35, 4.7 / 359, 0.0, 5.0, np.full(360, 5.0))
    turns = [(0.5, 0.0, 0.08 * k) for k in range(40)]
    places = [(0.02 * k, 0.0, 0.0) for k in range(26)] + turns
    for k in range(90):  # to and fro
        places.append((0.5 + 0.06 * math.sin(k), 0.06 * math.cos(1.7 * k), 3.1 + 0.4 * math.sin(0.7 * k)))
    known_before: tuple[Known, ...] = ()
    for place in places:
        last = Known(look_of(scan, place), place, 0.0)
        known_before = remembered(known_before, (last,), (0.0, 0.0), (np.array(place), 0.0), Kept(9.0, 0.04))
    part = np.array([(0.8, -0.05), (0.9, -0.05), (0.9, 0.05), (0.8, 0.05)])
    assert known(part, 4, Looks.of(known_before), asked()) and not known(part, 4, Looks.of((last,)), asked())
    assert len(known_before) <= MOST_LOOKS


def test_where_the_robot_stood_nothing_else_did() -> None:
    """Also around the place of a lidar that does not look all around."""
    scan = LaserScan(0.0, -2.35, 4.7 / 359, 0.0, 5.0, np.full(360, 5.0))
    part = np.array([(-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)])
    for inside, free in ((0.0, False), (0.14, False), (0.15, True)):
        look = dataclasses.replace(look_of(scan, HERE), inside=inside)
        assert known(part, 4, Looks.of((Known(look, HERE, 0.0),)), asked()) == free
        assert known(part + (0.5, 0.0), 4, Looks.of((Known(look, HERE, 0.0),)), asked())


@pytest.mark.parametrize(
    ("kept", "left"),
    [(Kept(reach=0.55), 5), (Kept(way=0.45), 4), (Kept(turn=0.25), 2), (Kept(time=3.5), 3), (Kept(), 9)],
)
def test_what_is_far_long_ago_or_of_a_pose_that_erred_meanwhile_is_forgotten(kept: Kept, left: int) -> None:
    before = tuple(Known(Look.none(), (0.1 * k, 0.0, 0.0), float(k), 0.1 * k, 0.1 * k) for k in range(8, -1, -1))
    now = np.array((0.9, 0.0, 0.0)), 9.0
    assert len(remembered(before, (), (0.9, 0.9), now, kept)) == left


def test_where_something_is_seen_the_disc_of_the_start_is_not_free() -> None:
    scan = LaserScan(0.0, -0.5, 0.01, 0.0, 5.0, np.full(101, 0.2))
    disc = Start.of(0.3).cut(HERE, look_of(scan, HERE).chords)
    looks = Looks.of((Known(disc, HERE, 0.0),))
    for x, free in ((0.25, False), (0.15, True), (-0.25, True), (-0.31, False)):
        part = np.array([(x, -0.01), (x + 0.01, -0.01), (x, 0.01)])
        assert known(part, 3, looks, asked()) == free


def test_in_another_frame_looks_know_the_same() -> None:
    rng, frame = np.random.default_rng(1), np.array((1.0, -2.0, 2.5))
    look = look_of(cast(scattered(rng), np.zeros(3)), HERE)
    there = Known(look.moved(frame), look.moved(frame).place, 0.0)
    also = Known(look, HERE, 0.0).moved(frame)
    np.testing.assert_allclose(there.place, also.place)
    np.testing.assert_allclose(there.look.free, look.free, atol=1e-9)
    moved = dataclasses.replace(look, place=there.place)
    np.testing.assert_allclose(moved.chords.center, frame[:2])
