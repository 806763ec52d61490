"""Bags of all the kinds that drivers and robots write are read, or refused with a reason."""

import math
from pathlib import Path

import numpy as np
import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.rosbag import read_rosbag
from tests.helpers.bags import Bag

TURN = 2.0 * math.pi


def driven(*times: float, **scan) -> Bag:
    """A bag of scans at some times, s, and of poses at 10 s and 10.5 s."""
    bag = Bag()
    for time in times:
        bag.scan(time, [1.0, math.nan, 0.0, math.inf, 2.0, 0.5], **scan)
    bag.odometry(10.0, 0.0, 3.0)
    bag.odometry(10.5, 1.0, 3.2)
    return bag


def test_scans_have_poses_between_those_of_odometry(tmp_path: Path) -> None:
    bag = driven(9.9, 10.25, 11.0).write(tmp_path / "bag")
    with pytest.warns(UserWarning, match=r"2 of 3 scans left out: scans are from 9\.900 to 11\.000 s, poses from"):
        (seen,) = read_rosbag(bag)
    assert seen.scan.time == pytest.approx(0.25)
    assert seen.pose == pytest.approx([0.5, 0.0, 3.1], abs=1e-6)  # across the turn of the angle
    np.testing.assert_array_equal(seen.scan.ranges, [1.0, math.nan, math.nan, math.inf, 2.0, 0.5])
    assert (seen.scan.angle_min, seen.scan.range_max) == (-1.0, 8.0)


@pytest.mark.parametrize("apart", [1.7e9, 0.6, -0.6])
def test_scans_and_poses_of_two_clocks_are_refused_with_both_spans(tmp_path: Path, apart: float) -> None:
    bag = Bag()
    for k in range(4):
        bag.ahead = 0.0
        bag.scan(12.0 + 0.1 * k, np.ones(6))
        bag.ahead = apart
        bag.odometry(12.0 + 0.1 * k, 0.0, 0.0)
    spans = rf"from 12\.000 to 12\.300 s, poses from {12.0 + apart:.3f} to {12.3 + apart:.3f} s; allowed: stamps of one"
    with pytest.raises(StarnavError, match=spans):
        read_rosbag(bag.write(tmp_path / "bag"))


@pytest.mark.parametrize("upside_down", [False, True])
def test_transforms_lead_from_the_lidar_to_the_fixed_frame(tmp_path: Path, upside_down: bool) -> None:
    """A lidar that looks backwards from 0.2 m ahead of a robot that turns about the origin of a shifted map."""
    bag = Bag()
    bag.transform(0.0, ("base", "laser"), (0.2, 0.0), math.pi, topic="/tf_static", upside_down=upside_down)
    for time, yaw in ((10.0, 3.0), (11.0, 3.4)):
        bag.transform(time, ("odom", "base"), (0.0, 0.0), yaw)
        bag.transform(time, ("map", "odom"), (5.0, 0.0), 0.0)
    bag.scan(10.5, np.arange(1.0, 7.0), frame="/laser")
    (seen,) = read_rosbag(bag.write(tmp_path / "bag"))
    assert seen.pose[:2] == pytest.approx([5.0 + 0.2 * math.cos(3.2), 0.2 * math.sin(3.2)])
    assert math.remainder(seen.pose[2] - 3.2 - math.pi, TURN) == pytest.approx(0.0, abs=1e-9)
    bearings = -1.0 + 0.5 * np.arange(6)
    expected = -bearings[::-1] if upside_down else bearings
    assert seen.scan.bearings == pytest.approx(expected)
    assert seen.scan.ranges[0] == (6.0 if upside_down else 1.0)


def test_a_topic_that_is_missing_is_named_with_those_there_are(tmp_path: Path) -> None:
    bag = driven(10.0).write(tmp_path / "bag")
    for name, kind, there in (("scan_topic", "Odometry", "/scan"), ("pose_topic", "LaserScan", "/odom")):
        with pytest.raises(StarnavError, match=rf"bag .*: {name} is /front, not in it; allowed: {there}$"):
            read_rosbag(bag, **{name: "/front"})
        other = "/odom" if there == "/scan" else "/scan"
        with pytest.raises(StarnavError, match=rf"{name} is {other}, {kind}; allowed: {there}$"):
            read_rosbag(bag, **{name: other})
    alone = Bag()
    alone.scan(10.0, np.ones(6))
    with pytest.raises(StarnavError, match=r"pose_topic is /odom or /tf, not in it; allowed: none$"):
        read_rosbag(alone.write(tmp_path / "alone"))


def test_a_lidar_that_no_transform_moves_is_refused(tmp_path: Path) -> None:
    bag = Bag()
    bag.transform(10.0, ("odom", "base"))
    bag.scan(10.0, np.ones(6), frame="scanner")
    with pytest.raises(StarnavError, match=r"from the scan's frame scanner to a fixed one; allowed: one of base"):
        read_rosbag(bag.write(tmp_path / "bag"))


FOOT, BODY, MOUNT = ("base_footprint", "base_link"), ("base_link", "base_footprint"), ("base_link", "laser")


@pytest.mark.parametrize("latched", [0.0, 10.25])
@pytest.mark.parametrize(
    ("child", "fixed"),
    [
        ("base_link", [MOUNT]),
        ("base_link", [FOOT, MOUNT]),
        ("base_link", [MOUNT, FOOT]),
        ("base_footprint", [BODY, MOUNT]),
        ("base_footprint", [FOOT, MOUNT]),
        ("", [MOUNT]),
        ("", [FOOT, MOUNT]),
        ("r1/base_link", [("r1/base_link", "laser")]),
        (None, [MOUNT]),  # of a topic of poses, which names no frame
    ],
)
def test_poses_are_those_of_the_lidar_however_frames_hang_together(tmp_path: Path, child, fixed, latched) -> None:
    bag = Bag()
    for k in range(6):
        time, place = 10.0 + 0.1 * k, 5.0 + 0.1 * k
        bag.pose(time, place, 0.0, topic="/tracked") if child is None else bag.odometry(time, place, 0.0, child=child)
        bag.scan(time, np.ones(6))
    for frames in fixed:
        bag.transform(latched, frames, (0.2, 0.0) if "laser" in frames else (0.0, 0.0), topic="/tf_static")
    seen = read_rosbag(bag.write(tmp_path / "bag"), **({"pose_topic": "/tracked"} if child is None else {}))
    assert [float(each.pose[0]) for each in seen] == pytest.approx(5.2 + 0.1 * np.arange(6))


@pytest.mark.parametrize("ahead", [0.0, 1.0])
def test_what_corrects_an_odometry_holds_until_it_does_again(tmp_path: Path, ahead: float) -> None:
    bag = Bag()
    for k in range(6):
        time = 10.0 + 0.1 * k
        if k in (0, 3):
            bag.ahead = ahead
            bag.transform(time, ("map", "odom"), (0.5 if k else 0.0, 0.0))
        bag.ahead = 0.0
        bag.transform(time, ("odom", "base"), (0.1 * k, 0.0))
        bag.scan(time, np.ones(6), frame="base")
    jump = 0.5 if ahead == 0.0 else 0.0
    seen = read_rosbag(bag.write(tmp_path / "bag"))
    expected = 0.1 * np.arange(6) + jump * (np.arange(6) >= 3)
    assert [float(each.pose[0]) for each in seen] == pytest.approx(expected)


@pytest.mark.parametrize("transforms", [False, True])
def test_a_clock_that_is_set_back_ends_the_log(tmp_path: Path, transforms: bool) -> None:
    bag = Bag()
    for start, offset in ((0.0, 0.0), (3.0, 10.0)):
        for k in range(6):
            time, bag.ahead = start + 0.1 * k, 1.0 - start
            if transforms:
                bag.transform(time, ("odom", "laser"), (offset + 0.1 * k, 0.0))
            else:
                bag.odometry(time, offset + 0.1 * k, 0.0)
            bag.scan(time, np.ones(6))
    with pytest.warns(UserWarning, match=r"go back from 1\.500 to 1\.100 s.*the log ends there, 6 later scans"):
        seen = read_rosbag(bag.write(tmp_path / "bag"))
    assert [float(each.pose[0]) for each in seen] == pytest.approx(0.1 * np.arange(6))


def test_a_message_that_was_overtaken_is_none_of_another_run(tmp_path: Path) -> None:
    bag = driven()
    for time, stamp in ((10.1, 10.1), (10.2, 10.3), (10.3, 10.2), (10.4, 10.4)):
        bag.ahead = stamp - time
        bag.scan(time, np.ones(6))
    times = [seen.scan.time for seen in read_rosbag(bag.write(tmp_path / "bag"))]
    assert times == pytest.approx([0.1, 0.2, 0.3, 0.4])


def test_scans_without_ranges_are_counted_and_left_out(tmp_path: Path) -> None:
    bag = driven(10.1, 10.2)
    bag.scan(10.0, [])
    with pytest.warns(UserWarning, match="1 of 3 scans left out, without ranges"):
        assert len(read_rosbag(bag.write(tmp_path / "bag"))) == 2
    alone = driven()
    alone.scan(10.0, [])
    with pytest.raises(StarnavError, match=r"/scan has 1 scan without ranges; allowed"):
        read_rosbag(alone.write(tmp_path / "alone"))


def test_a_recording_that_was_cut_off_is_read_without_its_metadata(tmp_path: Path) -> None:
    bag = driven(10.1, 10.2).write(tmp_path / "bag")
    whole = read_rosbag(bag)
    (bag / "metadata.yaml").unlink()
    assert [seen.scan.time for seen in read_rosbag(bag)] == [seen.scan.time for seen in whole]
    next(bag.glob("*.db3")).unlink()
    with pytest.raises(StarnavError, match=r"no metadata\.yaml, and no file that ends in \.mcap or \.db3"):
        read_rosbag(bag)


def test_a_scan_s_frame_that_no_transform_knows_is_said(tmp_path: Path) -> None:
    bag = driven(10.0)
    bag.transform(0.0, ("base_link", "camera"), topic="/tf_static")
    with pytest.warns(UserWarning, match="from base_link to the scan's frame laser: the robot's poses are taken"):
        read_rosbag(bag.write(tmp_path / "bag"))


def test_an_invalid_bag_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("rosbags")
    with pytest.raises(StarnavError, match="nothing: no such file or folder; allowed: a bag"):
        read_rosbag(tmp_path / "nothing")
    file = next(driven(10.0).write(tmp_path / "bag").glob("*.db3"))
    file.write_bytes(file.read_bytes()[:5000])
    with pytest.raises(StarnavError, match=r"cannot be read: .*[^.]; allowed: a whole bag of ROS 1 or ROS 2; `mcap"):
        read_rosbag(tmp_path / "bag")
