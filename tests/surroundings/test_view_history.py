"""Looks: what one of them saw is free, what none saw is unknown, and which are kept."""

import math

import numpy as np
import pytest

from drake_starnav.geometry.footprint import disc, footprint
from drake_starnav.geometry.se2 import find_pose_in_frame, transform_points
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.mounts import Mount
from drake_starnav.surroundings.chords import BINS, Chords
from drake_starnav.surroundings.margins import ViewRetention
from drake_starnav.surroundings.view import View
from drake_starnav.surroundings.view_history import (
    MOST_VIEWS,
    InitialFreeDisc,
    Odometer,
    ViewHistory,
    forget_stale_views,
)
from drake_starnav.utils.snapshot import replace_fields
from tests.helpers.scans import cast, scattered, seen_by, view_of

HERE = (0.0, 0.0, 0.0)


def at_once(view: View | InitialFreeDisc, pose: tuple, time: float, way: float = 0.0) -> ViewHistory:
    """A history of one view."""
    return ViewHistory.of_one_time((view,), (pose,), time, Odometer(way, 0.0))


def remembered(
    past: ViewHistory, latest: ViewHistory, driven: tuple, now: tuple, retention: ViewRetention
) -> ViewHistory:
    """What still counts, by way and turn of the robot, and its position and time."""
    return forget_stale_views(past, latest, Odometer(*driven), *now, retention)


def standing(view: View, robot: tuple) -> View:
    """The view of a lidar on the axis of a robot that stands elsewhere: the certificate asks only where that is."""
    mount = Mount(*find_pose_in_frame(np.array(robot), np.array(view.pose)), upside_down=False)
    return replace_fields(view, mount=Mount(mount.x, mount.y, 0.0, False), robot_pose=np.array(robot))


def test_looks_are_kept_as_far_apart_as_they_tell_anything_new_and_no_more_than_so_many() -> None:
    look, known_before, last = View.none(), at_once(InitialFreeDisc.of_radius(0.3), HERE, 0.0), ViewHistory()
    for k in range(400):
        x = 0.01 * k
        place = (x, 0.0)
        known_before = remembered(known_before, last, (x, 0.0), (place, 0.1 * k), ViewRetention(9.0, 0.04))
        last = at_once(look, (x, 0.0, 0.0), 0.1 * k, x)
    assert len(known_before.views) == MOST_VIEWS + 1 and isinstance(known_before.views[-1], InitialFreeDisc)
    steps = np.diff(known_before.rows[1:-1, 0])  # the first is the last, however near
    assert (steps < -0.039).all() and (steps > -0.4).all()  # all along the way
    assert known_before.rows[-2, 0] < 0.1
    assert known_before.rows[0, 0] == pytest.approx(3.98)
    back = remembered(
        known_before, at_once(look, (3.9, 0.0, 0.0), 39.9, 3.99), (4.1, 0.0), (place, 41.0), ViewRetention(9.0, 0.04)
    )
    assert len(back.views) <= len(known_before.views)  # of places where it was before only the last look counts


def test_what_was_seen_is_not_forgotten_while_a_robot_manoeuvres() -> None:
    """A lidar that does not look behind it has seen the place to which it turns its back."""
    scan = LaserScan(0.0, -2.35, 4.7 / 359, 0.0, 5.0, np.full(360, 5.0))
    turns = [(0.5, 0.0, 0.08 * k) for k in range(40)]
    places = [(0.02 * k, 0.0, 0.0) for k in range(26)] + turns
    for k in range(90):  # to and fro
        places.append((0.5 + 0.06 * math.sin(k), 0.06 * math.cos(1.7 * k), 3.1 + 0.4 * math.sin(0.7 * k)))
    known_before = ViewHistory()
    for place in places:
        last = at_once(view_of(scan, place), place, 0.0)
        known_before = remembered(known_before, last, (0.0, 0.0), (place[:2], 0.0), ViewRetention(9.0, 0.04))
    part = np.array([(0.8, -0.05), (0.9, -0.05), (0.9, 0.05), (0.8, 0.05)])
    assert seen_by(known_before, part) and not seen_by(last, part)
    assert len(known_before.views) <= MOST_VIEWS


@pytest.mark.parametrize("yaw", [0.0, 0.7, -2.9])
def test_what_begins_at_the_edge_of_a_bin_is_seen_and_what_reaches_across_is_not(yaw: float) -> None:
    """Two lidars whose views meet along a robot's side leave no strip between them that neither has seen."""
    scan = LaserScan(0.0, -1e-5, 1.5 * math.pi / 269, 0.0, 5.0, np.full(270, 5.0))
    place = (0.3, -0.2, yaw)
    known = at_once(view_of(scan, place), place, 0.0)
    for low, seen in ((0.0, True), (0.05, True), (-1e-4, False), (-0.1, False)):
        part = np.array([(0.1, low), (0.3, low), (0.3, low + 0.1), (0.1, low + 0.1)])
        assert seen_by(known, transform_points(np.array(place), part)) == seen


def test_where_the_robot_stood_nothing_else_did() -> None:
    """Also around the place of a lidar that does not look all around."""
    scan = LaserScan(0.0, -2.35, 4.7 / 359, 0.0, 5.0, np.full(360, 5.0))
    part = np.array([(-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)])
    box, thin = (footprint(((-0.2, -w), (0.2, -w), (0.2, w), (-0.2, w))) for w in (0.1, 0.09))
    for shape, robot, free in (
        (disc(0.14), HERE, False), (disc(0.15), HERE, True), (disc(0.15), (0.1, 0.0, 0.0), False),
        (box, HERE, True), (box, (0.1, 0.0, 0.0), True), (thin, HERE, False),
    ):  # fmt: skip
        look = standing(view_of(scan, HERE, shape=shape), robot)
        assert seen_by(at_once(look, HERE, 0.0), part) == free
        assert seen_by(at_once(look, HERE, 0.0), part + (0.5, 0.0))


def test_a_look_that_may_have_erred_counts_as_shorter() -> None:
    view = view_of(LaserScan(0.0, -2.35, 4.7 / 359, 0.0, 1.0, np.full(360, 1.0)), HERE, 1.0)
    look = replace_fields(view, params=view.params._replace(range_error=0.02))
    for x, free in ((0.97, True), (0.985, False)):
        part = np.array([(x, -0.001), (x + 0.001, -0.001), (x, 0.001)])
        assert seen_by(at_once(look, HERE, 0.0), part) == free


@pytest.mark.parametrize(
    ("kept", "left"),
    [
        (ViewRetention(reach=0.55), 5),
        (ViewRetention(way=0.45), 4),
        (ViewRetention(turn=0.25), 2),
        (ViewRetention(age=3.5), 3),
        (ViewRetention(), 9),
    ],
)
def test_what_is_far_long_ago_or_of_a_pose_that_erred_meanwhile_is_forgotten(kept: ViewRetention, left: int) -> None:
    rows = [(0.1 * k, 0.0, 0.0, float(k), 0.1 * k, 0.1 * k) for k in range(8, -1, -1)]
    before = ViewHistory((View.none(),) * len(rows), np.array(rows))
    now = (0.9, 0.0), 9.0
    assert len(remembered(before, ViewHistory(), (0.9, 0.9), now, kept).views) == left


def test_where_something_is_seen_the_disc_of_the_start_is_not_free() -> None:
    scan = LaserScan(0.0, -0.5, 0.01, 0.0, 5.0, np.full(101, 0.2))
    begun = InitialFreeDisc.of_radius(0.3).cut_by(view_of(scan, HERE).chords, HERE)
    for x, free in ((0.25, False), (0.15, True), (-0.25, True), (-0.31, False)):
        part = np.array([(x, -0.01), (x + 0.01, -0.01), (x, 0.01)])
        assert seen_by(at_once(begun, HERE, 0.0), part) == free


def test_in_another_frame_looks_know_the_same() -> None:
    rng, frame = np.random.default_rng(1), np.array((1.0, -2.0, 2.5))
    look = view_of(cast(scattered(rng), np.zeros(3)), HERE)
    there = look.transformed(frame)
    also = at_once(look, HERE, 0.0).transformed(frame)
    np.testing.assert_allclose(there.pose, also.rows[0, :3])
    np.testing.assert_allclose(there.visible_ranges, look.visible_ranges, atol=1e-9)
    moved = replace_fields(look, robot_pose=np.array(there.pose))
    np.testing.assert_allclose(moved.chords.center, frame[:2])


def test_the_disc_of_the_start_is_a_view_that_ends_at_what_is_seen() -> None:
    wall = np.array(((0.2, -0.1, 0.2, 0.1), (-0.1, 0.25, 0.1, 0.25)))
    seen = Chords(wall, np.array((True, False)), np.ones(2, bool), np.zeros(2))  # the second hides without being one
    begun = InitialFreeDisc.of_radius(0.3).cut_by(seen, HERE)
    ranges = begun.visible_ranges
    assert ranges[0] == pytest.approx(0.2) and ranges[BINS // 4] == 0.3 == ranges.max()
    beams = begun.beams
    assert np.array_equal(beams.distances, ranges) and not (beams.kinds & 1).any()
    assert beams.seam < math.inf and beams.increment == pytest.approx(2.0 * math.pi / BINS)
