"""The predictor keeps the commands that are on their way."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from drake_starnav.robot import BASES, RobotParameters
from drake_starnav.systems.state_predictor import StatePredictor

PERIOD = 0.02


def predicted(base: str, delay: float, time: float) -> np.ndarray:
    """x and v of what is predicted at a time, by commands k = 1, 2, ... m/s sent at PERIOD, 2 PERIOD, ..."""
    builder = DiagramBuilder()
    breaks = PERIOD * np.arange(0, 52) + 1e-6  # what an update at a break sees is the command before it
    speeds = np.zeros((len(BASES[base].components), 52))
    speeds[0] = np.arange(52.0)
    commands = builder.AddSystem(TrajectorySource(PiecewisePolynomial.ZeroOrderHold(breaks, speeds)))
    state = builder.AddSystem(ConstantVectorSource(np.zeros(5)))
    system = builder.AddSystem(StatePredictor(RobotParameters(base=base), delay=delay, rate=1.0 / PERIOD))
    builder.Connect(state.get_output_port(), system.GetInputPort("state"))
    builder.Connect(commands.get_output_port(), system.GetInputPort("twist_command"))
    diagram = builder.Build()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(time)
    return system.get_output_port().Eval(system.GetMyContextFromRoot(simulator.get_context()))[[0, 3]]


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("delay, way", [(0.02, 5 * 0.02), (0.03, 4 * 0.01 + 5 * 0.02), (0.06, (3 + 4 + 5) * 0.02)])
def test_the_last_commands_are_still_to_come(base, delay, way):
    # just before the 6th command is sent
    assert predicted(base, delay, 6 * PERIOD) == pytest.approx([way, 5.0])
