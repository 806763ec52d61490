"""Wheels grip only so much: what the certificates accept, the robots of the plant can do without sliding."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.systems.analysis import Simulator

from drake_starnav.geometry.polyline import resample_polyline
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.robot import RobotParameters
from drake_starnav.robot.motion import roll_out
from drake_starnav.scenario.error_budget import evaluate_error_budget
from drake_starnav.scenario.schema import Scenario
from drake_starnav.station.navigation_station import NavigationStation
from drake_starnav.worlds.world import World
from tests.helpers.motions import actuation, limited_twist, only_star, starred_twist

pytestmark = pytest.mark.slow

OPEN = only_star(np.full(720, 1e3))
PERIOD = 0.02


def driven(robot: RobotParameters, seed: int, count: int = 500) -> np.ndarray:
    """Commands that change twice a second, through the certificate, shape (count, 2)."""
    rng, twist, wanted, twists = np.random.default_rng(seed), np.zeros(2), np.zeros(2), []
    for _ in range(count):
        if rng.random() < 0.04:
            wanted = np.array((robot.max_speed, robot.max_yaw_rate)) * rng.uniform((0.2, -1.0), (1.0, 1.0))
        v, omega, _ = starred_twist(np.zeros(3), twist, wanted, PERIOD, robot.limits, OPEN)
        twist = limited_twist(twist, np.array((v, omega)), robot, PERIOD)
        twists.append(twist)
    return np.array(twists)


@given(st.integers(0, 1000), st.sampled_from(((1.0, 8.0), (3.0, 8.0), (5.0, 1.728))))
def test_no_command_asks_for_more_than_wheels_grip(seed, grip):
    acceleration, across = grip
    robot = RobotParameters(max_speed=5.0, max_acceleration=acceleration, max_yaw_rate=5.0, max_yaw_acceleration=15.0)
    if seed % 2:
        robot = dataclasses.replace(robot, max_acceleration=1.0, max_deceleration=acceleration)
    twists = driven(robot, seed, count=150)
    assert np.abs(twists[:, 0] * twists[:, 1]).max() <= across + 1e-6


def test_a_robot_that_cannot_turn_so_fast_is_free_to_do_all_that_it_can():
    robot = RobotParameters(max_speed=2.0, max_acceleration=3.0, max_yaw_rate=4.0, max_yaw_acceleration=10.0)
    pose, most = np.zeros(3), np.array((2.0, 4.0))
    v, omega, accepted = starred_twist(pose, most, most, PERIOD, robot.limits, OPEN)
    assert (v, omega, accepted) == (2.0, 4.0, True)


@pytest.mark.parametrize("acceleration", [2.0, 5.0])
@pytest.mark.parametrize("model, radius", [("starbot", 0.25), ("jackal", 0.334)])
def test_robots_do_not_slide_by_what_is_certified(model, radius, acceleration):
    robot = RobotParameters(model=model, radius=radius, max_speed=5.0, max_yaw_rate=5.0, max_yaw_acceleration=15.0)
    robot = dataclasses.replace(robot, max_acceleration=acceleration)
    station = NavigationStation(
        World("open", (0, 0, 0), (5, 0)), Scenario("test", None, robot, LidarParameters(beams=36, rate=1.0))
    )
    simulator = Simulator(station)
    context, slid = simulator.get_mutable_context(), []
    for k, twist in enumerate(driven(robot, seed=1)):
        station.GetInputPort("drive.twist_command").FixValue(context, twist)
        simulator.AdvanceTo((k + 1) * PERIOD)
        _, _, yaw, v, omega = station.GetOutputPort("localization.state").Eval(context)
        rates = station.GetOutputPort("cheat.robot_state").Eval(context)[
            station.plant.num_positions(station.robot_model) :
        ]
        sideways = rates[4] * math.cos(yaw) - rates[3] * math.sin(yaw)
        slid.append(abs(sideways + v * omega * station.plant.time_step()))  # the plant turns the speed one step late
    assert max(slid) < 0.05


@pytest.mark.parametrize("speed", [0.1, 0.256, 0.8])
@pytest.mark.parametrize("model, radius", [("starbot", 0.08), ("starbot", 0.25), ("starbot", 1.0), ("jackal", 0.334)])
@pytest.mark.parametrize("harder", [1.0, 3.0])
def test_robots_stray_from_their_commands_until_they_stand_by_no_more_than_the_margin_has(model, radius, speed, harder):
    """Those that brake no harder than they speed up, and those that do."""
    robot = RobotParameters(model=model, radius=radius, max_speed=speed, max_acceleration=1.25 * speed)
    robot = dataclasses.replace(robot, max_deceleration=harder * robot.max_acceleration)
    scenario = Scenario("test", None, robot, LidarParameters(beams=36, rate=1.0))
    simulator = Simulator(station := NavigationStation(World("open", (0, 0, 0), (5, 0)), scenario))
    context, rng, does = simulator.get_mutable_context(), np.random.default_rng(1), actuation(robot)
    share, twist, away = evaluate_error_budget(scenario).terms[1], np.zeros(2), []
    for k in range(1000):
        if k % 100 == 0:
            wanted = np.array((speed, robot.max_yaw_rate)) * rng.uniform((0.5, -1.0), (1.0, 1.0))
        station.GetInputPort("drive.twist_command").FixValue(context, twist)
        simulator.AdvanceTo(k * PERIOD)
        pose = station.GetOutputPort("localization.pose").Eval(context)
        if k % 100 == 40:
            wanted = np.zeros(2)
            way = resample_polyline(roll_out(pose, twist, wanted, does).position, 1e-4)
        if k % 100 >= 40:
            away.append(np.hypot(*(way - pose[:2]).T).min())
        twist = limited_twist(twist, wanted, robot, PERIOD)
    assert max(away) < share <= 0.00375 * speed
