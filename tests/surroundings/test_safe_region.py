import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_starnav.geometry.se2 import placed
from drake_starnav.lidar.laser_scan import DYNAMIC, LaserScan
from drake_starnav.lidar.mounts import ON_AXIS
from drake_starnav.surroundings.erosion import smoothed_distances
from drake_starnav.surroundings.looks import Known, Look
from drake_starnav.surroundings.safe_region import NEAR_HITS, CertifiedRegion, ScanMemory, certified_region
from drake_starnav.surroundings.views import hit_points
from drake_starnav.worlds.world import World
from tests.helpers.scans import RADIUS, cast, scattered, seeds, segment_distance

SAFE = RADIUS + 0.01
REACH = 1.2
KEPT = REACH + 2.0 * SAFE, 5


def driven(seed: int, poses: int = 5, beams: int = 360) -> tuple[CertifiedRegion, ScanMemory, LaserScan, np.ndarray]:
    """The certified region after some scans along a random path near the origin of a random world."""
    rng = np.random.default_rng(seed)
    world = scattered(rng, discs=12, clear=0.6)
    pose, memory = np.array((0.0, 0.0, rng.uniform(-4.0, 4.0))), ScanMemory()
    for _ in range(poses):
        pose = pose + rng.uniform(-0.04, 0.04, 3)
        scan = cast(world, pose, beams=beams)
        star, memory = certified_region(memory, scan, smoothed_distances(scan), pose, SAFE, REACH, KEPT)
    return star, memory, scan, pose


@settings(max_examples=25)
@given(seeds, st.sampled_from([90, 360, 500]))
def test_contained_points_are_clear_of_all_remembered_hits_and_so_is_the_way_there(seed, beams):
    star, memory, _, _ = driven(seed, beams=beams)
    points = star.center + np.random.default_rng(seed).uniform(-1.3, 1.3, (800, 2))
    inside = star.alone.contains(points)
    assert inside.any() and not inside.all()
    hits = memory.points
    assert segment_distance(hits[None], star.center, points[inside][:, None]).min() > SAFE - 1e-9
    assert np.hypot(*(points[inside] - star.center).T).max() <= REACH


@settings(max_examples=20)
@given(seeds)
def test_more_scans_never_certify_more(seed):
    star, _, scan, pose = driven(seed)
    alone, _ = certified_region(ScanMemory(), scan, smoothed_distances(scan), pose, SAFE, REACH, KEPT)
    assert (star.values <= alone.values + 1e-12).all()


def test_the_memory_keeps_the_last_scans_and_never_changes():
    scans = [LaserScan(0.0, -math.pi, math.pi / 2, 0.0, 5.0, np.full(4, 1.0 + k)) for k in range(4)]
    memory = ScanMemory()
    for count, kept in ((5, (1.0, 2.0, 3.0)), (3, (1.0, 2.0, 3.0)), (1, (3.0,))):
        memories = [ScanMemory()]
        for scan in scans:
            looked = scan, scan.distances, np.zeros(3), SAFE, REACH
            memories.append(certified_region(memories[-1], *looked, (3.5, count))[1])
        assert [len(m.counts) for m in memories] == [min(k, count) for k in range(5)]
        memory = memories[-2]
        assert tuple(np.hypot(*memory.points[::4].T).tolist()) == kept and set(memory.counts) == {4}
        assert memories[-1].counts[-1] == 0  # 4 m is beyond the reach that matters
        assert len(memory.points) == len(memory.half_gaps) == sum(memory.counts)


def test_in_another_frame_it_certifies_the_same() -> None:
    frame, (star, _, _, pose) = np.array((1.0, -2.0, 2.5)), driven(3)
    known = Known.of((driven(4)[0].look,), ((0.5, 0.2, 1.0),), 0.0)
    star = dataclasses.replace(star, newest=star.newest.and_then(known), earlier=known)
    moved = star.moved(frame)
    points = pose[:2] + np.random.default_rng(0).uniform(-1.0, 1.0, (500, 2))
    assert 50 < star.alone.contains(points).sum() < 450
    assert (moved.alone.contains(placed(frame, points)) == star.alone.contains(points)).all()
    for ends in ("near_hits", "hits"):
        np.testing.assert_allclose(getattr(moved, ends), placed(frame, getattr(star, ends)))
    np.testing.assert_allclose(moved.look.hits, placed(frame, star.look.hits))
    for there in (moved.newest.rows[1], moved.earlier.rows[0]):
        np.testing.assert_allclose(there[:2], placed(frame, known.rows[:, :2])[0])


def test_the_latest_scan_is_kept_even_if_none_is_asked_for() -> None:
    scan = all_around(b0_360=0.8)
    _, memory = certified_region(ScanMemory(), scan, scan.distances, np.zeros(3), SAFE, REACH, (3.0, 0))
    _, memory = certified_region(memory, scan, scan.distances, np.zeros(3), SAFE, REACH, (3.0, 0))
    assert memory.counts == (360,) and len(memory.points) == 360


def test_the_star_knows_when_and_where_its_scans_were_taken_and_what_distance_it_keeps() -> None:
    scans = [dataclasses.replace(all_around(b0_360=0.8), time=time) for time in (1.5, 2.5)]
    memory, pose = ScanMemory(), np.array((1.0, 2.0, 0.5))
    for scan in scans:
        star, memory = certified_region(memory, scan, scan.distances, pose, SAFE, REACH, KEPT)
    assert (star.previous, star.time, memory.time) == (1.5, 2.5, 2.5)
    assert star.radius == SAFE and tuple(star.center) == (1.0, 2.0)
    assert star.alone.size == 1 and star.alone.slopes.size == 0  # nothing is modulated by it
    np.testing.assert_allclose(np.hypot(*(star.hits - pose[:2]).T), 0.8)
    np.testing.assert_allclose(star.hits[0], pose[:2] - 0.8 * np.array((math.cos(0.5), math.sin(0.5))))


def test_what_is_remembered_may_differ_from_what_was_measured() -> None:
    """Averaged ranges bound the star; the planner's near hits are the smoothed ones."""
    scan = all_around(b0_360=0.8)
    averaged, smoothed = hit_points(all_around(b0_360=0.7), ON_AXIS), np.full(360, 0.9)
    star, memory = certified_region(ScanMemory(), scan, smoothed, np.zeros(3), SAFE, REACH, KEPT, averaged)
    for points, away in ((star.hits, 0.7), (memory.points, 0.7), (star.near_hits, 0.9)):
        np.testing.assert_allclose(np.hypot(*points.T), away)
    assert star.values == pytest.approx(np.full(len(star.values), 0.7 - SAFE), abs=1e-3)


@pytest.mark.parametrize("between", [-math.inf, math.nan])
def test_what_touches_the_lidar_is_a_millimetre_away_along_its_beam(between: float) -> None:
    """Also what a beam between two such beams has lost."""
    seen = all_around(b269_270=-math.inf, b270_271=between, b271_272=-math.inf)
    hits = safe_star(seen).hits
    bearings = np.radians(np.array((89.0, 90.0, 91.0)))
    found = hits[np.argsort(-hits[:, 0])]
    np.testing.assert_allclose(found, 0.001 * np.column_stack((np.cos(bearings), np.sin(bearings))), atol=1e-9)


def test_a_lidar_that_sees_no_farther_than_the_robot_certifies_nothing() -> None:
    assert (safe_star(all_around(0.8 * SAFE)).values == 0.0).all()


def test_the_star_holds_all_remembered_hits():
    star, memory, _, _ = driven(5)
    np.testing.assert_array_equal(star.hits, memory.points)
    assert star.seen and len(star.half_gaps) == len(star.hits)


def test_near_hits_are_those_of_the_filtered_scan_close_by():
    star, _, scan, pose = driven(3)
    filtered = smoothed_distances(scan)
    near = filtered < NEAR_HITS * SAFE
    away = np.hypot(*(star.near_hits - pose[:2]).T)
    np.testing.assert_allclose(away, filtered[near])


def test_outside_the_field_of_view_nothing_is_certified():
    pose = np.array((1.0, 2.0, 0.5))
    scan = LaserScan(0.0, -math.pi / 2, math.pi / 180, 0.0, 5.0, np.full(181, np.inf))
    star, _ = certified_region(ScanMemory(), scan, scan.distances, pose, SAFE, REACH, KEPT)
    ahead, behind = (pose[:2] + r * np.array((math.cos(0.5), math.sin(0.5))) for r in (1.19, -0.01))
    assert star.alone.contains(np.array((ahead, behind))).tolist() == [True, False]


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
    star, usual = (
        certified_region(ScanMemory(), seen, smoothed_distances(seen), pose, SAFE, REACH, KEPT)[0]
        for seen in (scan, whole)
    )
    theta = np.linspace(-math.pi, math.pi, 500)
    along = np.column_stack((np.cos(theta), np.sin(theta)))
    reached = [s.alone.contains(0.4 * along) for s in (star, usual)]
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
    assert not star.alone.contains(1.05 * np.column_stack((np.cos(theta), np.sin(theta)))).any()


def test_a_robot_too_close_to_a_hit_may_only_move_away():
    ranges = np.full(360, np.inf)
    ranges[180] = SAFE - 0.005
    scan = LaserScan(0.0, -math.pi, 2.0 * math.pi / 360, 0.0, 5.0, ranges)
    star, _ = certified_region(ScanMemory(), scan, scan.distances, np.zeros(3), SAFE, REACH, KEPT)
    angle = star.bearing_0 + 2.0 * math.pi / len(star.values) * np.arange(len(star.values))
    assert (star.values[np.cos(angle) > -1e-9] == 0.0).all()
    assert (star.values[np.cos(angle) < -1e-9] == REACH).all()


def safe_star(scan: LaserScan, reach: float = REACH) -> CertifiedRegion:
    return certified_region(ScanMemory(), scan, scan.distances, np.zeros(3), SAFE, reach, (reach + 2.0 * SAFE, 5))[0]


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
    assert np.diff(np.sort(np.arctan2(star.hits[:, 1], star.hits[:, 0]))).max() < 1.01 * 2.0 * math.pi / 360
    assert len(safe_star(all_around(b180_181=math.nan)).hits) == 0  # nothing is made up in the open


@pytest.mark.parametrize(("range_max", "reach", "known"), [(0.9, 1.2, 0.9), (5.0, 1.2, 1.72), (5.0, 9.0, 5.0)])
def test_no_more_is_certified_than_the_lidar_sees(range_max: float, reach: float, known: float) -> None:
    star = safe_star(all_around(range_max), reach)
    assert star.look.reach == pytest.approx(known)
    assert star.values == pytest.approx(np.full(len(star.values), min(range_max - SAFE, reach)))


def test_hits_know_how_far_apart_they_are() -> None:
    star = safe_star(all_around(b0_360=0.8))
    assert star.half_gaps == pytest.approx(np.full(360, 0.8 * math.sin(math.pi / 360)))


def test_no_scan_certifies_no_motion():
    star, memory = CertifiedRegion.none(), ScanMemory()
    assert not star.seen and star.time == star.previous == memory.time == -math.inf
    assert star.hits.shape == star.near_hits.shape == memory.points.shape == (0, 2)
    assert len(star.look.chords.ends) == len(star.looks.places) == 0
    assert star.half_gaps.shape == memory.half_gaps.shape == (0,) and memory.counts == ()
    assert star.center.shape == (2,) and star.look.reach == 0.0 and star.radius == 0.0
    assert not star.alone.contains(np.array([(0.001, 0.0)]))[0]


def test_a_disc_needs_no_other_look_only_where_it_drives_straight_out_of_what_it_covers() -> None:
    """Elsewhere it would sweep unobserved space: here a post beside the field of view, 0.45 m ahead."""
    world = World("post", (0, 0, 0), (0, 0), cylinders=[(0.45, -0.2, 0.05)])
    view = {"beams": 270, "angle_min": -0.3, "angle_increment": math.radians(1.0)}
    scan, pose = cast(world, **view), np.zeros(3)
    assert not scan.hits.any()
    star, _ = certified_region(ScanMemory(), scan, scan.distances, pose, SAFE, REACH, KEPT)
    _, (bearing_0,), (values,) = star.enough
    bearing = bearing_0 + 2.0 * math.pi / len(values) * np.arange(len(values))
    edge = scan.angle_min + np.array((math.radians(90.0), math.radians(179.0)))
    inside = (bearing >= edge[0]) & (bearing <= edge[1])
    assert (values[~inside] == 0.0).all() and (values[inside] > 0.5).all()
    assert not star.sees_around


def test_what_was_seen_before_a_time_can_be_left_out() -> None:
    earlier = Known((Look.none(),) * 3, np.array([(0.0, 0.0, 0.0, time, 0.0, 0.0) for time in (3.0, 2.0, 1.0)]))
    star = dataclasses.replace(CertifiedRegion.none(), earlier=earlier)
    assert star.since(0.5) is star and star.since(1.5).earlier.rows[:, 3].tolist() == [3.0, 2.0]


@given(seeds)
def test_the_ends_of_rays_that_several_lidars_share_bound_what_is_certified_and_hide_what_is_behind(seed) -> None:
    """Also where no beam is lost, and none of the lidars' own hits is known."""
    scan, pose = cast(scattered(np.random.default_rng(seed), discs=12, clear=0.6), np.zeros(3)), np.zeros(3)
    merged = dataclasses.replace(scan, free=np.where(scan.hits, scan.ranges, scan.range_max))
    unknown = np.zeros((0, 2)), np.zeros(0)
    star, _ = certified_region(ScanMemory(), merged, merged.distances, pose, SAFE, REACH, KEPT, hits=unknown)
    bearings = star.bearing_0 + 2.0 * math.pi / len(star.values) * np.arange(len(star.values))
    ends = star.values[:, None] * np.column_stack((np.cos(bearings), np.sin(bearings)))
    hits = scan.points_at(scan.distances, scan.hits, pose)
    assert segment_distance(hits[None], star.center, ends[star.values > 0.0][:, None]).min() > SAFE - 1e-9
    known = np.array(((1.0, 0.0), (1.0, 0.1))), np.zeros(2)
    star, _ = certified_region(ScanMemory(), merged, merged.distances, pose, SAFE, REACH, KEPT, hits=known)
    assert len(star.look.hits) == 2 and len(star.hits) == 2 + scan.hits.sum()
