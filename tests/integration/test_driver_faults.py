"""Drivers that fail at 0.8 m/s, in MuJoCo: the robot stands soon, and touches nothing."""

import os
import pickle
import signal
import socket
import subprocess
import sys
import threading
import time
from dataclasses import replace

import numpy as np
import pytest

from drake_starnav import load_scenario
from drake_starnav.runtime import Navigator
from tests.helpers.bare_robot import EPOCH
from tests.helpers.driver_faults import BEGIN, FAULTS, HARMLESS, SLOWER, Faults, Harmless, driven

pytest.importorskip("mujoco", reason="the extra simulators is not installed")
pytest.importorskip("irsim", reason="the extra simulators is not installed")
from tests.helpers.irsim_robot import IrsimRobot  # noqa: E402
from tests.helpers.mujoco_robot import MujocoRobot  # noqa: E402

pytestmark = pytest.mark.slow
FOREST = load_scenario("forest")
WAY, LONGER_WAY = 0.45, 0.6
"""It drives on by less than this, and by less where it may take longer to be noticed, m."""
WORLDS = range(20)


@pytest.fixture(scope="module")
def forest() -> Navigator:
    return Navigator(FOREST)


@pytest.mark.parametrize("seed", WORLDS)
def test_what_goes_wrong_stops_the_robot(forest, seed) -> None:
    for kind in FAULTS:
        forest.reset()
        robot, within, fault = MujocoRobot(FOREST, seed=seed), SLOWER.get(kind, 1.0), getattr(Faults(), kind)
        driven(forest, robot, BEGIN)
        speed, way = robot.twist[0], robot.way
        commands = driven(forest, robot, BEGIN + within + 0.02, fault)
        stood, drove = robot.stands, robot.way - way
        commands += driven(forest, robot, BEGIN + within + 1.0, fault)  # and stays so
        print(f"{seed:3} {kind:24} {speed:.2f} m/s, then {drove:.2f} m; {commands[-1].why}")
        assert stood and robot.stands and not robot.touched, kind
        assert commands[-1].status == "standing" and commands[-1].why, kind
        assert drove < (LONGER_WAY if kind in SLOWER else WAY), kind


@pytest.mark.parametrize("seed", WORLDS)
def test_what_does_no_harm_does_not_stop_it(forest, seed) -> None:
    for kind in HARMLESS:
        forest.reset()
        robot = MujocoRobot(FOREST, seed=seed)
        commands = driven(forest, robot, BEGIN + 3.0, getattr(Harmless(), kind))
        assert commands[-1].status == "driving" and robot.way > 1.2 and not robot.touched, kind


@pytest.mark.parametrize("name", ["forest", "maze", "room"])
@pytest.mark.parametrize("kind", [MujocoRobot, IrsimRobot])
def test_it_arrives(name, kind) -> None:
    scenario = load_scenario(name)
    robot = kind(scenario)
    commands = driven(Navigator(scenario, warm=False), robot, robot.world.timeout)
    assert commands[-1].status == "reached" and not robot.touched


class UdpRobot:
    """The robot's side of the loop: messages from a port, twists through a watchdog to another."""

    watched = True

    def __init__(self, scenario, port: int, base_port: int) -> None:
        from drake_starnav.runtime.watchdog import Watched, read_ramp

        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", port))
        self.socket.setblocking(False)
        self.base = Watched(f"{__name__}:UdpBase", {"port": base_port}, read_ramp(scenario.robot.limits))
        self.goal = None

    def read(self):
        scans, rows = [], []
        while True:
            try:
                data = self.socket.recv(65536)
            except BlockingIOError:
                return time.time(), scans, rows, self.goal
            came, odometry, self.goal = pickle.loads(data)
            scans += came
            rows += odometry

    def drive(self, command) -> None:
        self.base.drive(command.twist)

    def close(self) -> None:
        self.base.close()
        self.socket.close()


class UdpBase:
    """The base, without a timeout: what it was told last it does."""

    def __init__(self, port: int) -> None:
        self.socket, self.port = socket.socket(socket.AF_INET, socket.SOCK_DGRAM), port

    def drive(self, twist) -> None:
        self.socket.sendto(pickle.dumps(tuple(twist)), ("127.0.0.1", self.port))

    def close(self) -> None:
        self.socket.close()


class RealTime(threading.Thread):
    """MuJoCo by the clock of the wall, behind two ports."""

    def __init__(self, port: int) -> None:
        super().__init__(daemon=True)
        self.robot, self.port, self.over = MujocoRobot(FOREST), port, False
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.setblocking(False)

    def run(self) -> None:
        begin, twist = time.time(), (0.0, 0.0)
        while not self.over:
            time.sleep(max(begin + self.robot.time - time.time(), 0.0))
            shift = begin - EPOCH
            reading = self.robot.read()
            scans = [replace(scan, time=scan.time + shift) for scan in reading.scans]
            rows = [row._replace(time=row.time + shift) for row in reading.odometry]
            self.socket.sendto(pickle.dumps((scans, rows, reading.goal)), ("127.0.0.1", self.port))
            try:
                while True:
                    twist = pickle.loads(self.socket.recv(1000))
            except (BlockingIOError, ConnectionRefusedError):
                pass
            self.robot.drive(type("Command", (), {"twist": np.array(twist)}))
        self.socket.close()


@pytest.mark.parametrize("sent", [signal.SIGKILL, signal.SIGSTOP, signal.SIGTERM])
def test_a_process_that_is_ended_or_halted(sent) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    plant = RealTime(port)
    options = ["--option", f"port={port}", "--option", f"base_port={plant.socket.getsockname()[1]}"]
    command = [sys.executable, "-m", "drake_starnav", "drive", "forest", "--robot", f"{__name__}:UdpRobot", *options]
    loop = subprocess.Popen([*command, "--quiet"])
    plant.start()
    until = time.monotonic() + 150.0
    while plant.robot.twist[0] < 0.75:
        assert time.monotonic() < until and loop.poll() is None
        time.sleep(0.01)
    way = plant.robot.way
    os.kill(loop.pid, sent)
    time.sleep(2.5)
    drove, stands = plant.robot.way - way, plant.robot.stands
    loop.send_signal(signal.SIGCONT)
    if sent == signal.SIGSTOP:
        time.sleep(2.0)
        assert plant.robot.twist[0] > 0.3  # it drives on
        loop.terminate()
    loop.wait(20.0)
    plant.over = True
    plant.join()
    print(f"{sent.name}: {drove:.2f} m")
    assert stands and drove < 0.5 and not plant.robot.touched
