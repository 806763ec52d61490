"""Messages as drivers send them: poses at the stamps of scans, and what is dropped."""

import dataclasses
import math

import numpy as np
import pytest

from drake_starnav import LaserScan, LidarParameters, Scenario
from drake_starnav.lidar.raycast import Fan, Shapes, cast_groups, make_segment_rows
from drake_starnav.runtime import Odometry
from drake_starnav.runtime.intake import (
    EXTRAPOLATION,
    PATIENCE,
    WITHDRAWN,
    Declared,
    Intake,
    describe_false_scan,
    estimate_state,
    extrapolate_pose,
    find_next_scan,
    interpolate_pose,
    make_canonical_scan,
    read_goal,
    restart_clock,
    take_messages,
    within_range,
)

LIDAR = LidarParameters(noise=0.0)
ONE = Declared.of(Scenario("one", None, lidar=LIDAR))
TWO = Declared.of(Scenario("two", None, lidar=LIDAR, lidars=(LIDAR, LIDAR)))
BOX = Shapes.of(
    [make_segment_rows(np.array([(-2, -2, 3, -2), (3, -2, 3, 2.5), (3, 2.5, -2, 2.5), (-2, 2.5, -2, -2)], float))]
)


def scan_at(pose, time=0.0, lidar=LIDAR) -> LaserScan:
    ranges = np.full(lidar.beams, math.inf)
    fan = tuple(Fan.regular(*lidar.field_of_view))
    cast_groups(tuple(BOX), np.array([pose], float), fan, ranges, lidar.range_max)
    return LaserScan(time, ranges=ranges, **lidar.scan_fields)


def arc(time: float, v: float = 0.8, omega: float = 0.5) -> Odometry:
    return Odometry(
        time, v / omega * math.sin(omega * time), v / omega * (1 - math.cos(omega * time)), omega * time, v, omega
    )


ARC = tuple(arc(0.02 * k) for k in range(51))


@pytest.mark.parametrize("time", [0.0, 0.005, 0.49, 0.999])
def test_poses_between_are_interpolated(time) -> None:
    assert interpolate_pose(ARC, time, 0.0) == pytest.approx(arc(time)[1:4], abs=1e-4)


@pytest.mark.parametrize(("end", "way"), [(1.0, 1.0), (0.0, -1.0)])
def test_poses_after_and_before_are_extrapolated_for_a_short_time(end, way) -> None:
    assert interpolate_pose(ARC, end + 0.02 * way, EXTRAPOLATION) == pytest.approx(arc(end + 0.02 * way)[1:4], abs=1e-6)
    assert interpolate_pose(ARC, end + 0.04 * way, EXTRAPOLATION) is None
    assert interpolate_pose((), 0.0, EXTRAPOLATION) is None


def test_an_omnidirectional_base_is_extrapolated_aside() -> None:
    assert extrapolate_pose(Odometry(0.0, 1.0, 2.0, math.pi / 2, 0.0, 0.0, 0.5), 0.1) == pytest.approx(
        (0.95, 2.0, math.pi / 2)
    )


def test_the_state_is_stale_after_patience() -> None:
    assert estimate_state(ARC, 1.0 + PATIENCE - 1e-6) == pytest.approx((*arc(1.1)[1:4], 0.8, 0.5), abs=1e-5)
    assert estimate_state(ARC, 1.0 + PATIENCE + 1e-3) is None
    assert estimate_state((), 0.0) is None


def test_a_scan_waits_for_its_pose() -> None:
    intake = take_messages(Intake.empty(1), 0.5, [scan_at((0, 0, 0), 0.49)], [arc(0.4)], ONE)
    intake, look = find_next_scan(intake, 0.5)
    assert look is None and len(intake.waiting) == 1
    intake = take_messages(intake, 0.52, [], [arc(0.5)], ONE)
    intake, look = find_next_scan(intake, 0.52)
    assert look.scan.time == 0.49 and look.pose == pytest.approx(arc(0.49)[1:4], abs=1e-3)
    assert find_next_scan(intake, 0.52)[1] is None


def test_scans_of_several_lidars_come_in_the_order_of_their_stamps() -> None:
    scans = [(0, scan_at((0, 0, 0), 0.45)), (1, scan_at((0, 0, 0), 0.44)), (0, scan_at((0, 0, 0), 0.47))]
    intake, found = take_messages(Intake.empty(2), 0.5, scans, ARC[:26], TWO), []
    while True:
        intake, look = find_next_scan(intake, 0.5)
        if look is None:
            break
        found.append((look.lidar, look.scan.time))
        assert look.pose == pytest.approx(arc(look.scan.time)[1:4], abs=1e-3)
    assert found == [(1, 0.44), (0, 0.45), (0, 0.47)] and intake.newest_stamps == (0.47, 0.44)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"ranges": np.full(360, np.nan), "lost_beams": True}, "all beams are lost"),
        ({"ranges": np.full(180, 1.0), "angle_increment": 2.0 * LIDAR.angle_increment}, "180 beams"),
        ({"ranges": np.full(180, 1.0)}, "spans 3.12 rad"),
        ({"range_max": 2.5}, "range_max 2.5 m"),
    ],
)
def test_what_a_scan_has_less_of_than_declared(change, said) -> None:
    assert said in describe_false_scan(dataclasses.replace(scan_at((0, 0, 0)), **change), LIDAR)
    assert describe_false_scan(scan_at((0, 0, 0)), LIDAR) == ""


def test_a_ros_message_s_numbers_change_nothing_twice() -> None:
    once = make_canonical_scan(scan_at((0.1, 0.2, 0.3), 1.7e9 + 0.123456789))
    twice = make_canonical_scan(once)
    assert once.ranges.tobytes() == twice.ranges.tobytes() and once.full_circle
    assert once.angle_increment == twice.angle_increment and once.time == 1.7e9 + 0.123456789


@pytest.mark.parametrize(
    ("rows", "why"),
    [
        ([arc(0.0), arc(0.0)], "odometry twice or out of order"),
        ([arc(0.02), arc(0.0)], "odometry twice or out of order"),
        ([arc(0.0)._replace(v=math.inf)], "odometry that is not finite"),
        ([arc(5.0)], "odometry from the future"),
        (["pose"], "no odometry"),
        ([arc(0.0), arc(0.02)._replace(x=0.5)], "jump of the odometry"),
        ([arc(0.0), arc(0.02)._replace(yaw=1.0)], "jump of the odometry"),
    ],
)
def test_odometry_that_is_dropped_is_counted(rows, why) -> None:
    assert dict(take_messages(Intake.empty(1), 0.1, [], rows, ONE).drop_counts) == {why: 1}


WAY = Odometry(0.0, 0.0, 0.0, 0.0, 0.8, 0.0)


@pytest.mark.parametrize(
    ("row", "place", "declared", "jumps"),
    [
        *((arc(0.0), extrapolate_pose(arc(0.0), time), ONE, False) for time in (0.0, 0.2, 0.5)),  # it halts on its way
        *((WAY, place, ONE, True) for place in ((-0.4, 0.0, 0.0), (0.0, 0.4, 0.0), (0.9, 0.0, 0.0), (0.0, 0.0, -2.0))),
        (WAY, (0.9, 0.0, 0.0), ONE._replace(jumps=True), False),
    ],
)
def test_a_robot_that_is_beside_its_way_has_jumped_unless_jumps_are_declared(row, place, declared, jumps) -> None:
    intake = take_messages(Intake.empty(1), 0.5, [], [row, Odometry(0.5, *place, 0.0, 0.0)], declared)
    assert dict(intake.drop_counts) == ({"jump of the odometry": 1} if jumps else {})
    assert len(intake.rows) == 2 - jumps


@pytest.mark.parametrize("goal", [(1, 2), [1.0, 2.0, 3.0], np.array((1.0, 2.0))])
def test_goals(goal) -> None:
    assert read_goal(goal) == tuple(map(float, goal)) and read_goal(WITHDRAWN) is read_goal(None) is None


def stamped(time, ranges, **changes) -> LaserScan:
    return LaserScan(time, **(LIDAR.scan_fields | {"ranges": ranges} | changes))


def believed(scans, speed=0.5):
    """How many scans are believed, one every 0.1 s while the robot moves on, and the last intake."""
    intake, count = Intake.empty(1), 0
    for k, ranges in enumerate(scans):
        time = 1.0 + 0.1 * k
        row = Odometry(time, 0.1 * k * speed, 0.0, 0.0, speed, 0.0)
        intake, posed = find_next_scan(take_messages(intake, time, [stamped(time, ranges)], [row], ONE), time)
        count += posed is not None
    return count, intake


@pytest.mark.parametrize("buffers", [1, 2, 3, 7])
def test_old_scans_that_come_again_in_turn_are_dropped(buffers) -> None:
    ranges = np.random.default_rng(buffers).uniform(1.0, 3.0, (buffers, LIDAR.beams))
    count, intake = believed([ranges[k % buffers] for k in range(4 * buffers)])
    assert count == buffers and "frozen" in intake.bad_scans[0]
    assert believed([ranges[k % buffers] for k in range(4 * buffers)], speed=0.0)[0] == 4 * buffers


def test_hits_that_cannot_be_gone_are_missed() -> None:
    chance, nothing = np.random.default_rng(0), np.full(LIDAR.beams, math.inf)
    hits = list(chance.uniform(1.0, 3.0, (3, LIDAR.beams)))
    count, intake = believed([*hits, nothing, nothing])
    assert count == 3 and "0 hits" in intake.bad_scans[0]
    assert believed([*hits, nothing, *hits[1:] + chance.normal(0.0, 0.01, (2, LIDAR.beams))])[0] == 5
    far = np.where(np.arange(LIDAR.beams) < 50, LIDAR.range_max - 0.1, math.inf)
    assert believed([far, nothing])[0] == 2


@pytest.mark.parametrize(("share", "is_said"), [(1.0, False), (-1.0, False), (20.0, True), (1e6, True)])
def test_a_sweep_is_held_against_the_declared_rate(share, is_said) -> None:
    increment = share / LIDAR.rate / LIDAR.beams
    scan = stamped(0.0, np.full(LIDAR.beams, 2.0), time_increment=increment)
    assert ("time_increment" in describe_false_scan(scan, LIDAR)) == is_said


@pytest.mark.parametrize(("range_max", "no_return"), [(1.1, 1.05), (1.0, 0.98), (1.0, 1.0), (1.1, 1.1)])
def test_ranges_reach_no_farther_than_declared(range_max, no_return) -> None:
    ranges = np.where(np.arange(LIDAR.beams) < 50, 2.0, no_return * LIDAR.range_max)
    scan = within_range(make_canonical_scan(stamped(0.0, ranges, range_max=range_max * LIDAR.range_max)), LIDAR)
    assert (scan.ranges[50:] >= scan.range_max).all() and (scan.ranges[:50] == 2.0).all()
    assert scan.range_max == pytest.approx(min(no_return, 1.0) * LIDAR.range_max)


@pytest.mark.parametrize("gap", [0.02, 2.0, 60.0])
def test_an_odometry_that_begins_anew_has_jumped_however_long_it_was_silent(gap) -> None:
    intake = take_messages(Intake.empty(1), 1.0, [], [Odometry(1.0, 4.0, 1.0, 0.5, 0.5, 0.0)], ONE)
    restarted = take_messages(intake, 1.0 + gap, [], [Odometry(1.0 + gap, 0.0, 0.0, 0.0, 0.0, 0.0)], ONE)
    assert restarted.jump_time == 1.0 + gap
    with_clock = take_messages(restart_clock(intake, 0.0), 0.0, [], [Odometry(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)], ONE)
    assert with_clock.jump_time == 0.0
    goes_on = take_messages(restart_clock(intake, 0.0), 0.0, [], [Odometry(0.0, 4.01, 1.0, 0.5, 0.5, 0.0)], ONE)
    assert goes_on.jump_time == -math.inf
