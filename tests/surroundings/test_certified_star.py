"""The certified star of the recent scans, and what surroundings know beside it."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_starnav.geometry.footprint import disc
from drake_starnav.geometry.se2 import transform_points
from drake_starnav.lidar.laser_scan import DYNAMIC, LaserScan
from drake_starnav.lidar.mounts import ON_AXIS
from drake_starnav.surroundings.certified_star import CertifiedStar, certify_star
from drake_starnav.surroundings.erosion import smooth_distances
from drake_starnav.surroundings.recent_hits import RECENT_SCANS, Hits
from drake_starnav.surroundings.surroundings import NEAR_HIT_RANGE, Surroundings, observe
from drake_starnav.surroundings.view import View, ViewParams, make_view
from drake_starnav.surroundings.view_history import Odometer, ViewHistory
from drake_starnav.utils.snapshot import replace_fields
from drake_starnav.worlds.world import World
from tests.helpers.scans import MARGINS, RADIUS, cast, observe_scan, scattered, seeds, segment_distance

SAFE = RADIUS + 0.01
REACH = 1.2


def driven(seed: int, poses: int = 5, beams: int = 360) -> tuple[Surroundings, LaserScan, np.ndarray]:
    """The surroundings after some scans along a random path near the origin of a random world, and the last scan."""
    rng = np.random.default_rng(seed)
    world = scattered(rng, discs=12, clear=0.6)
    pose, seen = np.array((0.0, 0.0, rng.uniform(-4.0, 4.0))), Surroundings.unknown()
    for _ in range(poses):
        pose = pose + rng.uniform(-0.04, 0.04, 3)
        scan = cast(world, pose, beams=beams)
        seen = observe_scan(scan, pose, SAFE, REACH, seen)
    return seen, scan, pose


@settings(max_examples=25)
@given(seeds, st.sampled_from([90, 360, 500]))
def test_contained_points_are_clear_of_all_remembered_hits_and_so_is_the_way_there(seed, beams):
    seen, _, _ = driven(seed, beams=beams)
    star = seen.certified_star
    points = star.center + np.random.default_rng(seed).uniform(-1.3, 1.3, (800, 2))
    inside = star.union.contains(points)
    assert inside.any() and not inside.all()
    hits = seen.recent_hits.hits.points
    assert segment_distance(hits[None], star.center, points[inside][:, None]).min() > SAFE - 1e-9
    assert np.hypot(*(points[inside] - star.center).T).max() <= REACH


def test_the_hits_of_the_last_scans_are_kept_and_never_change():
    scans = [LaserScan(0.0, -math.pi, math.pi / 2, 0.0, 5.0, np.full(4, 1.0 + 0.1 * k)) for k in range(8)]
    seen = [Surroundings.unknown()]
    for scan in scans:
        seen.append(observe_scan(scan, np.zeros(3), SAFE, REACH, seen[-1]))
    recent = [each.recent_hits for each in seen]
    assert [len(each.counts) for each in recent] == [min(k, RECENT_SCANS) for k in range(9)]
    (points, half_chords), counts = recent[-2].hits, recent[-2].counts
    assert np.hypot(*points[::4].T) == pytest.approx([1.2, 1.3, 1.4, 1.5, 1.6]) and set(counts) == {4}
    assert recent[-1].counts[-1] == 4 and len(points) == len(half_chords) == sum(counts)
    far = observe_scan(LaserScan(0.0, -math.pi, math.pi / 2, 0.0, 5.0, np.full(4, 4.0)), np.zeros(3), SAFE, REACH)
    assert far.recent_hits.counts == (0,)  # 4 m is beyond the reach that matters


def test_in_another_frame_it_certifies_the_same() -> None:
    frame, (seen, _, pose) = np.array((1.0, -2.0, 2.5)), driven(3)
    other = driven(4)[0].view
    known = ViewHistory.of_one_time((other,), ((0.5, 0.2, 1.0),), 0.0, Odometer())
    seen = replace_fields(seen, current_views=seen.current_views.followed_by(known), past_views=known)
    star, there = seen.certified_star, seen.transformed(frame)
    np.testing.assert_allclose(
        there.recent_hits.hits.points, transform_points(frame, seen.recent_hits.hits.points), atol=1e-12
    )
    points = pose[:2] + np.random.default_rng(0).uniform(-1.0, 1.0, (500, 2))
    assert 50 < star.union.contains(points).sum() < 450
    assert (there.certified_star.union.contains(transform_points(frame, points)) == star.union.contains(points)).all()
    for one, same in (
        (there.near_hits, seen.near_hits),
        (there.certified_star.boundary.points, star.boundary.points),
        (there.view.own_hits, seen.view.own_hits),
        (there.view.further_hits, seen.view.further_hits),
    ):
        np.testing.assert_allclose(one, transform_points(frame, same))
    for row in (there.current_views.rows[1], there.past_views.rows[0]):
        np.testing.assert_allclose(row[:2], transform_points(frame, known.rows[:, :2])[0])


def test_the_star_knows_where_its_scans_were_taken_and_what_distance_it_keeps() -> None:
    scans = [dataclasses.replace(all_around(b0_360=0.8), time=time) for time in (1.5, 2.5)]
    seen, pose = Surroundings.unknown(), np.array((1.0, 2.0, 0.5))
    for scan in scans:
        seen = observe_scan(scan, pose, SAFE, REACH, seen)
    star, hits = seen.certified_star, seen.certified_star.boundary.points
    assert (seen.previous_time, seen.time) == (1.5, 2.5)
    assert star.radius == SAFE and tuple(star.center) == (1.0, 2.0)
    assert star.union.size == 1 and star.union.slopes.size == 0  # nothing is modulated by it
    np.testing.assert_allclose(np.hypot(*(hits - pose[:2]).T), 0.8)
    np.testing.assert_allclose(hits[0], pose[:2] - 0.8 * np.array((math.cos(0.5), math.sin(0.5))))


def test_averaged_ranges_bound_the_star_but_measured_ones_are_remembered() -> None:
    margins = dataclasses.replace(MARGINS, safety=SAFE - RADIUS, safety_range=REACH, average_scans=True)
    seen, pose, shape = Surroundings.unknown(), np.zeros(3), disc(RADIUS)
    for away in (0.60, 0.62):
        view = make_view(all_around(b0_360=away), ON_AXIS, pose, None, ViewParams(shape))
        seen = observe(seen, [view], None, shape, margins)
    star = seen.certified_star
    np.testing.assert_allclose(np.hypot(*star.boundary.points.T), 0.61, atol=1e-4)
    np.testing.assert_allclose(np.hypot(*seen.recent_hits.hits.points.T), np.repeat((0.60, 0.62), 360))
    np.testing.assert_allclose(np.hypot(*seen.near_hits.T), 0.62)
    assert star.values == pytest.approx(np.full(len(star.values), 0.61 - SAFE), abs=1e-3)


@pytest.mark.parametrize("between", [-math.inf, math.nan])
def test_what_touches_the_lidar_is_a_millimetre_away_along_its_beam(between: float) -> None:
    """Also what a beam between two such beams has lost."""
    seen = all_around(b269_270=-math.inf, b270_271=between, b271_272=-math.inf)
    hits = safe_star(seen).boundary.points
    bearings = np.radians(np.array((89.0, 90.0, 91.0)))
    found = hits[np.argsort(-hits[:, 0])]
    np.testing.assert_allclose(found, 0.001 * np.column_stack((np.cos(bearings), np.sin(bearings))), atol=1e-9)


def test_near_hits_are_those_of_the_filtered_scan_close_by():
    seen, scan, pose = driven(3)
    filtered = smooth_distances(scan)
    near = filtered < NEAR_HIT_RANGE * SAFE
    away = np.hypot(*(seen.near_hits - pose[:2]).T)
    np.testing.assert_allclose(away, filtered[near])


def test_outside_the_field_of_view_nothing_is_certified():
    pose = np.array((1.0, 2.0, 0.5))
    scan = LaserScan(0.0, -math.pi / 2, math.pi / 180, 0.0, 5.0, np.full(181, np.inf))
    star = observe_scan(scan, pose, SAFE, REACH).certified_star
    ahead, behind = (pose[:2] + r * np.array((math.cos(0.5), math.sin(0.5))) for r in (1.19, -0.01))
    assert star.union.contains(np.array((ahead, behind))).tolist() == [True, False]


TURNS = {
    "both ends": (2.0 * math.pi, 361),
    "6.28": (6.28, 360),
    "single precision": (float(np.float32(2.0 * math.pi / 719)) * 719, 720),
    "half a degree short": (math.radians(359.5), 1440),
    "clockwise": (-6.28, 360),
}
"""Angle from the first to the last beam, rad, and the number of beams, of lidars that look all around."""


@pytest.mark.parametrize("turn", TURNS.values(), ids=TURNS)
@settings(max_examples=8)
@given(seeds, st.sampled_from([0.0, 0.5 * math.pi, math.pi]) | st.floats(-7.0, 7.0))
def test_a_seam_is_no_edge_of_the_view_wherever_it_lies(turn, seed, first):
    span, beams = turn
    world, pose = scattered(np.random.default_rng(seed), discs=12, clear=0.6), np.array((0.0, 0.0, 0.3))
    scan, whole = cast(world, pose, beams=beams, angle_min=first, angle_increment=span / (beams - 1)), cast(world, pose)
    star, usual = (observe_scan(seen, pose, SAFE, REACH).certified_star for seen in (scan, whole))
    theta = np.linspace(-math.pi, math.pi, 500)
    along = np.column_stack((np.cos(theta), np.sin(theta)))
    reached = [s.union.contains(0.4 * along) for s in (star, usual)]
    assert (reached[0] == reached[1]).mean() > 0.95
    samples = star.bearing_0 + 2.0 * math.pi / len(star.values) * np.arange(len(star.values))
    inside = star.values[:, None] * np.column_stack((np.cos(samples), np.sin(samples)))
    assert segment_distance(scan.points(pose)[None], star.center, inside[:, None]).min() > SAFE - 1e-9


def test_what_a_moving_obstacle_hides_at_the_seam_is_not_certified():
    step = math.radians(359.4) / 1439  # the seam is as wide as two beams
    ranges, motion = np.full(1440, np.inf), np.zeros(1440, np.int8)
    ranges[[0, 1, -1, -2]], motion[[0, 1, -1, -2]] = 1.0, DYNAMIC
    star = safe_star(LaserScan(0.0, 0.0, step, 0.0, 5.0, ranges, motion=motion))
    theta = star.bearing_0 + np.radians(np.linspace(-0.9, 0.3, 50))
    assert star.values.max() == REACH
    assert not star.union.contains(1.05 * np.column_stack((np.cos(theta), np.sin(theta)))).any()


def test_a_robot_too_close_to_a_hit_may_only_move_away():
    ranges = np.full(360, np.inf)
    ranges[180] = SAFE - 0.005
    scan = LaserScan(0.0, -math.pi, 2.0 * math.pi / 360, 0.0, 5.0, ranges)
    star = safe_star(scan)
    angle = star.bearing_0 + 2.0 * math.pi / len(star.values) * np.arange(len(star.values))
    assert (star.values[np.cos(angle) > -1e-9] == 0.0).all()
    assert (star.values[np.cos(angle) < -1e-9] == REACH).all()


def safe_star(scan: LaserScan, reach: float = REACH) -> CertifiedStar:
    return observe_scan(scan, np.zeros(3), SAFE, reach).certified_star


def all_around(range_max: float = 5.0, **ranges: float) -> LaserScan:
    """A scan without returns except for some beams, b<number>_<number> with their range, m."""
    seen = np.full(360, np.inf)
    for name, value in ranges.items():
        first, last = map(int, name[1:].split("_"))
        seen[first:last] = value
    return LaserScan(0.0, -math.pi, 2.0 * math.pi / 360, 0.0, range_max, seen, lost_beams=True)


def test_behind_lost_beams_nothing_is_certified() -> None:
    """A round wall 0.8 m away, of which an eighth of the beams is lost."""
    star = safe_star(all_around(b0_360=0.8, b160_205=math.nan))
    assert star.values.max() <= 0.8 - SAFE + 1e-9
    assert np.diff(np.sort(np.arctan2(*star.boundary.points.T[::-1]))).max() < 1.01 * 2.0 * math.pi / 360
    assert len(safe_star(all_around(b180_181=math.nan)).boundary.points) == 0  # nothing is made up in the open


@pytest.mark.parametrize(
    ("range_max", "reach", "known"), [(0.9, 1.2, 0.9), (5.0, 1.2, 1.72), (5.0, 9.0, 5.0), (0.8 * SAFE, 1.2, 0.8 * SAFE)]
)
def test_no_more_is_certified_than_the_lidar_sees(range_max: float, reach: float, known: float) -> None:
    seen = observe_scan(all_around(range_max), np.zeros(3), SAFE, reach)
    star = seen.certified_star
    assert seen.view.reach == pytest.approx(known)
    assert star.values == pytest.approx(np.full(len(star.values), min(max(range_max - SAFE, 0.0), reach)))


def test_no_scan_certifies_no_motion():
    seen = Surroundings.unknown()
    assert not seen.has_views and seen.time == seen.previous_time == -math.inf
    assert not len(seen.near_hits) and not len(seen.recent_hits.hits.points)
    assert not seen.certified_star.union.contains(np.array([(0.001, 0.0)]))[0]
    assert not seen.keeps_clear(np.zeros((2, 3)), disc(RADIUS), 0.0)


def test_a_disc_needs_no_other_look_only_where_it_drives_straight_out_of_what_it_covers() -> None:
    """Elsewhere it would sweep unobserved space: here a post beside the field of view, 0.45 m ahead."""
    world = World("post", (0, 0, 0), (0, 0), cylinders=[(0.45, -0.2, 0.05)])
    view = {"beams": 270, "angle_min": -0.3, "angle_increment": math.radians(1.0)}
    scan, pose = cast(world, **view), np.zeros(3)
    assert not scan.hits.any()
    star = observe_scan(scan, pose, SAFE, REACH).certified_star
    _, (bearing_0,), (values,) = star.seen_part
    bearing = bearing_0 + 2.0 * math.pi / len(values) * np.arange(len(values))
    edge = scan.angle_min + np.array((math.radians(90.0), math.radians(179.0)))
    inside = (bearing >= edge[0]) & (bearing <= edge[1])
    assert (values[~inside] == 0.0).all() and (values[inside] > 0.5).all()
    assert not star.is_full_circle


def test_what_was_seen_before_a_time_can_be_left_out() -> None:
    past = ViewHistory((View.none(),) * 3, np.array([(0.0, 0.0, 0.0, time, 0.0, 0.0) for time in (3.0, 2.0, 1.0)]))
    seen = replace_fields(Surroundings.unknown(), past_views=past)
    assert seen.without_views_before(0.5) is seen
    assert seen.without_views_before(1.5).past_views.times.tolist() == [3.0, 2.0]


@given(seeds)
def test_the_ends_of_rays_that_several_lidars_share_bound_what_is_certified(seed) -> None:
    """Also where no beam is lost, and none of the lidars' own hits is known."""
    scan, pose = cast(scattered(np.random.default_rng(seed), discs=12, clear=0.6), np.zeros(3)), np.zeros(3)
    image = dataclasses.replace(scan, free=np.where(scan.hits, scan.ranges, scan.range_max))
    star = certify_star(image, Hits(), pose, SAFE, REACH, (0.0, 2.0 * math.pi))
    bearings = star.bearing_0 + 2.0 * math.pi / len(star.values) * np.arange(len(star.values))
    ends = star.values[:, None] * np.column_stack((np.cos(bearings), np.sin(bearings)))
    hits = scan.points_at(scan.distances, scan.hits, pose)
    assert segment_distance(hits[None], star.center, ends[star.values > 0.0][:, None]).min() > SAFE - 1e-9
    known = Hits(np.array(((1.0, 0.0), (1.0, 0.1))), np.zeros(2))
    star = certify_star(image, known, pose, SAFE, REACH, (0.0, 2.0 * math.pi))
    assert len(star.boundary.points) == 2 + scan.hits.sum()
