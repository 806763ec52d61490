"""After the warm-up nothing is compiled, nor loaded from Numba's cache, while the robot drives."""

import subprocess
import sys

import pytest

DRIVE = """
import sys, time
from numba.core import event
from numba.core.dispatcher import Dispatcher
from drake_starnav import load_scenario
from drake_starnav.runtime import Navigator
from drake_starnav.worlds.clearance import compute_body_clearance
from tests.helpers.bare_robot import BareRobot, TwoEyes

def loaded():
    found = {}
    for module in [m for name, m in list(sys.modules.items()) if name.startswith("drake_starnav.")]:
        for each in vars(module).values():
            if isinstance(each, Dispatcher):
                found[f"{each.py_func.__module__}.{each.py_func.__name__}"] = len(each.overloads)
    return found

name, seed, *overrides = sys.argv[1:]
scenario = load_scenario(name, overrides=overrides)
two = len(scenario.all_lidars) == 2
robot = (TwoEyes if two else BareRobot)(scenario, seed=int(seed))
robot.read(); robot.scans = 0
compute_body_clearance(robot.world, robot.pose[None], scenario.robot.shape)  # the robot's own
begin = time.perf_counter()
navigator = Navigator(scenario, mounts=TwoEyes.MOUNTS if two else None)
print(f"warm after {time.perf_counter() - begin:.1f} s", file=sys.stderr)
before, took, compiled = loaded(), [], []
while robot.time < 30.0:
    reading = robot.read()
    begin = time.thread_time()
    with event.install_recorder("numba:compile") as recorded:
        command = navigator.step(*reading)
    took.append(1e3 * (time.thread_time() - begin))
    compiled += [str(each.data["dispatcher"].py_func) for _, each in recorded.buffer if each.is_start]
    robot.drive(command)
    if command.status == "reached":
        break
took.sort()
print(f"{robot.time:.1f} s, {command.status}; ms of CPU a step: p50 {took[len(took) // 2]:.2f}, "
      f"p99 {took[int(0.99 * len(took))]:.2f}, longest {took[-1]:.2f}", file=sys.stderr)
new = {name: count for name, count in loaded().items() if count > before.get(name, 0)}
print(sorted(name for name in new if "worlds." not in name) + compiled)
"""
KINDS = {
    "forest": ("forest", "0"),
    "room": ("room", "2", "localization.drift=0.02"),
    "polygon": ("maze", "3", "robot.footprint=[[-0.2,-0.15],[0.3,-0.15],[0.3,0.15],[-0.2,0.15]]"),
    "omnidirectional": ("forest", "2", "robot.base=omnidirectional", "robot.model=omnibot"),
    "car": ("forest", "3", "robot.base=car", "robot.model=carbot", "drive.delay=0.1", "lidar.delay=0.05"),
    "movers": ("stop_and_go", "0"),
    "noise": ("forest", "4", "lidar.noise=0.05", "lidar.dropout=0.05", "lidar.outliers=0.01", "localization.jump=0.1"),
    "two lidars": ("forest", "0", "lidar.rate=10", "lidars=[{},{}]", "robot.max_speed=0.5"),
    "narrow view": ("forest", "6", "lidar.angle_min=-2.3", "lidar.angle_max=2.3", "lidar.rolling=true"),
}


@pytest.mark.parametrize(
    "kind", ["forest", *(pytest.param(kind, marks=pytest.mark.slow) for kind in KINDS if kind != "forest")]
)
def test_nothing_is_compiled_or_loaded_while_driving(kind) -> None:
    command = [sys.executable, "-c", DRIVE, *KINDS[kind]]
    done = subprocess.run(command, capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, done.stderr
    print(kind, done.stderr)
    assert done.stdout.strip() == "[]", done.stderr
