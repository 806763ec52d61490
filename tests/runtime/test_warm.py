"""After the warm-up nothing is compiled, nor loaded from Numba's cache, while the robot drives."""

import subprocess
import sys

import pytest

DRIVE = """
import sys, time
from numba.core.dispatcher import Dispatcher
from drake_starnav import load_scenario
from drake_starnav.runtime import Navigator
from tests.helpers.bare_robot import BareRobot

def loaded():
    found = {}
    for module in [m for name, m in list(sys.modules.items()) if name.startswith("drake_starnav.")]:
        for each in vars(module).values():
            if isinstance(each, Dispatcher):
                found[f"{each.py_func.__module__}.{each.py_func.__name__}"] = len(each.overloads)
    return found

name, seed, *overrides = sys.argv[1:]
scenario = load_scenario(name, overrides=overrides)
robot = BareRobot(scenario, seed=int(seed))
robot.read(); robot.scans = 0
begin = time.perf_counter()
navigator = Navigator(scenario)
print(f"warm after {time.perf_counter() - begin:.1f} s", file=sys.stderr)
before = loaded()
while robot.time < 60.0:
    command = navigator.step(*robot.read())
    robot.drive(command)
    if command.status == "reached":
        break
print(robot.time, command, file=sys.stderr)
new = {name: count for name, count in loaded().items() if count > before.get(name, 0)}
print(sorted(name for name in new if "worlds." not in name))
"""
KINDS = {
    "forest": ("forest", "0"),
    "maze": ("maze", "1"),
    "room": ("room", "2", "localization.drift=0.02"),
    "polygon": ("maze", "3", "robot.footprint=[[-0.2,-0.15],[0.3,-0.15],[0.3,0.15],[-0.2,0.15]]"),
    "omnidirectional": ("forest", "2", "robot.base=omnidirectional", "robot.model=omnibot"),
    "car": ("forest", "3", "robot.base=car", "robot.model=carbot"),
    "movers": ("stop_and_go", "0"),
    "noise": ("forest", "4", "lidar.noise=0.05", "lidar.dropout=0.05", "lidar.outliers=0.01"),
    "delay": ("forest", "5", "drive.delay=0.1", "lidar.delay=0.05", "localization.jump=0.1"),
    "narrow view": ("forest", "6", "lidar.angle_min=-2.3", "lidar.angle_max=2.3", "lidar.rolling=true"),
}


@pytest.mark.parametrize("kind", [pytest.param(k, marks=() if k == "forest" else pytest.mark.slow) for k in KINDS])
def test_nothing_is_compiled_while_driving(kind) -> None:
    done = subprocess.run([sys.executable, "-c", DRIVE, *KINDS[kind]], capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    print(done.stderr)
    assert done.stdout.strip() == "[]", done.stderr
