"""Alignment with earlier scans corrects the errors of the odometry, and nothing else."""

import dataclasses
import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_starnav.geometry.se2 import compose_poses, find_pose_in_frame, invert_pose, transform_points
from drake_starnav.localization.scan_matching import (
    Keyframe,
    OdometryError,
    ScanMap,
    Surfaces,
    Travel,
    align_points,
    match_scan,
)
from drake_starnav.station.planar_localization import add_drift
from drake_starnav.worlds.world import World
from tests.helpers.scans import cast, noisy, scattered, seeds


def arc_of_walls(radius, sides, missing):
    """The sides of a regular polygon about the origin, 6 cm thick, but for the last ones."""
    angle = 2.0 * math.pi / sides * np.arange(sides + 1 - missing)
    corners = np.column_stack((np.cos(angle), np.sin(angle)))
    return [np.array((a, b, 1.1 * b, 1.1 * a)) * radius for a, b in itertools.pairwise(corners)]


BOX = World("box", (0, 0, 0), (0, 0), bounds=(-3.0, -2.0, 3.0, 2.0))
ROOM = World("room", (0, 0, 0), (0, 0), cylinders=[(1.0, 1.2, 0.3), (-1.2, 0.9, 0.2)], bounds=(-3.0, -2.0, 3.0, 2.0))
CORRIDOR = World("corridor", (0, 0, 0), (0, 0), bounds=(-50.0, -1.0, 50.0, 1.0))
RING = World("ring", (0, 0, 0), (0, 0), polygons=tuple(arc_of_walls(0.6, 12, 2)), bounds=(-4.0, -4.0, 4.0, 4.0))
"""Twelve walls about the robot, two of which are open."""
NOISE = 0.01
NOISY = OdometryError(0.02, 0.05, 0.03)


def found(scan, points, guess, deviation, gate=0.3):
    return align_points(points, guess, np.full(3, 1.0 / deviation**2), Surfaces.of(scan, 0.1), 0.01, gate, 0.1)


def test_lines_follow_walls_but_no_corner() -> None:
    scan = cast(BOX)
    points, anchor, normal, *_ = Surfaces.of(scan, 0.1)
    on_line = np.hypot(*normal.T) > 0.5
    assert on_line.mean() > 0.95
    away = ((points - anchor) * normal).sum(axis=1)
    assert np.abs(away[on_line]).max() < 0.01
    axis = np.abs(normal[on_line]).max(axis=1)
    corner = np.hypot(*(np.abs(points[on_line]) - (3.0, 2.0)).T) < 0.4
    assert axis[~corner] == pytest.approx(1.0)
    assert not on_line[np.hypot(*(np.abs(points) - (3.0, 2.0)).T) < 0.02].any()


@given(seeds)
@settings(max_examples=15)
def test_aligned_points_return_the_pose(seed):
    rng = np.random.default_rng(seed)
    world = scattered(rng)
    pose = np.array((*rng.uniform(-0.15, 0.15, 2), rng.uniform(-0.1, 0.1)))
    points = cast(world, pose).points()
    guess = pose + np.array((*rng.uniform(-0.1, 0.1, 2), rng.uniform(-0.05, 0.05)))
    off = find_pose_in_frame(pose, found(cast(world), points, guess, 0.1)[0])
    assert math.hypot(*off[:2]) < 0.01 and abs(off[2]) < math.radians(0.5)


@given(seeds, st.floats(0.0, 0.4))
@settings(max_examples=10)
def test_lost_beams_end_no_surface(seed, lost):
    """Of the hits nearly as many have a line as if no beam were lost, also where noise needs a long line."""
    rng = np.random.default_rng(seed)
    scan = noisy(cast(RING), 0.03, rng)
    ranges = np.where(rng.random(len(scan.ranges)) < lost, np.nan, scan.ranges)
    rare = dataclasses.replace(scan, ranges=ranges, lost_beams=True)
    normals = (
        Keyframe.of(each, np.zeros(3), Travel(np.zeros(3)), NOISY).surfaces.normal[np.isfinite(ranges)]
        for each in (scan, rare)
    )
    all_lines, lines = (np.hypot(*normal.T).mean() for normal in normals)
    assert all_lines > 0.8 and lines > 0.9 * all_lines


def test_certain_guess_is_kept() -> None:
    scan, pose = cast(BOX), np.array((0.1, -0.05, 0.05))
    points, guess = cast(BOX, pose).points(), np.zeros(3)
    assert found(scan, points, guess, 1e-9)[0] == pytest.approx(guess, abs=1e-6)
    right = found(scan, points, guess, 0.1)
    assert right[0] == pytest.approx(pose, abs=2e-3) and right[1] > 0.95 * len(points)
    elsewhere = transform_points(invert_pose(pose), np.array([(x, 0.1 * x) for x in np.linspace(-1.5, 1.5, 50)]))
    assert found(scan, elsewhere, pose, 0.1)[1] == 0


def driven(world, poses, error, seed, jump=None, lost=0.0, **lidar):
    """The map after true poses (n, 3), 0.05 s apart, with odometry that drifts as declared; and where O puts the last.

    `jump` is (index, offset) of a jump of the odometry; a share `lost` of the beams is; `lidar` goes to `cast`.
    """
    rng = np.random.default_rng(seed)
    known, believed, before = ScanMap(), np.array(poses[0], dtype=float), poses[0]
    for k, pose in enumerate(poses):
        believed, before = add_drift(believed, before, pose, error.drift, seed), pose
        if jump is not None and jump[0] == k:
            believed = believed + (*jump[1], 0.0)
        scan = dataclasses.replace(noisy(cast(world, pose, **lidar), NOISE, rng), time=0.05 * k)
        if lost > 0.0:
            ranges = np.where(rng.random(len(scan.ranges)) < lost, np.nan, scan.ranges)
            scan = dataclasses.replace(scan, ranges=ranges, lost_beams=True)
        known = match_scan(known, scan, believed, error)
    return known, believed


def circling(turns, radius=0.35, step=0.035):
    """Poses on a circle about the origin, to the left."""
    angle = np.arange(0.0, 2.0 * math.pi * turns, step / radius)
    return np.column_stack((radius * np.cos(angle), radius * np.sin(angle), angle + 0.5 * math.pi))


def to_and_fro(length, times, step=0.04):
    """Poses on a line along x through the origin, turning on the spot at its ends."""
    x = np.arange(-0.5 * length, 0.5 * length, step)
    there = np.column_stack((x, np.zeros_like(x), np.zeros_like(x)))
    turn = np.arange(0.0, math.pi, 0.1)
    turns = np.column_stack((np.full_like(turn, x[-1]), np.zeros_like(turn), turn))
    back = there[::-1] + (0.0, 0.0, math.pi)
    around = np.column_stack((np.full_like(turn, x[0]), np.zeros_like(turn), math.pi + turn))
    lap = np.vstack((there, turns, back, around))
    return np.vstack([lap + (0.0, 0.0, 2.0 * math.pi * k) for k in range(times)])


@given(seeds)
@settings(max_examples=10)
def test_drift_is_corrected_to_a_tenth(seed):
    error = OdometryError(0.05, 0.0, NOISE)
    poses = circling(3, radius=0.25, step=0.025)
    known, believed = driven(scattered(np.random.default_rng(seed)), poses, error, seed)
    off, odometry = find_pose_in_frame(poses[-1], known.correct_pose(believed)), find_pose_in_frame(poses[-1], believed)
    assert abs(odometry[2]) > math.radians(45.0)
    assert abs(off[2]) < 0.1 * abs(odometry[2])
    assert math.hypot(*off[:2]) < 0.03


def test_errors_do_not_add_up_where_the_robot_comes_back():
    error = OdometryError(0.05, 0.0, NOISE)
    errors = []
    for times in (1, 4):
        poses = to_and_fro(3.0, times)
        known, believed = driven(ROOM, poses, error, 3)
        errors.append(find_pose_in_frame(poses[-1], known.correct_pose(believed)))
    assert max(math.hypot(*e[:2]) for e in errors) < 0.03
    assert max(abs(e[2]) for e in errors) < math.radians(0.6)
    assert len(known.keyframes) < 15


@pytest.mark.parametrize("offset", [(0.2, 0.0), (-0.1, 0.15), (0.05, 0.05)])
def test_a_jump_is_taken_back(offset):
    poses = to_and_fro(2.0, 1)
    known, believed = driven(ROOM, poses, OdometryError(0.0, 0.25, NOISE), 5, jump=(30, offset))
    assert math.hypot(*(believed[:2] - poses[-1, :2])) > 0.05
    assert math.hypot(*(known.correct_pose(believed)[:2] - poses[-1, :2])) < 0.03


LOOKS_AHEAD = {"beams": 241, "angle_min": -2.0 * math.pi / 3.0, "angle_increment": math.pi / 180.0}


@pytest.mark.parametrize("lidar", [{"lost": 0.3}, LOOKS_AHEAD], ids=["lost beams", "looks ahead only"])
def test_a_lidar_that_sees_less_corrects_as_well(lidar):
    poses = circling(2)
    known, believed = driven(ROOM, poses, OdometryError(0.05, 0.0, NOISE), 6, **lidar)
    assert abs(find_pose_in_frame(poses[-1], believed)[2]) > math.radians(30.0)
    off = find_pose_in_frame(poses[-1], known.correct_pose(believed))
    assert math.hypot(*off[:2]) < 0.05 and abs(off[2]) < math.radians(1.0)


@pytest.mark.parametrize(("drift", "jump"), [(0.02, 0.0), (0.0, 0.1), (0.0, 0.02), (0.02, 0.1)])
@pytest.mark.parametrize("back", [False, True])
def test_along_a_bare_corridor_the_odometry_is_believed(drift, jump, back):
    error = OdometryError(drift, jump, NOISE)
    x = np.arange(0.0, 6.0, 0.04)
    x = np.append(x, x[::-1]) if back else x
    poses = np.column_stack((x, np.zeros_like(x), np.zeros_like(x)))
    known, believed = driven(CORRIDOR, poses, error, 4)
    off = find_pose_in_frame(poses[-1], known.correct_pose(believed))
    assert abs(off[0]) <= drift * 6.0 * (2.0 if back else 1.0) + 0.01  # no worse than the odometry may be
    assert abs(off[1]) < 0.02 and abs(off[2]) < math.radians(0.5)  # and what walls tell is taken


def test_a_robot_that_stands_is_not_moved_about():
    rng = np.random.default_rng(0)
    error = OdometryError(0.02, 0.0, NOISE)
    known = match_scan(ScanMap(), noisy(cast(ROOM), NOISE, rng), np.zeros(3), error)
    for k in range(5):
        assert match_scan(known, noisy(cast(ROOM), NOISE, rng), np.array((0.002 * k, 0.0, 0.002 * k)), error) is known


def test_a_scan_that_hits_nothing_tells_nothing():
    known = match_scan(ScanMap(), cast(ROOM), np.zeros(3), OdometryError(0.02, 0.0, NOISE))
    empty = dataclasses.replace(cast(ROOM), ranges=np.full(360, np.inf))
    assert match_scan(known, empty, np.array((0.1, 0.0, 0.0)), OdometryError(0.02, 0.0, NOISE)) is known


@pytest.mark.parametrize(("length", "count"), [(0.6, 2), (0.02, 1)])
@pytest.mark.parametrize("yaw", [0.0, 1.5, 3.0])
def test_places_behind_a_screen_are_not_in_view(length, count, yaw):
    screen = np.array([(-length, -0.01), (length, -0.01), (length, 0.01), (-length, 0.01)]) * (0.5, 1.0) + (0.1, 0.0)
    world = dataclasses.replace(ROOM, polygons=(screen,))
    here, there = np.array((0.0, 0.2, 0.3)), np.array((0.0 if count == 2 else -0.1, -0.2, yaw))
    known = match_scan(ScanMap(), cast(world, here), here, OdometryError(0.02, 0.0, NOISE))
    assert len(match_scan(known, cast(world, there), there, OdometryError(0.02, 0.0, NOISE)).keyframes) == count


@pytest.mark.parametrize(("step", "count"), [(0.05, 1), (0.15, 2)])
def test_a_scan_of_which_little_fits_changes_no_pose(step, count):
    """Only a piece of a wall is where it was, and the odometry is off by 5 cm."""
    wall = np.array([(-0.6, -2.1), (0.6, -2.1), (0.6, -2.0), (-0.6, -2.0)])
    discs = [(0.9, 0.2, 0.3), (-0.5, 0.8, 0.2), (-0.7, -0.3, 0.2)]
    elsewhere = World("elsewhere", (0, 0, 0), (0, 0), cylinders=discs, polygons=(wall,))
    error = OdometryError(0.3, 0.0, NOISE)
    known = match_scan(ScanMap(), cast(ROOM), np.zeros(3), error)
    now = np.array((step, 0.0, 0.1))
    believed = now + (0.0, 0.05, 0.0)
    known = match_scan(known, dataclasses.replace(cast(elsewhere, now), time=0.05), believed, error)
    np.testing.assert_allclose(known.correct_pose(believed), believed, atol=1e-12)
    assert len(known.keyframes) == count


@pytest.mark.parametrize("jumps", [False, True])
def test_a_declared_jump_is_only_reckoned_with_at_the_step_that_jumps(jumps):
    """At the steps before and after it, scans that disagree a little with the odometry correct as much as without."""
    known = ScanMap()
    for k in range(6):
        believed = np.array((0.05 * k, 0.2 if jumps and k >= 4 else 0.0, 0.0))
        scan = dataclasses.replace(cast(ROOM, (0.05 * k, 0.01 * k, 0.0)), time=0.05 * k)
        with_jumps, without = (match_scan(known, scan, believed, OdometryError(0.0, j, NOISE)) for j in (0.25, 0.0))
        assert np.array_equal(with_jumps.correction, without.correction) == (k != 4 or not jumps)
        assert k == 0 or with_jumps.speed == pytest.approx([1.0, 0.0])
        known = with_jumps


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(-3.1, 3.1))
@settings(max_examples=10)
def test_where_the_frame_of_the_odometry_lies_does_not_matter(x, y, yaw):
    frame, poses = np.array((x, y, yaw)), circling(0.5)
    error = OdometryError(0.02, 0.0, NOISE)
    elsewhere, here = ScanMap(), ScanMap()
    for k, pose in enumerate(poses):
        scan = dataclasses.replace(cast(ROOM, pose), time=0.05 * k)
        here = match_scan(here, scan, pose, error)
        elsewhere = match_scan(elsewhere, scan, compose_poses(frame, pose), error)
    found = find_pose_in_frame(frame, elsewhere.correct_pose(compose_poses(frame, poses[-1])))
    assert found == pytest.approx(find_pose_in_frame(np.zeros(3), here.correct_pose(poses[-1])), abs=1e-3)


@given(seeds, st.floats(0.0, 0.2), st.integers(0, 20))
def test_travel_allows_what_the_odometry_may_hide_and_no_more(seed, drift, since):
    """Since any earlier time: the true step is allowed, and one that is off by twice the greatest error is not."""
    rng = np.random.default_rng(seed)
    poses = np.cumsum(np.column_stack((rng.uniform(-0.1, 0.1, (40, 2)), rng.uniform(-0.3, 0.3, 40))), axis=0)
    believed, slack = poses[0], np.full(3, 1e-3)  # steps are chords
    travels = [Travel(believed)]
    for before, pose in itertools.pairwise(poses):
        believed = add_drift(believed, before, pose, drift, seed)
        travels.append(travels[-1].extend(believed, 1.05 * drift / (1.0 - drift), 0.0))
    step, last, earlier = find_pose_in_frame(poses[since], poses[-1]), travels[-1], travels[since]
    assert last.can_have_made(earlier, step, slack)
    turn = 2.0 * (last.turn - earlier.turn + slack[2])
    shift = 2.0 * (last.shift - earlier.shift + last.way * turn + slack[0])
    assert not last.can_have_made(earlier, compose_poses(step, (0.0, 0.0, turn)), slack)
    assert not last.can_have_made(earlier, np.add(step, (shift, 0.0, 0.0)), slack)


@pytest.mark.parametrize(
    ("off", "turned", "drift", "last"),
    [((0.08, 0.0, 0.035), 0.0, 0.0, 0), (np.zeros(3), 0.12, 0.02, 1), (np.zeros(3), -0.12, 0.02, 1)],
)
def test_on_return_the_older_part_of_the_map_is_trusted_unless_the_odometry_rules_it_out(off, turned, drift, last):
    """The newer keyframe, and so the odometry as corrected by it, is 8 cm and 2 degrees off; or the older one looks as
    the room does from a robot that is turned by more than the odometry can err."""
    places, error = (np.zeros(3), np.array((0.6, 0.0, 0.0))), OdometryError(drift, 0.0, NOISE)
    poses, travels = (places[0], compose_poses(off, places[1])), [Travel(place, place[0]) for place in places]
    looks = zip((cast(ROOM, (0.0, 0.0, turned)), cast(ROOM, places[1])), poses, travels, strict=True)
    frames = tuple(Keyframe.of(scan, pose, travel, error) for scan, pose, travel in looks)
    known = ScanMap(frames, np.array([pose[:2] for pose in poses]), np.array(off), travels[1], 0.0, last=1)
    now = np.array((0.3, 0.0, 0.2))
    known = match_scan(known, dataclasses.replace(cast(ROOM, now), time=0.5), now, error)
    assert known.last == last
    assert find_pose_in_frame(now, known.correct_pose(now)) == pytest.approx((0.0, 0.0, 0.0), abs=0.01)
