"""The plant of a trial is exact enough for a small robot: it strays little from one with steps of 0.5 ms."""

import math
from pathlib import Path

import numpy as np
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput, TrajectorySource, ZeroOrderHold
from pydrake.trajectories import PiecewisePolynomial

from drake_starnav import Scenario, World, derive_margins, make_simulator
from drake_starnav.station.navigation_station import add_station
from tests.helpers.cart import cart_scenario

PERIOD, SECONDS = 0.025, 3.0


def random_twists(scenario: Scenario) -> np.ndarray:
    """Commands within a robot's limits, shape (n, 2): it speeds up, brakes, turns and backs by chance."""
    rng, robot = np.random.default_rng(0), scenario.robot
    most = np.array((robot.max_speed, robot.max_yaw_rate))
    change = PERIOD * np.array((robot.max_acceleration, robot.max_yaw_acceleration))
    twist, twists = np.zeros(2), []
    while len(twists) * PERIOD < SECONDS:
        aim = most * rng.choice((-1.0, 0.0, 1.0), 2, p=(0.3, 0.2, 0.5)) * rng.uniform(0.3, 1.0, 2)
        for _ in range(rng.integers(4, 30)):
            twist = twist + np.clip(aim - twist, -change, change)
            twists.append(twist)
    return np.array(twists)


def driven_states(scenario: Scenario, **settings: float) -> np.ndarray:
    """The robot's states under the random twists, shape (n, 5)."""
    builder, twists = DiagramBuilder(), random_twists(scenario)
    station = add_station(builder, World("open", (0.0, 0.0, 0.0), (5.0, 0.0)), scenario, continuous=True)
    commands = PiecewisePolynomial.ZeroOrderHold(PERIOD * (np.arange(len(twists)) - 0.5), twists.T)
    source = builder.AddSystem(TrajectorySource(commands))
    hold = builder.AddSystem(ZeroOrderHold(PERIOD, 2))  # steps end at its events, as at those of a shield
    builder.Connect(source.get_output_port(), hold.get_input_port())
    builder.Connect(hold.get_output_port(), station.GetInputPort("drive.twist_command"))
    log = LogVectorOutput(station.GetOutputPort("localization.state"), builder, PERIOD)
    simulator = make_simulator(builder.Build(), settings=settings)
    simulator.AdvanceTo(SECONDS)
    return log.FindLog(simulator.get_context()).data().T.copy()


def displacements(states: np.ndarray, span: int) -> np.ndarray:
    """Where a robot is `span` samples later, in the frame where it was, shape (n, 2), m."""
    (dx, dy), yaw = (states[span:] - states[:-span])[:, :2].T, states[:-span, 2]
    return np.column_stack((np.cos(yaw) * dx + np.sin(yaw) * dy, np.cos(yaw) * dy - np.sin(yaw) * dx))


def test_the_safety_margin_is_several_times_the_error_of_the_plant(tmp_path: Path) -> None:
    scenario = cart_scenario(0.02, tmp_path)
    robot = scenario.robot
    trusted = 1.0 / scenario.lidar.rate + robot.max_speed / robot.max_acceleration  # so long the certificate holds, s
    span = math.ceil(trusted / PERIOD)
    plant, exact = driven_states(scenario), driven_states(scenario, max_step_size=0.0005)
    error = np.hypot(*(displacements(plant, span) - displacements(exact, span)).T).max()
    assert derive_margins(scenario).safety > 4.0 * error > 0.0
