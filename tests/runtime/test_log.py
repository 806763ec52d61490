"""A log repeats a run to the bit."""

import json
import math
import struct
import subprocess
import sys
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest

from drake_starnav import StarnavError, World, load_scenario, parse_scenario
from drake_starnav.geometry.se2 import compose_poses, find_pose_in_frame
from drake_starnav.runtime import Navigator, Reading, read_log, replay
from drake_starnav.runtime.log import LARGEST_CHUNK, RunLog, decode_scan, encode_scan
from drake_starnav.runtime.ros2_definitions import encode
from drake_starnav.worlds.view import visible_shapes
from tests.helpers.bare_robot import BareRobot, TwoEyes

pytest.importorskip("mcap")
FOREST = load_scenario("forest")
POSTS = World("posts", (0.0, 0.0, 0.0), (6.0, 0.0), cylinders=np.array([(1.5, 0.3, 0.25), (3.0, -0.6, 0.3)]))
POLYGON = "robot: {footprint: [[-0.2, -0.15], [0.3, -0.15], [0.3, 0.15], [-0.2, 0.15]]}\n"
TWO = "lidar: {rate: 10}\nlidars: [{}, {}]\nrobot: {max_speed: 0.5}\n"
DRIFT, MOVERS = "localization: {drift: 0.02}\n", "obstacles: {max_speed: 0.5}\n"
RUNS = {
    "movers and drift": (MOVERS + DRIFT, "drift movers"),
    "polygon and drift": (POLYGON + DRIFT, "drift"),
    "car": ("robot: {base: car, model: carbot}", ""),
    "omnidirectional": ("robot: {base: omnidirectional, model: omnibot}", ""),
    "two lidars and drift": (TWO + DRIFT, "drift"),
    "faults": ("", "faults"),
}
"""Scenario, and what happens."""
DRIFTS = 0.008
"""The odometry turns by this along its way, rad/m, and measures it too long by this share."""


class Drifted(NamedTuple):
    """Odometry that errs: where it is, and where the robot was then."""

    believed: np.ndarray
    true: np.ndarray

    def after(self, true) -> "Drifted":
        ahead, aside, turned = find_pose_in_frame(self.true, true)
        step = (1.0 + DRIFTS) * ahead, (1.0 + DRIFTS) * aside, turned + DRIFTS * math.hypot(ahead, aside)
        return Drifted(np.array(compose_poses(self.believed, step)), true.copy())


def logged(path, scenario, kind="", seconds=3.0, world=POSTS):
    """Write the log of a run; returns its robot."""
    kind_of_robot, mounts = (TwoEyes, TwoEyes.MOUNTS) if len(scenario.all_lidars) == 2 else (BareRobot, None)
    navigator, robot = Navigator(scenario, mounts=mounts, warm=False), kind_of_robot(scenario, world)
    log, chance, drifted = RunLog(path, navigator), np.random.default_rng(0), Drifted(robot.pose, robot.pose)
    while robot.time < seconds:
        if "movers" in kind:
            ball = (4.5, 1.5 - 0.3 * robot.time, 0.2)
            robot.shapes = visible_shapes(replace(POSTS, cylinders=np.vstack((POSTS.cylinders, ball))))
        reading = robot.read()
        if "drift" in kind:
            drifted = drifted.after(robot.pose)
            x, y, yaw = drifted.believed.tolist()
            reading = reading._replace(odometry=[reading.odometry[0]._replace(x=x, y=y, yaw=yaw)])
        if kind == "faults" and robot.time > 1.0:
            odometry = [reading.odometry[0]._replace(x=math.nan), None, reading.odometry[0]]
            scans = [*reading.scans, *reading.scans, None]
            goal = (None, (math.nan, 1.0), reading.goal)[int(chance.integers(3))]
            reading = Reading(reading.now, scans, odometry[: int(chance.integers(4))], goal)
        command = navigator.step(*reading)
        log.note(reading, command)
        robot.drive(command)
        if command.status == "reached" and robot.stands:
            break
    log.close()
    return robot


@pytest.mark.parametrize("seconds", [3.0, pytest.param(30.0, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", RUNS)
def test_every_command_is_repeated(tmp_path, kind, seconds) -> None:
    text, happens = RUNS[kind]
    scenario = parse_scenario(text or "{}", name=kind)
    robot = logged(tmp_path / "run.mcap", scenario, happens, seconds)
    whole = seconds > 3.0 and happens != "faults"
    assert robot.way > (5.0 if whole else 0.5) and (robot.clearance > 0.0 or "movers" in happens)
    replayed = replay(tmp_path / "run.mcap")
    assert replayed.ticks == robot.ticks and replayed.differs is None, str(replayed)
    print(f"{kind}: {replayed}")


def test_the_first_that_differs_is_named(tmp_path) -> None:
    path = tmp_path / "run.mcap"
    logged(path, FOREST, seconds=1.0)
    other = load_scenario("forest", overrides=["robot.max_speed=0.3"])
    log = read_log(path)
    assert log.mounts and log.make_navigator().scenario.robot == FOREST.robot
    slower = tmp_path / "slower.mcap"
    mixed = RunLog(slower, Navigator(other, warm=False))
    for tick in log.ticks:
        mixed.note(Reading(*tick.inputs), tick.command)
    mixed.close()
    replayed = replay(slower)
    assert replayed.differs is not None and 5 < replayed.differs < 50
    assert "differs" in str(replayed)


def test_a_log_that_was_cut_off_is_read_up_to_there(tmp_path) -> None:
    path, cut = tmp_path / "run.mcap", tmp_path / "cut.mcap"
    logged(path, FOREST, seconds=8.0)
    data = path.read_bytes()
    cut.write_bytes(data[: int(0.8 * len(data))])
    replayed = replay(cut)
    assert 50 < replayed.ticks < 400 and replayed.differs is None


def test_another_process_repeats_it(tmp_path) -> None:
    path = tmp_path / "run.mcap"
    logged(path, FOREST, seconds=2.0)
    code = f"from drake_starnav.runtime import replay; print(replay({str(path)!r}))"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300, check=True)
    assert out.stdout.strip() == f"all {2 * FOREST.controller.rate:g} commands are equal to the bit"


def test_it_shows_path_and_regions(tmp_path) -> None:
    rosbags = pytest.importorskip("rosbags.highlevel")
    robot = logged(tmp_path / "run.mcap", FOREST, seconds=2.0)
    with rosbags.AnyReader([tmp_path / "run.mcap"]) as bag:
        kinds = {each.topic: each.msgtype for each in bag.connections}
        plans = [bag.deserialize(data, each.msgtype) for each, _, data in bag.messages() if "plan" in each.topic]
    assert kinds["/scan"] == "sensor_msgs/msg/LaserScan" and kinds["/odom"] == "nav_msgs/msg/Odometry"
    assert kinds["/cmd_vel"] == "geometry_msgs/msg/Twist" and kinds["/tf"] == "tf2_msgs/msg/TFMessage"
    _, *outlines, path = plans[-1].markers
    assert len(plans) == 4
    places = np.array([[each.x, each.y] for each in path.points])
    assert len(places) > 1 and math.dist(places[0], robot.pose[:2]) < 0.4 and places[-1][0] > robot.pose[0]
    polygons = [np.array([(each.x, each.y) for each in outline.points]) for outline in outlines]
    assert polygons and any(np.linalg.norm(each - robot.pose[:2], axis=1).min() < 3.0 for each in polygons)
    assert all(len(each) > 10 and each[0].tolist() == each[-1].tolist() for each in polygons)


RUN = {"name": "x", "scenario": "robot: {radius: 0.25}\n", "mounts": [[0, 0, 0, False]]}
TICK = {"now": 1.0, "scans": [[0, 1.0]], "odometry": [], "goal": None, "reset": False, "twist": [0, 0]}
TICK |= {"certified": False, "status": "", "why": "", "took": 0.0}


@pytest.mark.parametrize(
    "messages",
    [
        [("/starnav/run", {})],
        [("/starnav/run", [1])],
        [("/starnav/run", RUN | {"scenario": 5})],
        [("/starnav/run", RUN), ("/starnav/tick", {})],
        [("/starnav/run", RUN), ("/starnav/tick", TICK)],
        [("/starnav/run", RUN), ("/scan", b"abc"), ("/starnav/tick", TICK)],
        [("/starnav/run", RUN), ("/scan", b"abc"), ("/starnav/tick", TICK | {"scans": [[9, 1.0]]})],
        [("/starnav/run", b"{")],
    ],
)
def test_broken_logs_are_refused(tmp_path, messages) -> None:
    writing = pytest.importorskip("mcap.writer")
    with (tmp_path / "x.mcap").open("wb") as file:
        writer = writing.Writer(file)
        writer.start()
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        for topic, value in messages:
            data = value if isinstance(value, bytes) else encode("std_msgs/String", {"data": json.dumps(value)})
            writer.add_message(writer.register_channel(topic, "cdr", schema), 0, data, 0)
        writer.finish()
    with pytest.raises(StarnavError, match=r"x\.mcap cannot be read: .*; allowed: an MCAP file as drive"):
        list(read_log(tmp_path / "x.mcap").ticks)


def test_a_chunk_that_expands_without_bound_is_refused(tmp_path) -> None:
    zstandard = pytest.importorskip("zstandard")
    data = zstandard.ZstdCompressor().compress(bytes(2 * LARGEST_CHUNK))
    chunk = struct.pack("<QQQI", 0, 0, 2 * LARGEST_CHUNK, 0) + struct.pack("<I4sQ", 4, b"zstd", len(data)) + data
    head = b"\x89MCAP0\r\n\x01" + struct.pack("<QII", 8, 0, 0) + b"\x06" + struct.pack("<Q", len(chunk))
    (tmp_path / "x.mcap").write_bytes(head + chunk)
    with pytest.raises(StarnavError, match="expands to more than 16 MB"):
        read_log(tmp_path / "x.mcap")


def test_messages_are_ros_s(tmp_path) -> None:
    rosbags = pytest.importorskip("rosbags.typesys")
    store = rosbags.get_typestore(rosbags.Stores.ROS2_JAZZY)
    scan = BareRobot(FOREST).read().scans[0]
    message = store.deserialize_cdr(encode_scan(scan, "lidar"), "sensor_msgs/msg/LaserScan")
    assert message.header.frame_id == "lidar" and message.header.stamp.sec == int(scan.time)
    assert (
        message.angle_max == np.float32(scan.angle_max) and message.ranges.tolist() == scan.ranges.astype("f4").tolist()
    )
    assert bytes(store.serialize_cdr(message, "sensor_msgs/msg/LaserScan")) == encode_scan(scan, "lidar")
    assert decode_scan(encode_scan(scan, "lidar"), scan.time).ranges.tolist() == message.ranges.tolist()
