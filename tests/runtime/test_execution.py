"""What is told against what is done."""

import math

import numpy as np
import pytest

from drake_starnav import LaserScan, Scenario, parse_scenario
from drake_starnav.runtime import Odometry
from drake_starnav.runtime.execution import (
    CommandedVelocity,
    Execution,
    add_command,
    compare_motion,
    describe_not_executed,
    is_pose_denied,
    judge_execution,
)
from drake_starnav.runtime.intake import PosedScan

PLAIN = Scenario("plain", None)


def run(speed=1.0, turning=1.0, delay=0.0, lag=0.0, seconds=4.0, v=0.8, omega=0.3):
    """Commands and odometry of a base that drives these shares of what it is told, late, and with a lag, s."""
    told, rows, pose, now = [], [], np.zeros(3), np.zeros(2)
    for k in range(int(seconds / 0.02)):
        t = 0.02 * k
        told.append(CommandedVelocity(t, min(v, t), 0.0, omega * math.sin(2.0 * t)))
        late = told[max(k - round(delay / 0.02), 0)]
        wanted = np.array((speed * late.v_x, turning * late.turning)) if t >= delay else np.zeros(2)
        now = wanted if lag == 0.0 else now + (wanted - now) * 0.02 / lag
        rows.append(Odometry(t, *pose, *now))
        pose = pose + 0.02 * np.array((now[0] * math.cos(pose[2]), now[0] * math.sin(pose[2]), now[1]))
    return told, rows


@pytest.mark.parametrize("base", [{}, {"delay": 0.1}, {"lag": 0.1}, {"speed": 1.08}, {"turning": 0.9}])
def test_a_base_that_does_what_it_is_told(base) -> None:
    told, rows = run(**base)
    scenario = parse_scenario(f"drive: {{delay: {base.get('delay', 0.0)}}}", name="late")
    for k in range(3, len(rows)):
        assert describe_not_executed(told[:k], rows[:k], scenario) == ""


@pytest.mark.parametrize(
    ("base", "text"),
    [({"speed": 0.0}, "driven"), ({"speed": 0.5}, "driven"), ({"speed": 1.4}, "driven"), ({"turning": -1.0}, "turned")],
)
def test_one_that_does_not(base, text) -> None:
    told, rows = run(**base, omega=1.0)
    found = [describe_not_executed(told[:k], rows[:k], PLAIN) for k in range(len(rows))]
    assert any(text in each for each in found)


def test_one_that_moves_though_told_to_stand_or_slips_more_than_declared() -> None:
    told = [CommandedVelocity(0.02 * k, 0.0, 0.0, 0.0) for k in range(60)]
    rows = [Odometry(0.02 * k, 0.004 * k, 0.0, 0.0, 0.2, 0.0) for k in range(60)]
    assert "0.00 m commanded" in describe_not_executed(told, rows, PLAIN)
    slipping = run(speed=0.8)
    assert describe_not_executed(*slipping, PLAIN)
    assert describe_not_executed(*slipping, parse_scenario("drive: {slip: 0.2}", name="slippery")) == ""


def test_a_car_that_drives_backwards_and_aside() -> None:
    told = [CommandedVelocity(0.02 * k, -0.4, 0.2, 0.1) for k in range(60)]
    yaw = 0.1 * 0.02
    rows, pose = [], np.zeros(3)
    for k in range(60):
        rows.append(Odometry(0.02 * k, *pose, -0.4, 0.1, 0.2))
        c, s = math.cos(pose[2]), math.sin(pose[2])
        pose = pose + np.array(((-0.4 * c - 0.2 * s) * 0.02, (-0.4 * s + 0.2 * c) * 0.02, yaw))
    asked, driven, time = compare_motion(told, rows, 0.0)
    assert driven == pytest.approx(asked, abs=5e-3) and time == pytest.approx(1.18)


def looks(moved, ranges, pose=(0.0, 0.0, 0.0)):
    """Two seconds of scans with these ranges, in a room in which all of them grow by `moved`, m."""
    measured = [(0.1 * k, ranges + 0.05 * k * moved) for k in range(20)]
    scans = [LaserScan(time, -1.0, 0.02, 0.0, 5.0, row, lost_beams=True) for time, row in measured]
    return [PosedScan(0, scan, np.array(pose)) for scan in scans]


def test_scans_speak_against_a_pose_that_stays() -> None:
    ranges = np.linspace(1.0, 3.0, 100)
    assert is_pose_denied(looks(0.5, ranges)) and not is_pose_denied(looks(0.02, ranges))
    few = np.where(np.arange(100) < 5, 1.0, math.inf)
    assert is_pose_denied(looks(0.0, few))  # nobody knows
    moved = [look._replace(pose=np.array((0.1 * k, 0.0, 0.0))) for k, look in enumerate(looks(0.5, ranges))]
    assert not is_pose_denied(moved) and not is_pose_denied([])
    fewer = looks(0.0, ranges)[:1] + looks(0.0, ranges[:50])
    assert is_pose_denied(fewer)


def test_a_base_is_tried_again_once_it_stands_and_once_only() -> None:
    execution, rows, said = Execution(), [], []
    for k in range(400):
        t = 0.02 * k
        rows.append(Odometry(t, 0.0, 0.0, 0.0, 0.0, 0.0))
        execution = judge_execution(execution, t, rows, PLAIN)
        execution = add_command(execution, CommandedVelocity(t, 0.0 if execution.why else 0.8, 0.0, 0.0), 0.0)
        said.append((bool(execution.why), execution.needs_new_goal))
    changes = [each for each, before in zip(said[1:], said, strict=False) if each != before]
    assert changes == [(True, False), (False, False), (True, True)]
    assert execution.fault_text.endswith("until the goal is given anew")
