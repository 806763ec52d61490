"""Drake's `PidController` turns a robot along the guiding vector, behind the certificate, as a robot would run it.

`DsmController` gives the guiding vector; the PID acts on the angle to it, and the speed follows from its cosine.
`Parts(controller=...)` puts both in the place of the shipped controller; the shield stays behind them.

Run: python scripts/examples/19_drake_s_pid_behind_the_shield.py [--png FILE]
"""

import argparse
from pathlib import Path

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.controllers import PidController
from pydrake.systems.framework import BasicVector, Context, Diagram, DiagramBuilder, LeafSystem
from pydrake.systems.primitives import ConstantVectorSource, Multiplexer

from drake_starnav import DsmController, Parts, Scenario, derive_margins, load_scenario, make_diagram, make_world
from drake_starnav.plotting import save_drive

KP, KI, KD = 4.0, 0.0, 0.3


class Heading(LeafSystem):
    """Guiding vector and state -> the angle from it with its rate, rad and rad/s, and the speed, m/s."""

    def __init__(self, max_speed: float) -> None:
        super().__init__()
        self.max_speed = max_speed
        self.guiding, self.state = self.DeclareVectorInputPort("guiding", 2), self.DeclareVectorInputPort("state", 5)
        self.DeclareVectorOutputPort("estimated", 2, self.calc_estimated)
        self.DeclareVectorOutputPort("speed", 1, self.calc_speed)

    def off(self, context: Context) -> float:
        """Angle of the robot from the guiding vector, rad."""
        (x, y), yaw = self.guiding.Eval(context), self.state.Eval(context)[2]
        return float(np.angle(np.exp(1j * yaw) * (x - 1j * y))) if x or y else 0.0

    def calc_estimated(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector((self.off(context), self.state.Eval(context)[4]))

    def calc_speed(self, context: Context, output: BasicVector) -> None:
        share = np.hypot(*self.guiding.Eval(context)) * max(np.cos(self.off(context)), 0.0) ** 2
        output.SetFromVector([self.max_speed * share])


def pid(scenario: Scenario) -> Diagram:
    """A controller in the sense of `Parts`."""
    builder = DiagramBuilder()
    dsm = builder.AddSystem(DsmController(scenario.robot, scenario.controller, derive_margins(scenario)))
    heading, both = builder.AddSystem(Heading(scenario.robot.max_speed)), builder.AddSystem(Multiplexer(2))
    turn = builder.AddSystem(PidController([KP], [KI], [KD]))
    zero = builder.AddSystem(ConstantVectorSource([0.0, 0.0]))
    builder.Connect(dsm.GetOutputPort("guiding_vector"), heading.guiding)
    builder.Connect(heading.GetOutputPort("estimated"), turn.get_input_port_estimated_state())
    builder.Connect(zero.get_output_port(), turn.get_input_port_desired_state())
    builder.Connect(heading.GetOutputPort("speed"), both.get_input_port(0))
    builder.Connect(turn.get_output_port_control(), both.get_input_port(1))
    for name in ("guidance", "surroundings", "state"):
        builder.ExportInput(dsm.GetInputPort(name), name)
    builder.ConnectInput("state", heading.state)
    builder.ExportOutput(both.get_output_port(), "desired_twist")
    diagram = builder.Build()
    diagram.set_name("pid_controller")
    return diagram


def main(png: Path | None) -> None:
    """Drive with it, and say how it went."""
    scenario = load_scenario("forest")
    world = make_world(scenario.world, 0, scenario.robot.radius)
    diagram = make_diagram(scenario, Parts(world, controller=pid(scenario)))
    simulator, navigation, trail, certified = Simulator(diagram), diagram.navigation, [], []
    context, away = simulator.get_context(), np.inf
    while away > scenario.simulation.goal_tolerance and context.get_time() < 60.0:
        trail.append(navigation.read("pose", context)[:2])
        certified.append(navigation.read("certificate", context).certified)
        away = np.hypot(*(trail[-1] - world.goal))
        simulator.AdvanceTo(0.05 * len(trail))
    share = 100.0 * np.mean(certified)
    print(f"{away:.2f} m from the goal after {context.get_time():.1f} s; {share:.0f}% of the time certified")
    if png is not None:
        save_drive(world, np.array(trail), "Drake's PidController on the guiding vector", png)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--png", type=Path, metavar="FILE", help="also draw what happened")
    main(parser.parse_args().png)
