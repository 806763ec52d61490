"""The planner's short-term goals with stock systems of Drake in place of our controller.

Drake's `PidController` pulls a point ahead of the axle straight to the short-term goal, which the planner chooses such
that the way there is free; feedback linearisation makes a twist of it. It sees no obstacle and certifies nothing:
the planner alone keeps it out of trouble, with a margin for where the axle cuts the corner. `add_navigation` wires the
whole as it would its own controller, by the names of its ports.

Run: python scripts/examples/03_another_controller.py [--png FILE]
"""

import argparse
from pathlib import Path

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.controllers import PidController
from pydrake.systems.framework import BasicVector, Context, Diagram, DiagramBuilder, LeafSystem
from pydrake.systems.primitives import ConstantVectorSource, LogVectorOutput, Multiplexer

from drake_starnav import ArrivalMonitor, CollisionMonitor, Parts, add_navigation, parse_scenario
from drake_starnav.plotting import draw_goal, draw_robot, save_figure, world_axes
from drake_starnav.station import simulated

BLUE, ORANGE = "#0072B2", "#D55E00"
MAX_SPEED = 0.5  # m/s
AHEAD = 0.1  # of the axle: the point that is pulled, m
SCENARIO = parse_scenario(
    """
    world: !Obstacles
      bounds: [-1, -2.5, 8, 2.5]
      cylinders: [[1.8, 0.3, 0.4], [3.0, -1.2, 0.5], [4.2, 0.9, 0.5], [6.0, -0.6, 0.4]]
      polygons: [[[4.6, -2.5], [5.0, -2.5], [5.0, -0.3], [4.6, -0.3]]]
      goal: [7.2, 0.4]
    planner: {preferred_clearance: 0.05}
    """,
    name="yard",
)


class PointAhead(LeafSystem):
    """A point ahead of the axle: its state, for a controller that pulls it, and the twist that follows the pull."""

    def __init__(self) -> None:
        super().__init__()
        self._state = self.DeclareVectorInputPort("state", 5)
        self._pull = self.DeclareVectorInputPort("pull", 2)
        of_the_state = {self._state.ticket()}  # and not of the pull, or there were an algebraic loop
        self.DeclareVectorOutputPort("point_state", 4, self._calc_point_state, of_the_state)
        self.DeclareVectorOutputPort("desired_twist", 2, self._calc_twist)

    def _calc_point_state(self, context: Context, output: BasicVector) -> None:
        x, y, yaw, v, omega = self._state.Eval(context)
        along, across = np.array((np.cos(yaw), np.sin(yaw))), np.array((-np.sin(yaw), np.cos(yaw)))
        output.SetFromVector([*((x, y) + AHEAD * along), *(v * along + AHEAD * omega * across)])

    def _calc_twist(self, context: Context, output: BasicVector) -> None:
        yaw, (x, y) = self._state.Eval(context)[2], self._pull.Eval(context)
        v, omega = np.cos(yaw) * x + np.sin(yaw) * y, (np.cos(yaw) * y - np.sin(yaw) * x) / AHEAD
        # slower where a limit is reached, but never in another direction
        excess = max(1.0, np.hypot(x, y) / MAX_SPEED, abs(omega) / SCENARIO.robot.max_yaw_rate)
        output.SetFromVector([v / excess, omega / excess])


def pid_follower() -> Diagram:
    """A controller of stock systems: from the short-term goal and the state to a twist."""
    builder = DiagramBuilder()
    point = builder.AddSystem(PointAhead())
    pid = builder.AddSystem(PidController(kp=[2.0, 2.0], ki=[0.0, 0.0], kd=[0.2, 0.2]))
    desired = builder.AddSystem(Multiplexer([2, 2]))
    at_rest = builder.AddSystem(ConstantVectorSource([0.0, 0.0]))
    builder.ExportInput(point.GetInputPort("state"), "state")
    builder.ExportInput(desired.get_input_port(0), "short_term_goal")
    builder.Connect(at_rest.get_output_port(), desired.get_input_port(1))
    builder.Connect(desired.get_output_port(), pid.get_input_port_desired_state())
    builder.Connect(point.GetOutputPort("point_state"), pid.get_input_port_estimated_state())
    builder.Connect(pid.get_output_port_control(), point.GetInputPort("pull"))
    builder.ExportOutput(point.GetOutputPort("desired_twist"), "desired_twist")
    return builder.Build()


def main(png: Path | None) -> None:
    """Drive to the goal, and say how many short-term goals it took."""
    builder = DiagramBuilder()
    navigation = add_navigation(builder, SCENARIO, Parts(controller=pid_follower()))
    station = simulated(navigation.station)

    ArrivalMonitor.AddToBuilder(builder, navigation, tolerance=0.15)
    CollisionMonitor.AddToBuilder(builder, station)
    poses = LogVectorOutput(station.GetOutputPort("localization.pose"), builder, 0.05)
    goals = LogVectorOutput(navigation.planned("short_term_goal"), builder, 0.05)

    simulator = Simulator(builder.Build())
    status = simulator.AdvanceTo(60.0)
    context = simulator.get_context()
    trail, chosen = poses.FindLog(context).data(), goals.FindLog(context).data()[:, 1:]
    chosen = np.unique(chosen.round(3), axis=1)
    print(f"{status.message() or 'out of time'} at {context.get_time():.2f} s", end=" ")
    print(f"by way of {chosen.shape[1]} short-term goals")
    if png is not None:
        world = navigation.world
        figure, axis = world_axes(world, "Short-term goals tracked by Drake's PidController")
        axis.plot(*trail[:2], color=BLUE, label="driven")
        axis.plot(*chosen, "o", color=ORANGE, markersize=4, label="short-term goals")
        draw_robot(axis, trail[:, -1], SCENARIO.robot.radius, BLUE)
        draw_goal(axis, world.goal)
        save_figure(figure, png)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--png", type=Path, metavar="FILE", help="also draw what happened")
    main(parser.parse_args().png)
