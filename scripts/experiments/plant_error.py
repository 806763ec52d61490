"""How far the plant of a robot of any size strays from a plant with steps of 0.5 ms, beside its safety margin.

The same random twists, within the robot's limits, drive both; what counts is how far their ways differ within the time
in which the certificate trusts the motion: a scan's period, and the time to brake.
Speeds that lag otherwise by a part of a step count, too. Writes a table:

    python scripts/experiments/plant_error.py
"""

import argparse
import math
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput, TrajectorySource, ZeroOrderHold
from pydrake.trajectories import PiecewisePolynomial

from drake_starnav import World, make_simulator
from drake_starnav.scenario.margins import derive_margins
from drake_starnav.scenario.schema import Scenario
from drake_starnav.station.navigation_station import add_station
from tests.helpers.cart import cart_scenario

RADII = (0.02, 0.03, 0.04, 0.06, 0.1, 0.3, 1.0, 3.0)
"""m."""
PERIOD, SECONDS, EXACT = 0.025, 3.0, 0.0005
"""Of the commands; of a drive; a step of the plant that is compared with, s."""


class PlantError(NamedTuple):
    """Of a robot of a radius, m: its plant's longest step, s, and error, m, and the safety margin, m."""

    radius: float
    step: float
    error: float
    margin: float


def plant_error(scenario: Scenario, seed: int = 0) -> PlantError:
    """Drive a robot by random twists, as the plant of a trial steps it and with steps of `EXACT`."""
    robot, twists = scenario.robot, _twists(scenario, seed)
    step, states = _driven(scenario, twists, {})
    _, exact = _driven(scenario, twists, {"max_step_size": EXACT})
    span = math.ceil((1.0 / scenario.lidar.rate + robot.max_speed / robot.max_acceleration) / PERIOD)
    error = np.hypot(*(_ways(states, span) - _ways(exact, span)).T).max()
    return PlantError(robot.radius, step, float(error), derive_margins(scenario).safety)


def _twists(scenario: Scenario, seed: int) -> np.ndarray:
    """Commands within a robot's limits, shape (n, 2): it speeds up, brakes, turns and backs by chance."""
    rng, limits = np.random.default_rng(seed), scenario.robot
    most = np.array((limits.max_speed, limits.max_yaw_rate))
    change = PERIOD * np.array((limits.max_acceleration, limits.max_yaw_acceleration))
    twist = np.zeros(2)
    twists: list[np.ndarray] = []
    while len(twists) * PERIOD < SECONDS:
        aim = most * rng.choice((-1.0, 0.0, 1.0), 2, p=(0.3, 0.2, 0.5)) * rng.uniform(0.3, 1.0, 2)
        for _ in range(rng.integers(4, 30)):
            twist = twist + np.clip(aim - twist, -change, change)
            twists.append(twist)
    return np.array(twists)


def _driven(scenario: Scenario, twists: np.ndarray, settings: dict[str, float]) -> tuple[float, np.ndarray]:
    """The plant's longest step, s, and the robot's states, shape (n, 5)."""
    builder = DiagramBuilder()
    station = add_station(builder, World("open", (0.0, 0.0, 0.0), (5.0, 0.0)), scenario, continuous=True)
    commands = PiecewisePolynomial.ZeroOrderHold(PERIOD * (np.arange(len(twists)) - 0.5), twists.T)
    source = builder.AddSystem(TrajectorySource(commands))
    hold = builder.AddSystem(ZeroOrderHold(PERIOD, 2))  # steps end at its events, as at those of a shield
    builder.Connect(source.get_output_port(), hold.get_input_port())
    builder.Connect(hold.get_output_port(), station.GetInputPort("drive.twist_command"))
    log = LogVectorOutput(station.GetOutputPort("localization.state"), builder, PERIOD)
    simulator = make_simulator(builder.Build(), settings=settings)
    simulator.AdvanceTo(SECONDS)
    return station.robot_interface.longest_step, log.FindLog(simulator.get_context()).data().T.copy()


def _ways(states: np.ndarray, span: int) -> np.ndarray:
    """Where a robot is some samples later, in the frame where it was, shape (n, 2), m."""
    before, after = states[:-span], states[span:]
    dx, dy = (after - before)[:, :2].T
    cos, sin = np.cos(before[:, 2]), np.sin(before[:, 2])
    return np.column_stack((cos * dx + sin * dy, cos * dy - sin * dx))


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--radii", type=float, nargs="+", default=RADII, metavar="M")
    radii = parser.parse_args(arguments).radii
    print("| radius, m | longest step, ms | error, mm | safety margin, mm | margin / error |\n|--:|--:|--:|--:|--:|")
    with tempfile.TemporaryDirectory() as folder:
        for radius in radii:
            found = plant_error(cart_scenario(radius, Path(folder)))
            step, error, margin = (1e3 * value for value in found[1:])
            print(f"| {radius:g} | {step:.3g} | {error:.2f} | {margin:.2f} | {margin / error:.1f} |")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
