"""A ROS 2 robot that knows nothing of this package is driven: rclpy, Fast DDS and MuJoCo, from PyPI, on this machine.

They need Python 3.12 and have an environment of their own, which is made once: 400 MB in the user's cache.
"""

import collections
import functools
import json
import math
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("cyclonedds")
pytest.importorskip("mcap")

from benchmarks.simulators import mjcf
from drake_starnav.loading import load_scenario
from drake_starnav.runtime import Navigator, drive, read_log, replay
from drake_starnav.runtime.ros2 import Ros2
from drake_starnav.runtime.ros2_cyclone import MESSAGES, Cyclone
from drake_starnav.scenario.schema import Scenario
from drake_starnav.worlds import make_world

PACKAGES = (
    "ros-rclpy==9.1.2", "ros-rmw-fastrtps-cpp==9.3.3", "ros-geometry-msgs==5.5.1", "ros-nav-msgs==5.5.1",
    "ros-sensor-msgs==5.5.1", "mujoco==4.0.0", "numpy==2.5.5",
)  # fmt: skip
FOLDER = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "drake_starnav" / "ros-9.1.2"
ROOT = Path(__file__).parents[2]
ROBOT = ROOT / "tests" / "helpers" / "rclpy_robot.py"
DOMAIN = iter(range(61, 101))
DECLARED = ["drive.delay=0.04"]
"""From a scan to the command that answers it pass 15 ms, and 5 ms more to the base: `starnav calibrate` measures it."""
pytestmark = pytest.mark.realtime


@pytest.fixture(scope="session")
def ros_python() -> Path:
    """An interpreter that has rclpy; skips where it cannot be had."""
    python = FOLDER / "bin" / "python"
    probe = [str(python), "-c", "import rclpy, mujoco, sensor_msgs.msg, nav_msgs.msg"]
    if python.exists() and subprocess.run(probe, capture_output=True, check=False).returncode == 0:
        return python
    known = [shutil.which("python3.12"), *Path.home().glob(".pyenv/versions/3.12.*/bin/python3.12")]
    works = (
        each
        for each in known
        if each and subprocess.run([each, "-V"], capture_output=True, check=False).returncode == 0
    )
    if (base := next(works, None)) is None:
        pytest.skip("needs Python 3.12, for which rclpy's wheels are")
    for command in (
        [str(base), "-m", "venv", str(FOLDER)],
        [str(python), "-m", "pip", "install", "-q", *PACKAGES],
        probe,
    ):
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=600.0, check=False)
        except subprocess.TimeoutExpired:
            pytest.skip(f"rclpy could not be installed: {command[1:4]} takes too long")
        if done.returncode != 0:
            pytest.skip(f"rclpy could not be installed: {done.stderr[-200:]}")
    return python


def environment_of(domain: int) -> dict[str, str]:
    """Of a process in a domain of ROS on this machine alone."""
    kept = {key: value for key, value in os.environ.items() if not key.startswith(("ROS_", "PYTHON", "CYCLONE"))}
    return kept | {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}


def declared(name: str) -> Scenario:
    """A scenario, and what a drive by ROS adds to it."""
    return load_scenario(name, overrides=DECLARED)


@functools.cache
def navigator_of(name: str) -> Navigator:
    """One of a scenario, compiled."""
    return Navigator(declared(name))


def robot(python: Path, folder: Path, name: str, domain: int, *options: str, seed: int = 0) -> subprocess.Popen:
    """The process of a robot in a scenario's world."""
    scenario = declared(name)
    world, lidar = make_world(scenario.world, seed, scenario.robot.radius), scenario.lidar
    path = folder / "model.xml"
    path.write_text(mjcf(scenario, world))
    fields = {"beams": lidar.beams, "range_max": lidar.range_max, "rate": lidar.rate, "noise": lidar.noise}
    command = [str(python), str(ROBOT), str(path), json.dumps(fields), "--goal", *map(str, world.goal), *options]
    return subprocess.Popen(command, env=environment_of(domain), stdout=subprocess.PIPE, text=True)


@pytest.mark.parametrize(("name", "seconds"), [("room", 60.0), ("forest", 90.0), ("maze", 180.0)])
@pytest.mark.parametrize("seed", range(5))
def test_a_robot_that_knows_nothing_of_us_is_driven(name: str, seconds: float, seed: int, ros_python, tmp_path) -> None:
    domain, log, navigator = next(DOMAIN), tmp_path / "run.mcap", navigator_of(name)
    scenario = declared(name)
    options = ["--seconds", str(seconds + 15.0), *["--stamped"] * (name == "room")]
    process = robot(ros_python, tmp_path, name, domain, *options, seed=seed)
    try:
        base = Ros2(scenario, domain=domain, interface="lo", wait=30.0)
        driven = drive(navigator, base, log=log, seconds=seconds, until_reached=True)
        said = ended(process)
    finally:
        process.kill()
        process.communicate()
    sent, ticks = np.array(said.pop("scans")), list(read_log(log).ticks)
    came = [scan.time for tick in ticks for _, scan in tick.inputs[1]]
    statuses = collections.Counter((tick.command.status, tick.command.why) for tick in ticks).most_common(8)
    print(f"{name} {seed}: {driven}\n{said}\n{statuses}\nload {os.getloadavg()[0]:.1f}")
    world = make_world(scenario.world, seed, scenario.robot.radius)
    assert driven.end == "reached" and said["touched"] == 0 and said["twist"] == [0.0, 0.0]
    assert math.dist(said["place"], world.goal) < 2.0 * scenario.simulation.goal_tolerance
    assert len(came) == np.count_nonzero((sent > came[0] - 1e-3) & (sent < came[-1] + 1e-3))
    assert not driven.dropped and replay(log).differs is None


def ended(process: subprocess.Popen) -> dict:
    """What a robot's process says when it is ended in order."""
    process.send_signal(signal.SIGINT)
    return json.loads(process.communicate(timeout=60.0)[0])


class Restarted(Ros2):
    """A robot whose own process is killed while it drives, and started again."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.restart, self.ticks, self.twists, self.said = None, 0, [], collections.Counter()

    def drive(self, command) -> None:
        super().drive(command)
        self.ticks += 1
        self.twists.append(command.twist)
        self.said[command.status, command.why] += 1
        if self.ticks == 150:
            self.restart()


def test_the_robot_s_side_is_killed_and_started_again(ros_python, tmp_path) -> None:
    domain, scenario = next(DOMAIN), declared("room")
    processes = [robot(ros_python, tmp_path, "room", domain, "--seconds", "120")]

    def restart() -> None:
        processes[0].kill()
        processes[0].wait()
        processes[0].stdout.close()
        processes.append(robot(ros_python, tmp_path, "room", domain, "--seconds", "120"))

    try:
        base = Restarted(scenario, domain=domain, interface="lo", wait=30.0)
        base.restart = restart
        driven = drive(navigator_of("room"), base, seconds=60.0, until_reached=True)
        said = ended(processes[1])
    finally:
        for process in processes:
            process.kill()
            process.wait()
            process.stdout.close()
    print(driven, {**said, "scans": len(said["scans"])}, base.said.most_common(8))
    assert abs(base.twists[149][0]) > 0.3 and not all(map(any, base.twists[150:250]))  # it stood meanwhile
    assert driven.end == "reached" and said["touched"] == 0


def test_our_side_is_killed_and_started_again(ros_python, tmp_path) -> None:
    domain = next(DOMAIN)
    process = robot(ros_python, tmp_path, "room", domain, "--seconds", "150")
    options = ["--option", f"domain={domain}", "--option", "interface=lo", "--option", "wait=30", "--until-reached"]
    command = [sys.executable, "-m", "drake_starnav", "drive", "room", "--set", *DECLARED, *options, "--quiet"]
    ros, make, loops = Cyclone(domain, "lo"), MESSAGES, []
    speed, take = [], ros.subscribe("/odom", "nav_msgs/Odometry", 100)
    assert make is ros.types

    def driven_until(enough) -> None:
        begin = time.monotonic()
        while not enough():
            assert time.monotonic() < begin + 60.0
            speed.extend(each.twist.twist.linear.x for each in take())
            time.sleep(0.02)

    try:
        loops.append(subprocess.Popen(command))
        driven_until(lambda: speed[-1:] > [0.6])
        loops[0].kill()
        driven_until(lambda: len(speed) > 100 and max(map(abs, speed[-50:])) < 0.02)
        loops.append(subprocess.Popen(command))
        assert loops[1].wait(timeout=120.0) == 0
        said = ended(process)
    finally:
        for each in (process, *loops):
            each.kill()
            each.communicate()
        ros.close()
    assert said["touched"] == 0 and said["twist"] == [0.0, 0.0]


BY_RCLPY = """
import json, sys, time
from drake_starnav.runtime.ros2_base import Base, open_middleware
base, ros = Base("/cmd_vel", True, False, frame="base"), open_middleware()
take = ros.subscribe("/scan", "sensor_msgs/LaserScan", 5)
came, found = [], []
for _ in range(100):
    base.drive([0.25, -0.5])
    came += [[list(each.ranges), each.header.frame_id] for each in take()]
    found = found or ros.endpoints("/scan", True)
    time.sleep(0.05)
print(json.dumps([type(ros).__name__, came[-1:], found, ros.topics()]))
ros.close()
base.close()
"""


def test_where_rclpy_is_installed_it_is_used(ros_python) -> None:
    domain = next(DOMAIN)
    ros, make, twists = Cyclone(domain, "lo"), MESSAGES, []
    take = ros.subscribe("/cmd_vel", "geometry_msgs/TwistStamped", 5)
    send = ros.publish("/scan", "sensor_msgs/LaserScan")
    environment = {**environment_of(domain), "PYTHONPATH": str(ROOT)}
    process = subprocess.Popen([str(ros_python), "-c", BY_RCLPY], env=environment, stdout=subprocess.PIPE, text=True)
    begin, heard = time.monotonic(), []
    while process.poll() is None and time.monotonic() < begin + 60.0:
        send(make.LaserScan(header=make.Header(frame_id="laser"), ranges=[1.0, math.inf]))
        twists += take()
        heard = heard or ros.endpoints("/cmd_vel", True)
        time.sleep(0.05)
    name, came, found, topics = json.loads(process.communicate(timeout=60.0)[0])
    assert name == "Rclpy" and came == [[[1.0, math.inf], "laser"]]
    assert found == [["/scan", "sensor_msgs/LaserScan", False]] and "/scan" in topics
    assert heard == [("/cmd_vel", "geometry_msgs/TwistStamped", False)]
    last = twists[-1]
    assert (last.twist.linear.x, last.twist.angular.z, last.header.frame_id) == (0.25, -0.5, "base")
    assert abs(last.header.stamp.sec - time.time()) < 60.0
    ros.close()
