"""Each term of the error budget bounds what it is for."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.systems.analysis import Simulator

from drake_starnav.control import ControllerParameters
from drake_starnav.geometry.se2 import compose_poses
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.moving.parameters import DynamicObstacleParameters
from drake_starnav.robot import RobotParameters
from drake_starnav.robot.motion import convert_to_velocity, predict_pose
from drake_starnav.scenario.error_budget import evaluate_error_budget
from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.scenario.schema import DriveParameters, LocalizationParameters, Scenario, SimulationParameters
from drake_starnav.station.navigation_station import NavigationStation
from drake_starnav.surroundings.margins import SCAN_PATIENCE
from drake_starnav.worlds.world import World
from tests.helpers.motions import limited_twist

RATE = ControllerParameters().rate
KNOWN = 1.0 / LidarParameters().rate + 1.0 / RATE
"""For so long the robot drives by one scan."""
NOMINAL = 0.004 + 0.003 + 0.75 * LidarParameters().noise
TRACK_SHARE = 0.65
"""The wheels are no farther than this share of the robot's radius from its axis."""


def margin_of(**sections: Any) -> float:
    """The safety margin of a scenario with these sections, m."""
    return evaluate_error_budget(Scenario("declared", None, **sections)).total


def share(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers of a range, its ends among them."""
    return st.one_of(st.sampled_from((low, high)), st.floats(low, high))


def scenarios() -> st.SearchStrategy[Scenario]:
    """Scenarios of all kinds."""
    return st.builds(
        Scenario,
        st.just("declared"),
        st.none(),
        lidar=st.builds(
            LidarParameters,
            noise=share(0.0, 0.1),
            quantisation=share(0.0, 0.1),
            beams=st.integers(36, 1440),
            rate=share(1.0, 40.0),
            delay=share(0.0, 0.5),
            scan_loss=share(0.0, 0.5),
            rolling=st.booleans(),
        ),
        drive=st.builds(DriveParameters, delay=share(0.0, 1.0), error=share(0.0, 0.1), slip=share(0.0, 0.2)),
        robot=st.builds(
            RobotParameters,
            radius=share(0.1, 1.0),
            max_speed=share(0.1, 3.0),
            max_yaw_rate=share(0.2, 6.0),
            max_acceleration=share(0.2, 6.0),
            max_yaw_acceleration=share(0.5, 20.0),
        ),
        controller=st.builds(ControllerParameters, rate=share(5.0, 100.0)),
        obstacles=st.builds(DynamicObstacleParameters, max_speed=share(0.0, 3.0)),
        simulation=st.builds(SimulationParameters, time_step=share(0.001, 0.02)),
    )


@pytest.mark.parametrize(
    "section, changes, error",
    [
        ("lidar", {"noise": 0.03}, 0.015),
        ("lidar", {"noise": 0.005, "beams": 720}, -0.75 * 0.005),
        ("drive", {"error": 0.02}, 0.02),
        ("lidar", {"quantisation": 0.1}, 0.05),
        ("lidar", {"beams": 36}, 0.87 * (0.57 + 0.8 * KNOWN) * math.pi / 18 - 0.01),
        ("lidar", {"beams": 345}, 0.0),
        ("lidar", {"beams": 720, "dropout": 0.5, "outliers": 0.1, "delay": 0.2, "scan_loss": 0.3}, 0.0),
        ("lidar", {"delay": 0.1}, 0.87 * (0.57 + 0.8 * (KNOWN + 0.1)) * math.pi / 180 - 0.01),
        ("lidar", {"scan_loss": 0.1}, 0.87 * (0.57 + 0.8 * (KNOWN + 0.1)) * math.pi / 180 - 0.01),
        ("lidar", {"silence_duration": 1.0}, 0.87 * (0.57 + 0.8 * (KNOWN + 0.1)) * math.pi / 180 - 0.01),
        ("localization", {"drift": 0.02}, 0.02 * 0.8),
        ("localization", {"jump": 0.01}, 0.01),
        ("localization", {"jump": 1.0}, 0.02),
        ("drive", {"delay": 0.1}, 0.87 * (0.57 + 0.8 * (KNOWN + 0.1)) * math.pi / 180 - 0.01),
        (
            "drive",
            {"delay": 0.5},
            0.04 * 2.0 * 0.5 * (0.5 * 0.8 * 0.5 + 0.32) - 0.013 + 0.87 * (0.57 + 0.8 * (KNOWN + 0.5)) * math.pi / 180,
        ),
        ("drive", {"slip": 0.05}, 0.05 * (0.8 / 0.25 * 0.8 * 0.64 / 6.0 + 0.65 * 0.25)),
        ("localization", {"jump": 0.015, "jump_interval": 0.2}, 0.015 * (1 + 5)),
        ("robot", {"mass_error": 0.2}, 0.0),
    ],
)
def test_each_fault_s_part_of_the_margin(section, changes, error):
    kind = type(getattr(Scenario("none", None), section))
    assert margin_of(**{section: kind(**changes)}) == pytest.approx(NOMINAL + error)


@pytest.mark.parametrize(
    ("rate", "changes", "error"),
    [
        (50.0, {}, 0.0),
        (20.0, {}, 0.0),
        (10.0, {}, 0.005 + 0.02 * 0.32 - 0.004),
        (5.0, {}, 0.02 + 0.08 * 0.32 - 0.004),
        (10.0, {"max_acceleration": 4.0}, 0.02 + 0.02 * 0.08 - 0.004),
        (40.0, {"max_speed": 2.0, "max_acceleration": 3.0, "max_yaw_acceleration": 10.0}, 0.0),
    ],
)
def test_rare_commands_need_a_margin(rate, changes, error):
    robot = dataclasses.replace(RobotParameters(), **changes)
    lidar = LidarParameters(beams=720)  # no corner is far enough away
    margin = margin_of(lidar=lidar, robot=robot, controller=ControllerParameters(rate=rate))
    assert margin == pytest.approx(NOMINAL + error)


@pytest.mark.parametrize("yaw_rate", [0.8, 2.0])
@pytest.mark.parametrize("drift", [0.0, 0.02])
def test_a_heading_that_errs_counts_at_the_farthest_corner_of_a_footprint(drift: float, yaw_rate: float):
    """By 4 mrad, and by the drift for each radian that the robot may turn until it stands; a disc hides it."""
    corners = ((0.4, 0.3), (-0.4, 0.3), (-0.4, -0.3), (0.4, -0.3))
    lidar, drifting = LidarParameters(beams=3600, rate=5.0, delay=0.1), LocalizationParameters(drift=drift)
    margins = [
        margin_of(lidar=lidar, localization=drifting, robot=robot) - 0.5 * robot.shape.sampling
        for changes in ({"footprint": corners}, {"radius": 0.5})
        for robot in (RobotParameters(max_yaw_rate=yaw_rate, **changes),)
    ]
    turned = yaw_rate * ((1.0 + SCAN_PATIENCE) / 5.0 + 0.8 + 0.1)
    assert margins[0] - margins[1] == pytest.approx(0.5 * (0.01 + drift * turned))


def late_errors(robot: RobotParameters, delay: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """By how much a driven robot is elsewhere, m, and turned otherwise, rad, than its late commands let expect."""
    world, drive, period = World("open", (0, 0, 0), (5, 0)), DriveParameters(delay=delay), 1.0 / RATE
    station = NavigationStation(world, Scenario("test", None, robot, LidarParameters(beams=36, rate=1.0), drive=drive))
    simulator, rng = Simulator(station), np.random.default_rng(seed)
    context, command = simulator.get_mutable_context(), station.GetInputPort("drive.twist_command")
    most = np.array([robot.max_speed] * (len(robot.drive.components) - 1) + [robot.limits.max_yaw_rate])
    least = np.array([0.0, *-most[1:]])
    twist = wanted = np.zeros(len(most))
    sent = [twist] * round(delay / period)
    poses, expected = [], []
    command.FixValue(context, twist)
    for k in range(600):
        if rng.random() < 0.03:
            wanted = robot.drive.saturate(rng.uniform(least, most), robot.limits)
        simulator.AdvanceTo(k * period)
        poses.append(station.GetOutputPort("localization.pose").Eval(context).copy())
        pending = np.array([(*convert_to_velocity(each), period) for each in sent])
        expected.append(predict_pose(poses[-1], pending, delay, robot.limits))
        twist = limited_twist(twist, wanted, robot, period)
        command.FixValue(context, twist)
        sent = [*sent[1:], twist]
    late = len(sent)
    off = np.array(poses)[late:] - np.array(expected)[:-late]
    return np.hypot(*off[:, :2].T), np.abs((off[:, 2] + math.pi) % (2.0 * math.pi) - math.pi)


@pytest.mark.parametrize("delay", [0.1, 1.0])
@pytest.mark.parametrize("model", ["starbot", "jackal", "omnibot", "carbot"])
def test_the_margin_covers_where_late_commands_find_the_robot(model, delay):
    quick = [f"robot.max_{name}" for name in ("speed=2", "acceleration=3", "yaw_rate=4", "yaw_acceleration=10")]
    robot = load_scenario("forest", overrides=[f"robot.model={model}", *(quick if model == "jackal" else ())]).robot
    away, turned = late_errors(robot, delay, seed=0)
    margin = margin_of(drive=DriveParameters(delay=delay), robot=robot)
    assert (away + turned * 0.5 * robot.max_speed**2 / robot.max_acceleration).max() < margin


@pytest.mark.parametrize("delay", [0.1, 0.5, 1.0])
def test_the_slip_s_part_bounds_the_sideways_deviation_of_late_braking(delay):
    """One wheel slips, and what brakes the robot from full speed is on its way."""
    robot, slip, step = RobotParameters(), 0.05, 1e-3
    pose, v, late = np.zeros(3), robot.max_speed, delay + 1.0 / RATE
    while v > 0.0:
        pose = compose_poses(pose, (v * step, 0.0, slip * v / robot.radius * step))
        late -= step
        v -= robot.max_acceleration * step if late < 0.0 else 0.0
    drive = DriveParameters(slip=slip, delay=delay)
    lidar = LidarParameters(beams=1440)
    bound = margin_of(lidar=lidar, drive=drive) - margin_of(lidar=lidar, drive=DriveParameters(delay=delay))
    bound -= slip * TRACK_SHARE * robot.radius
    assert bound / 1.01 <= pose[1] <= bound * 1.01


@pytest.mark.parametrize("turning", [0.25, 0.5, 0.75])
@pytest.mark.parametrize("rate, lost, yaw_rate", [(20.0, 0.0, 2.0), (20.0, 0.5, 2.0), (5.0, 0.7, 15.0), (1.0, 0.0, 6)])
def test_the_drift_s_part_bounds_how_far_the_believed_heading_leads_astray(rate, lost, yaw_rate, turning):
    """Since the last scan the robot has turned on the spot for a share of the time, then it drives on, and brakes."""
    robot = RobotParameters(max_acceleration=4.0, max_yaw_rate=yaw_rate)
    lidar, drift = LidarParameters(beams=1440, rate=rate, scan_loss=lost), 0.05
    time = (SCAN_PATIENCE if lost else 1.0) / rate + 1.0 / RATE
    turned = yaw_rate * time * turning
    way = robot.max_speed * time * (1.0 - turning) + 0.5 * robot.max_speed**2 / robot.max_acceleration
    astray = way * 2.0 * math.sin(0.5 * drift * turned)
    bound = margin_of(lidar=lidar, localization=LocalizationParameters(drift=drift), robot=robot)
    assert math.hypot(astray, drift * way) <= bound


@pytest.mark.parametrize(("rate", "braking"), [(20.0, 4.0), (5.0, 1.0), (1.0, 0.3), (40.0, 0.2)])
def test_the_drift_s_part_bounds_it_for_a_base_that_drives_on_while_it_turns(rate: float, braking: float) -> None:
    robot = RobotParameters(base="omnidirectional", max_acceleration=braking, max_yaw_rate=6.0)
    lidar, drift, step = LidarParameters(beams=1440, rate=rate), 0.05, 1e-3
    v, turned, astray, way, left = robot.max_speed, 0.0, 0.0, 0.0, 1.0 / rate + 1.0 / RATE
    while v > 0.0:
        turned, way = turned + robot.max_yaw_rate * step, way + v * step
        astray, left = astray + drift * turned * v * step, left - step
        v -= braking * step if left < 0.0 else 0.0
    parts = (margin_of(lidar=lidar, robot=robot, localization=LocalizationParameters(drift=d)) for d in (drift, 0.0))
    assert astray + drift * way <= 1.01 * (next(parts) - next(parts))


@given(st.floats(0.0, 0.2), st.floats(0.0, 0.2), st.floats(-1.0, 1.0), st.sampled_from(["jackal", "carrier", "carbot"]))
def test_the_slip_s_part_bounds_how_far_the_corners_of_a_footprint_get_astray(left, right, turning, model) -> None:
    """Whatever the robot does until it stands, on wheels as near to each other as its cover radius."""
    robot = load_scenario("forest", overrides=[f"robot.model={model}"]).robot
    limits, step, slip, half = robot.limits, 1e-3, max(left, right), 0.5 * robot.shape.cover_radius
    v, omega, hold, heading = robot.max_speed, turning * robot.max_yaw_rate, 1.0 / RATE, 0.0
    while v > 0.0 or abs(omega) > 0.0:
        if model == "carbot":
            omega = v * turning * limits.max_yaw_rate
        lost = (left * (v - omega * half), right * (v + omega * half))
        heading, hold = heading + (lost[0] - lost[1]) / (2.0 * half) * step, hold - step
        if hold < 0.0:
            v = max(v - robot.max_acceleration * step, 0.0)
            omega -= math.copysign(min(robot.max_yaw_acceleration * step, abs(omega)), omega)
    parts = [margin_of(robot=robot, drive=DriveParameters(slip=each)) for each in (slip, 0.0)]
    assert abs(heading) * robot.shape.lever <= 1.02 * (parts[0] - parts[1]) + 1e-6


@given(st.floats(0.001, 0.1))
def test_the_slip_s_part_bounds_how_far_the_robot_gets_by_turning_round_on_the_spot(slip):
    """The left wheel keeps what it is told, the right one loses its share, for half a turn."""
    robot, step = RobotParameters(), 1e-3
    half_track, speed = TRACK_SHARE * robot.radius, 0.3
    pose, away = np.zeros(3), 0.0
    while pose[2] < math.pi:
        left, right = -speed, speed * (1.0 - slip)
        pose = compose_poses(pose, (0.5 * (left + right) * step, 0.0, 0.0))
        pose[2] += (right - left) / (2.0 * half_track) * step
        away = max(away, float(np.hypot(*pose[:2])))
    bound = margin_of(drive=DriveParameters(slip=slip))
    assert 0.9 * slip * half_track < away <= bound * 1.01


def test_obstacles_must_be_seen_from_farther_away_by_the_room_that_they_are_left():
    obstacles = DynamicObstacleParameters(max_speed=1.5, deceleration=2.5)
    without = dataclasses.replace(obstacles, deceleration=0.0)
    farther, needed = (
        evaluate_error_budget(Scenario("room", None, obstacles=each)).symbols["F"] for each in (obstacles, without)
    )
    assert farther - needed == pytest.approx(0.45)


@given(given=scenarios(), robot_speed=share(0.1, 1.0))
def test_a_robot_stands_before_it_meets_what_comes_from_out_of_range(given: Scenario, robot_speed: float):
    """Head-on, at any speed of the robot, and seen by the last of the scans that may be late or lost."""
    step, speed = given.simulation.time_step, given.obstacles.max_speed
    drive = math.ceil(given.drive.delay / step - 1e-9) * step
    scan = (3.0 if given.lidar.scan_loss else 1.0) / given.lidar.rate
    if given.lidar.rolling:  # the beam that missed it is as old as a sweep
        scan += 1.0 / given.lidar.rate
    # just after a scan it is at the end of the range; the next one arrives just after a command, which is held
    arrives, commanded = scan + given.lidar.delay, scan + given.lidar.delay + 1.0 / given.controller.rate
    assert commanded >= arrives
    v, range_max = robot_speed * given.robot.max_speed, evaluate_error_budget(given).symbols["F"]
    braking = v / given.robot.max_acceleration
    ways = v * (commanded + drive) + 0.5 * v * braking, speed * (commanded + drive + braking)
    assert range_max - sum(ways) >= -1e-9
    if robot_speed == 1.0:  # and it is no farther than required, up to a step
        assert range_max - sum(ways) <= (v + speed) * step + 1e-9
