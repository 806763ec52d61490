"""Our controller behind a fixed path in place of our planner: it follows the path and drives round what stands in it.

Whatever outputs a `Guidance` may stand before the controller. Here it holds the part of a given path that is still
ahead, and the star-shaped region of the latest scan, along whose boundary the controller bends its way.

Run: python scripts/examples/04_fixed_path.py [--png FILE]
"""

import argparse
from pathlib import Path

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiagramBuilder, DiscreteValues, LeafSystem
from pydrake.systems.primitives import ConstantVectorSource, LogVectorOutput

from drake_starnav import (
    ArrivalMonitor,
    CertifiedController,
    CollisionMonitor,
    Guidance,
    NavigationStation,
    Observation,
    StarPerception,
    World,
    draw_goal,
    draw_robot,
    load_scenario,
    save_figure,
    world_axes,
)

BLUE, ORANGE = "#0072B2", "#D55E00"
STEP = 0.005  # of the plant, s
LOOKAHEAD, FARTHEST = 0.7, 3.5  # of the way point it heads for, along the path, m
ANGLE = np.linspace(0.6, 6.1, 200)
ROUTE = np.column_stack((3.0 * np.sin(ANGLE), 1.5 * np.sin(2.0 * ANGLE)))  # most of an eight, m


class FixedPath(LeafSystem):
    """Guidance along a path: to the first way point beyond the lookahead that the robot sees to be free."""

    def __init__(self, path: np.ndarray) -> None:
        super().__init__()
        self._path = path
        self._along = np.concatenate(([0.0], np.hypot(*np.diff(path, axis=0).T).cumsum()))
        self._star = self.DeclareAbstractInputPort("star", Value(Observation.none()))
        self._pose = self.DeclareVectorInputPort("pose", 3)
        self._passed = self.DeclareDiscreteState(1)  # index of the way point it has come to, as paths may cross
        self.DeclareAbstractOutputPort("guidance", lambda: Value(Guidance.none()), self._calc_guidance)
        self.DeclarePeriodicDiscreteUpdateEvent(0.05, 0.0, self._update)

    def _between(self, context: Context, near: float, far: float) -> slice:
        """Way points from `near` to `far` metres along the path from the one passed; at least one."""
        along = self._along[int(context.get_discrete_state(self._passed).value()[0])]
        first, last = np.searchsorted(self._along, (along + near, along + far))
        return slice(min(first, len(self._path) - 1), last + 1)

    def _update(self, context: Context, values: DiscreteValues) -> None:
        window = self._between(context, 0.0, LOOKAHEAD)
        distances = np.hypot(*(self._path[window] - self._pose.Eval(context)[:2]).T)
        values.set_value(self._passed, [window.start + int(distances.argmin())])

    def _calc_guidance(self, context: Context, output: AbstractValue) -> None:
        region = self._star.Eval(context).region
        if region is not None:
            window = self._between(context, LOOKAHEAD, FARTHEST)
            path = self._path[window.start + int(region.contains(self._path[window]).argmax()) :]
            output.set_value(Guidance.along(path, [region]))


def main(png: Path | None) -> None:
    """Follow the path, and say how far the robot strayed from it."""
    scenario = load_scenario("room", overrides=["robot.max_speed=0.6"])
    robot, controller_parameters = scenario.robot, scenario.controller
    obstacles = [(3.1, 0.3, 0.2), (-1.4, 1.2, 0.2), (1.2, -2.2, 0.3), (-3.3, -0.6, 0.25)]
    world = World("hall", (*ROUTE[0], 0.0), tuple(ROUTE[-1]), np.array(obstacles), bounds=(-4.5, -3, 4.5, 3))
    builder = DiagramBuilder()
    station = builder.AddSystem(NavigationStation(world, robot, scenario.lidar, time_step=STEP))
    perception = builder.AddSystem(StarPerception(robot, scenario.planner, controller_parameters, scenario.lidar))
    route = builder.AddSystem(FixedPath(ROUTE))
    controller = builder.AddSystem(CertifiedController(robot, controller_parameters, offset=2 * STEP))
    goal = builder.AddSystem(ConstantVectorSource(world.goal))
    arrival = builder.AddSystem(ArrivalMonitor(tolerance=0.1, period=0.02))
    collision = builder.AddSystem(CollisionMonitor(robot=station.robot_geometries, ground=station.floor))
    for source, name, system, port in (
        (station, "lidar.scan", perception, "scan"),
        (station, "localization.scan_pose", perception, "pose"),
        (perception, "star", route, "star"),
        (station, "localization.pose", route, "pose"),
        (route, "guidance", controller, "guidance"),
        (perception, "safety_star", controller, "safety_star"),
        (station, "localization.state", controller, "state"),
        (controller, "twist_command", station, "drive.twist_command"),
        (station, "localization.state", arrival, "state"),
        (station, "cheat.geometry_query", collision, "geometry_query"),
    ):
        builder.Connect(source.GetOutputPort(name), system.GetInputPort(port))
    builder.Connect(goal.get_output_port(), arrival.GetInputPort("goal"))
    poses = LogVectorOutput(station.GetOutputPort("localization.pose"), builder, 0.05)

    simulator = Simulator(builder.Build())
    status = simulator.AdvanceTo(90.0)
    context = simulator.get_context()
    trail = poses.FindLog(context).data()
    strayed = np.hypot(*(trail[:2, :, None] - ROUTE.T[:, None, :])).min(axis=1)
    print(f"{status.message() or 'out of time'} at {context.get_time():.2f} s", end="; ")
    print(f"off the path by {strayed.mean():.2f} m in the mean, at most {strayed.max():.2f} m")
    if png is not None:
        figure, axis = world_axes(world, "A fixed path, followed round what stands in it")
        axis.plot(*ROUTE.T, "--", color=ORANGE, label="path as given")
        axis.plot(*trail[:2], color=BLUE, label="driven")
        draw_robot(axis, trail[:, -1], robot.radius, BLUE)
        draw_goal(axis, world.goal)
        save_figure(figure, png)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--png", type=Path, metavar="FILE", help="also draw what happened")
    main(parser.parse_args().png)
