"""A loop that falls silent: the base is ramped to zero by another process, whatever became of the first."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from drake_starnav import parse_scenario
from drake_starnav.robot.motion import Actuation
from drake_starnav.runtime.watchdog import DEADLINE, PERIOD, Ramp, Watched, read_ramp
from drake_starnav.safety.shield import make_braking_twist, ramp_twist

RAMP = Ramp(1.0, 4.0)


class FileBase:
    """A base that writes what it is told to a file, with the time."""

    def __init__(self, path: str) -> None:
        self.file = open(path, "w")  # noqa: SIM115

    def drive(self, twist) -> None:
        self.file.write(json.dumps([time.monotonic(), *twist]) + "\n")
        self.file.flush()

    def close(self) -> None:
        self.file.write("closed\n")
        self.file.close()


def told(path) -> np.ndarray:
    return np.array([json.loads(line) for line in path.read_text().splitlines() if line != "closed"])


def way(rows: np.ndarray, begin: float) -> float:
    """Driven from a time on by a base that keeps to what it was told last, m."""
    times, speeds = np.append(rows[:, 0], rows[-1, 0] + 1.0), rows[:, 1]
    return float((np.diff(np.maximum(times, begin)) * speeds).sum())


LOOP = """
import sys, time
from drake_starnav.runtime.watchdog import Ramp, Watched
base = Watched("tests.runtime.test_watchdog:FileBase", {"path": sys.argv[1]}, Ramp(1.0, 4.0))
while True:
    base.drive((0.8, 0.4))
    time.sleep(0.02)
"""


@pytest.fixture
def loop(tmp_path):
    """A process that drives at 0.8 m/s, and the file of what its base is told."""
    path = tmp_path / "told"
    process = subprocess.Popen([sys.executable, "-c", LOOP, str(path)])
    until = time.monotonic() + 60.0
    while not (path.exists() and len(told(path)) > 20):
        assert time.monotonic() < until
        time.sleep(0.05)
    yield process, path
    process.kill()
    process.wait()


@pytest.mark.parametrize("sent", [signal.SIGKILL, signal.SIGSTOP, signal.SIGTERM])
def test_a_loop_that_is_ended_or_halted(loop, sent) -> None:
    process, path = loop
    begin = time.monotonic()
    os.kill(process.pid, sent)
    time.sleep(2.0)
    rows = told(path)
    assert rows[-1, 1:].tolist() == [0.0, 0.0]
    assert way(rows, begin) < 0.5
    assert (path.read_text().endswith("closed\n")) == (sent != signal.SIGSTOP)


def test_a_loop_that_is_continued_drives_on(loop) -> None:
    process, path = loop
    os.kill(process.pid, signal.SIGSTOP)
    time.sleep(1.5)
    assert told(path)[-1, 1] == 0.0
    os.kill(process.pid, signal.SIGCONT)
    time.sleep(0.5)
    assert told(path)[-1, 1] == 0.8


@pytest.mark.realtime
def test_it_is_armed_by_the_first_twist_and_passes_on_at_once(tmp_path) -> None:
    path = tmp_path / "told"
    base = Watched(f"{__name__}:FileBase", {"path": str(path)}, RAMP)
    time.sleep(3.0)  # a warm-up
    assert not path.exists() or not len(told(path))
    while not path.exists():
        time.sleep(0.05)
    sent = time.monotonic()
    base.drive((0.5, 0.0))
    time.sleep(0.05 + DEADLINE)
    base.close()
    rows = told(path)
    assert rows[0, 0] - sent < 0.05 and rows[0, 1] == 0.5
    assert rows[-1, 1:].tolist() == [0.0, 0.0] and path.read_text().endswith("closed\n")


@pytest.mark.parametrize("base", ["differential", "omnidirectional", "car"])
@pytest.mark.parametrize("braking", [0.0, 2.5])
def test_its_ramp_is_the_shield_s(base, braking) -> None:
    robot = parse_scenario(f"robot: {{base: {base}, max_deceleration: {braking}}}", name=base).robot
    act = Actuation(robot.limits, robot.shape, PERIOD, 0.0, robot.drive)
    limits = robot.limits
    ramp = read_ramp(limits)
    twist = np.array({"differential": (0.8, -1.5), "omnidirectional": (0.5, -0.3, 1.0), "car": (0.7, 1.2)}[base])
    mine = twist.tolist()
    for _ in range(50):
        twist = ramp_twist(twist, make_braking_twist(twist, np.zeros(len(twist)), limits, False), act)
        mine = ramp.after(mine, PERIOD)
        if any(mine[:-1]):
            assert mine == pytest.approx(twist.tolist(), abs=1e-9)
    assert not any(mine[:-1])


def test_it_loads_neither_drake_nor_numpy() -> None:
    code = "import sys, drake_starnav.runtime.watchdog; print(sorted({'pydrake', 'numpy', 'numba'} & set(sys.modules)))"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert out.stdout.strip() == "[]"
