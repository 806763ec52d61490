"""Scan logs: written logs are read back, and invalid ones are rejected."""

import math
from pathlib import Path

import numpy as np
import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.scan_log import LoggedScan, read_csv, read_rosbag, write_csv

SHIPPED = Path(__file__).parents[2] / "scripts" / "examples" / "room_scans.csv"


def log(count: int = 3) -> list[LoggedScan]:
    rng = np.random.default_rng(4)
    found = []
    for k in range(count):
        ranges = rng.uniform(0.1, 4.0, 8)
        ranges[k], ranges[-1] = math.inf, -math.inf
        scan = LaserScan(0.1 * k, -math.pi, math.pi / 4.0, 0.02, 5.0, ranges)
        found.append(LoggedScan(scan, np.array((0.5 * k, -1.0, 3.0 + 0.1 * k))))
    return found


def test_csv_reads_back_to_a_millimetre(tmp_path: Path) -> None:
    write_csv(tmp_path / "log.csv", log())
    again = read_csv(tmp_path / "log.csv")
    assert len(again) == 3
    for before, after in zip(log(), again, strict=True):
        assert after.scan.time == pytest.approx(before.scan.time, abs=1e-3)
        assert after.scan.angle_increment == before.scan.angle_increment
        assert after.scan.ranges == pytest.approx(before.scan.ranges, abs=5.1e-4)
        assert after.pose == pytest.approx(before.pose, abs=5.1e-4)


def test_the_shipped_log_is_of_one_full_circle_lidar() -> None:
    seen = read_csv(SHIPPED)
    assert len(seen) == 25 and all(item.scan.full_circle and len(item.scan.ranges) == 180 for item in seen)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "time,x,y\n1,2,3\n",
        "# angle_min=0, angle_increment=1, range_min=0\n0,0,0,0,1,1,1\n",
        "# angle_min=0, angle_increment=1, range_min=0, range_max=5\n0,0,0,0,1,word,1\n",
        "# angle_min=0, angle_increment=1, range_min=0, range_max=5\n0,nan,0,0,1,1,1\n",
        "# angle_min=0, angle_increment=1, range_min=0, range_max=5\n0,0,0,0,1\n",
    ],
)
def test_an_invalid_log_is_rejected(tmp_path: Path, text: str) -> None:
    file = tmp_path / "log.csv"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(StarnavError, match=r"scan log .*log\.csv.*; allowed: "):
        read_csv(file)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(StarnavError, match=r"none\.csv cannot be read"):
        read_csv(tmp_path / "none.csv")


def write_bag(path: Path, scans: list[float], poses: list[tuple[float, float, float]]) -> None:
    """A ROS 2 bag with scans at some times, and poses (time, x, yaw), s, m, rad."""
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    types = store.types
    time_type, header_type = types["builtin_interfaces/msg/Time"], types["std_msgs/msg/Header"]
    point, quaternion = types["geometry_msgs/msg/Point"], types["geometry_msgs/msg/Quaternion"]
    pose_type, vector = types["geometry_msgs/msg/Pose"], types["geometry_msgs/msg/Vector3"]
    scan_type, odometry_type = types["sensor_msgs/msg/LaserScan"], types["nav_msgs/msg/Odometry"]

    def header(time: float):
        return header_type(stamp=time_type(sec=int(time), nanosec=round(1e9 * (time % 1.0))), frame_id="x")

    with rosbag2.Writer(path, version=9) as writer:
        to_scan = writer.add_connection("/scan", scan_type.__msgtype__, typestore=store)
        to_odometry = writer.add_connection("/odom", odometry_type.__msgtype__, typestore=store)
        for time in scans:
            ranges = np.array([1.0, np.nan, 0.0, np.inf, 2.0, 0.5], dtype=np.float32)
            message = scan_type(
                header=header(time),
                angle_min=-1.0,
                angle_max=1.5,
                angle_increment=0.5,
                time_increment=0.0,
                scan_time=0.1,
                range_min=0.1,
                range_max=8.0,
                ranges=ranges,
                intensities=np.zeros(0, dtype=np.float32),
            )
            writer.write(to_scan, int(1e9 * time), store.serialize_cdr(message, scan_type.__msgtype__))
        for time, x, yaw in poses:
            turn = quaternion(x=0.0, y=0.0, z=math.sin(0.5 * yaw), w=math.cos(0.5 * yaw))
            pose = pose_type(position=point(x=x, y=0.0, z=0.0), orientation=turn)
            still = types["geometry_msgs/msg/Twist"](linear=vector(x=0.0, y=0.0, z=0.0), angular=vector(0.0, 0.0, 0.0))
            message = odometry_type(
                header=header(time),
                child_frame_id="base_link",
                pose=types["geometry_msgs/msg/PoseWithCovariance"](pose=pose, covariance=np.zeros(36)),
                twist=types["geometry_msgs/msg/TwistWithCovariance"](twist=still, covariance=np.zeros(36)),
            )
            writer.write(to_odometry, int(1e9 * time), store.serialize_cdr(message, odometry_type.__msgtype__))


def test_a_bag_gives_scans_with_poses_between_those_of_odometry(tmp_path: Path) -> None:
    write_bag(tmp_path / "bag", [9.9, 10.25, 11.0], [(10.0, 0.0, 3.0), (10.5, 1.0, 3.2)])
    (seen,) = read_rosbag(tmp_path / "bag")  # odometry does not reach to the other two
    assert seen.scan.time == pytest.approx(0.25)
    assert seen.pose == pytest.approx([0.5, 0.0, 3.1], abs=1e-6)  # across the turn of the angle
    np.testing.assert_array_equal(seen.scan.ranges, [1.0, math.nan, math.nan, math.inf, 2.0, 0.5])
    assert (seen.scan.angle_min, seen.scan.range_max) == (-1.0, 8.0)


def test_a_bag_without_the_topic_names_those_it_has(tmp_path: Path) -> None:
    write_bag(tmp_path / "bag", [10.0], [(10.0, 0.0, 0.0)])
    with pytest.raises(StarnavError, match=r"bag .* has no topic /front; allowed: /odom, /scan"):
        read_rosbag(tmp_path / "bag", scan_topic="/front")


def test_an_invalid_bag_is_rejected(tmp_path: Path) -> None:
    pytest.importorskip("rosbags")
    with pytest.raises(StarnavError, match="cannot be read"):
        read_rosbag(tmp_path / "nothing")
