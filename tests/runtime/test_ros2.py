"""A robot of ROS 2 in another process, by Cyclone DDS over the loopback interface."""

import collections
import contextlib
import json
import math
import os
import subprocess
import sys
import time
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("cyclonedds")

from drake_starnav import LaserScan, StarnavError, load_scenario
from drake_starnav.lidar.mounts import ON_AXIS
from drake_starnav.runtime import Navigator, drive, read_log, replay
from drake_starnav.runtime.intake import WITHDRAWN
from drake_starnav.runtime.ros2 import EMPTY, POSE, Ros2, read_goal, read_odometry, read_scan
from drake_starnav.runtime.ros2_cyclone import MESSAGES as MAKE
from drake_starnav.runtime.ros2_cyclone import Cyclone, make_configuration

WORKER = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
DOMAIN = iter(range(101 + WORKER, 232, 8))
"""Each test has its own, in each of up to 8 workers."""


@contextlib.contextmanager
def robot(domain: int, *options: str):
    """A process that is a robot; when the block ends, it holds in `said` what became of it."""
    command = [sys.executable, "-m", "tests.helpers.ros_robot", "room", str(domain), *options]
    process, found = subprocess.Popen(command, stdout=subprocess.PIPE, text=True), SimpleNamespace(said=None)
    try:
        yield found
        found.said = json.loads(process.communicate(timeout=90.0)[0])
    finally:
        process.kill()
        process.communicate()


def connect(domain: int, wait: float = 20.0, **options) -> Ros2:
    return Ros2(load_scenario("room"), domain=domain, interface="lo", wait=wait, **options)


@pytest.mark.realtime
@pytest.mark.parametrize("stamped", [False, True])
def test_it_drives_to_the_goal_that_comes_in_and_shows_its_plan(stamped: bool, tmp_path) -> None:
    domain, log = next(DOMAIN), tmp_path / "run.mcap"
    with robot(domain, "--goal", "--mounted", "--seconds", "50", *["--stamped"] * stamped) as other:
        base = connect(domain)
        assert base.mounts == (ON_AXIS,)
        base.navigator = Navigator(base.scenario, mounts=base.mounts)
        driven = drive(base.navigator, base, log=log, seconds=30.0, until_reached=True)
    statuses = collections.Counter((tick.command.status, tick.command.why) for tick in read_log(log).ticks)
    assert driven.end == "reached", statuses.most_common(5)
    assert other.said["away"] < 0.2 and other.said["clearance"] > 0.0 and other.said["twist"] == [0.0, 0.0]
    assert other.said["plan"] > 5 and other.said["markers"] > 5
    assert replay(log).differs is None


@pytest.mark.realtime
def test_a_goal_is_withdrawn_by_a_message() -> None:
    domain, aim = next(DOMAIN), MAKE.PoseStamped(header=MAKE.Header(frame_id="odom"))
    aim.pose.position.x = 2.0
    with robot(domain, "--mounted", "--seconds", "50"):
        base, other = connect(domain), Cyclone(domain, "lo")
        for topic, kind, message in (("/goal_pose", POSE, aim), ("/goal_cancel", EMPTY, MAKE.Empty())):
            send, before, end = other.publish(topic, kind), base.read().goal, time.monotonic() + 10.0
            while base.read().goal == before and time.monotonic() < end:
                send(message)
                time.sleep(0.1)
            assert base.read().goal == ((2.0, 0.0, 0.0) if kind == POSE else WITHDRAWN)
        base.close()


class Offered:
    """Publishers and subscriptions of a robot, of which one may be wrong."""

    def __init__(self, domain: int, **kinds: str) -> None:
        names = {"scan": "sensor_msgs/LaserScan", "odom": "nav_msgs/Odometry", "cmd_vel": "geometry_msgs/Twist"}
        self.node, self.age, names = Cyclone(domain, "lo"), 0.0, names | kinds
        self.send = {
            name: self.node.publish(f"/{name}", kind) for name, kind in names.items() if name in ("scan", "odom")
        }
        self.sends_odometry = "odom" not in kinds
        self.cmd_vel = [self.node.subscribe("/cmd_vel", kind, 1) for kind in names["cmd_vel"].split() if kind]

    def tick(self) -> None:
        at = time.time() - self.age
        head = MAKE.Header(stamp=MAKE.Time(sec=int(at), nanosec=int(at % 1.0 * 1e9)), frame_id="laser")
        self.send["scan"](MAKE.LaserScan(header=head, ranges=[1.0] * 360))
        if self.sends_odometry:
            self.send["odom"](MAKE.Odometry(header=head, child_frame_id="base_link"))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"age": 5.0}, r"stamps of /scan are 5.* s behind this computer's clock; allowed: clocks that agree within"),
        ({"age": -5.0}, r"stamps of /scan are 5 s ahead of this computer's clock|4\.\d* s ahead of"),
        ({"cmd_vel": ""}, "nobody listens to /cmd_vel"),
        ({"cmd_vel": "geometry_msgs/Pose"}, r"/cmd_vel is listened to as geometry_msgs/Pose; allowed: geo"),
        ({"cmd_vel": "geometry_msgs/Twist geometry_msgs/TwistStamped"}, "geometry_msgs/Twist and as geometry_msgs/Tw"),
        ({"other": "geometry_msgs/Twist"}, "another node publishes /cmd_vel; allowed: none"),
        ({"odom": "geometry_msgs/PoseStamped"}, "/odom is published as geometry_msgs/PoseStamped; allowed: nav"),
        ({"silent": True}, "/scan is published, but no message arrives"),
        ({"latched": True}, "/cmd_vel is listened to with durability transient local"),
        ({"mounts": "other"}, "no transform of /tf_static leads from base_link to laser, the frame of /scan"),
        ({"missing": True}, "nobody publishes /scan; published is /odometry"),
    ],
    ids=lambda each: "-".join(each) if isinstance(each, dict) else "",
)
def test_it_is_refused_in_one_sentence(change: dict, said: str, monkeypatch) -> None:
    domain, kinds = next(DOMAIN), {name: kind for name, kind in change.items() if name in ("cmd_vel", "odom")}
    if "missing" in change:
        node = Cyclone(domain, "lo")
        keep = node.publish("/odometry", "nav_msgs/Odometry")
    else:
        offered = Offered(domain, **kinds)
        offered.age, keep = change.get("age", 0.0), offered
        if "other" in change:
            keep.more = offered.node.publish("/cmd_vel", change["other"])
        if "latched" in change:
            offered.cmd_vel.append(offered.node.subscribe("/cmd_vel", "geometry_msgs/Twist", 1, latched=True))
        if "mounts" in change:
            keep.mounts = offered.node.publish("/tf_static", "tf2_msgs/TFMessage", latched=True)
        if "silent" not in change:
            sleep = time.sleep
            monkeypatch.setattr("time.sleep", lambda seconds: (offered.tick(), sleep(seconds)))
    with pytest.raises(StarnavError, match=said):
        connect(domain, 3.0)
    del keep


def test_topics_are_in_the_namespace() -> None:
    robot_ = object.__new__(Ros2)
    robot_.namespace = "/robot_1/"
    assert robot_.absolute("scan") == "/robot_1/scan" and robot_.absolute("/scan") == "/scan"
    robot_.namespace = ""
    assert robot_.absolute("scan") == "/scan"


def test_a_scan_is_as_of_its_last_beam_and_what_is_none_is_passed_on() -> None:
    head = MAKE.Header(stamp=MAKE.Time(sec=7, nanosec=500_000_000))
    fields = {"angle_min": -1.0, "angle_increment": 0.01, "range_min": 0.1, "range_max": 5.0, "time_increment": 0.001}
    message = MAKE.LaserScan(header=head, ranges=[1.0, math.inf, 0.0, 2.0, math.nan], **fields)
    scan = read_scan(message)
    assert isinstance(scan, LaserScan) and scan.time == pytest.approx(7.504)
    np.testing.assert_array_equal(scan.ranges, [1.0, math.inf, math.nan, 2.0, math.nan])
    message.range_max = 0.0
    assert read_scan(message) is message


def test_odometry_and_goals() -> None:
    turn = MAKE.Quaternion(z=math.sin(0.3), w=math.cos(0.3))
    message = MAKE.Odometry(header=MAKE.Header(stamp=MAKE.Time(sec=3)))
    message.pose.pose = MAKE.Pose(position=MAKE.Point(x=1.0, y=2.0), orientation=turn)
    message.twist.twist = MAKE.Twist(linear=MAKE.Vector3(x=0.5, y=0.1), angular=MAKE.Vector3(z=0.2))
    assert read_odometry(message) == pytest.approx((3.0, 1.0, 2.0, 0.6, 0.5, 0.2, 0.1))
    goal = MAKE.PoseStamped(header=MAKE.Header(frame_id="odom"), pose=message.pose.pose)
    assert read_goal(goal, "odom") == pytest.approx((1.0, 2.0, 0.6)) and read_goal(goal, "/odom") is not None
    assert read_goal(goal, "map") == "in frame odom, and odometry in map"
    goal.pose.orientation = MAKE.Quaternion(w=0.0)
    assert read_goal(goal, "odom") == (1.0, 2.0)


def test_loopback_has_no_multicast_and_peers_are_those_of_ros(monkeypatch) -> None:
    monkeypatch.setenv("ROS_STATIC_PEERS", "10.0.0.2;10.0.0.3")
    monkeypatch.setenv("CYCLONEDDS_URI", "file:///own.xml")
    text = make_configuration("lo")
    assert 'name="lo"' in text and "<AllowMulticast>false" in text and text.endswith(",file:///own.xml")
    assert all(f'<Peer address="{each}"/>' in text for each in ("10.0.0.2", "10.0.0.3", "127.0.0.1"))
    monkeypatch.undo()
    assert "Peer" not in make_configuration("") and "IgnoreTypeInformation" in make_configuration("")


def test_topics_of_more_lidars_and_an_interface_that_is_none_are_refused() -> None:
    with pytest.raises(StarnavError, match="scan names 2 topics; allowed: 1, one of each lidar"):
        Ros2(load_scenario("room"), scan=["front", "rear"])
    with pytest.raises(StarnavError, match="interface nowhere: Cyclone DDS says"):
        Cyclone(7, "nowhere")
