"""A fixed path in place of our planner: our controller follows it and drives around obstacles on it.

Any system that outputs a `Guidance` may stand before the controller. That of the `FixedPath` here holds the part of a
path that is still ahead, and the star-shaped region of the latest scan, along whose boundary the controller bends.

Run: python scripts/examples/04_fixed_path.py [--png FILE]
"""

import argparse
from pathlib import Path

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiagramBuilder, DiscreteValues, LeafSystem
from pydrake.systems.primitives import LogVectorOutput

from drake_starnav import (
    ArrivalMonitor,
    CollisionMonitor,
    DsmController,
    FixedGoal,
    Guidance,
    Navigation,
    NavigationStation,
    StarPerception,
    TwistShield,
    World,
    derive_margins,
    load_scenario,
)
from drake_starnav.plotting import draw_goal, draw_robot, save_figure, world_axes
from drake_starnav.surroundings import Observation

BLUE, ORANGE = "#0072B2", "#D55E00"
SPACING, NEAR, FAR = 0.05, 0.7, 3.5
"""Distance between way points, and how far ahead the next one lies: at least, and at most where something stands, m."""
ANGLE = np.linspace(0.6, 6.1, 200)
ROUTE = np.column_stack((3.0 * np.sin(ANGLE), 1.5 * np.sin(2.0 * ANGLE)))  # most of an eight, m


class FixedPath(LeafSystem):
    """Observation and pose -> guidance: along a path to the first way point a little ahead that is seen to be free."""

    def __init__(self, path: np.ndarray) -> None:
        """Take a path, shape (n, 2), W, m, with way points SPACING apart."""
        super().__init__()
        self.path = path
        self.observation = self.DeclareAbstractInputPort("observation", Value(Observation.none()))
        self.pose = self.DeclareVectorInputPort("pose", 3)
        self.passed = self.DeclareDiscreteState(1)  # index of a way point, as a path may cross itself
        self.DeclareAbstractOutputPort("guidance", lambda: Value(Guidance.none()), self.calc_guidance)
        self.DeclarePeriodicDiscreteUpdateEvent(0.05, 0.0, self.update)

    def ahead(self, context: Context, near: float, far: float) -> slice:
        """Way points from `near` to `far` beyond the one passed, m; at least one."""
        passed = int(context.get_discrete_state(self.passed)[0])
        first, last = (passed + round(distance / SPACING) for distance in (near, far))
        return slice(min(first, len(self.path) - 1), last + 1)

    def update(self, context: Context, values: DiscreteValues) -> None:
        window = self.ahead(context, 0.0, NEAR)
        distances = np.hypot(*(self.path[window] - self.pose.Eval(context)[:2]).T)
        values.set_value(self.passed, [window.start + int(distances.argmin())])

    def calc_guidance(self, context: Context, output: AbstractValue) -> None:
        region = self.observation.Eval(context).region
        if region is None:
            output.set_value(Guidance.none())
            return
        window = self.ahead(context, NEAR, FAR)
        free = int(region.contains(self.path[window]).argmax())  # the nearest one where none is
        output.set_value(Guidance.along(self.path[window.start + free :], [region]))


def resampled(path: np.ndarray) -> np.ndarray:
    """Way points SPACING apart along a path (n, 2), m."""
    along = np.append(0.0, np.hypot(*np.diff(path, axis=0).T).cumsum())
    places = np.append(np.arange(0.0, along[-1], SPACING), along[-1])
    return np.column_stack([np.interp(places, along, values) for values in path.T])


def main(png: Path | None) -> None:
    """Follow the path, and say how far the robot strayed from it."""
    scenario = load_scenario("room", overrides=["robot.max_speed=0.6"])
    robot, margins = scenario.robot, derive_margins(scenario)
    obstacles = [(3.1, 0.3, 0.2), (-1.4, 1.2, 0.2), (1.2, -2.2, 0.3), (-3.3, -0.6, 0.25)]
    world = World("hall", (*ROUTE[0], 0.0), tuple(ROUTE[-1]), np.array(obstacles), bounds=(-4.5, -3, 4.5, 3))
    builder = DiagramBuilder()
    station = builder.AddSystem(NavigationStation(world, scenario))
    perception = builder.AddSystem(StarPerception(robot, margins, scenario.lidar))
    route = builder.AddSystem(FixedPath(resampled(ROUTE)))
    controller = builder.AddSystem(DsmController(robot, scenario.controller, margins))
    shield = builder.AddSystem(TwistShield(robot, scenario.controller, margins))
    goal = builder.AddSystem(FixedGoal(world.goal))
    for source, name, system, port in (
        (station, "lidar.scan", perception, "scan"),
        (station, "localization.scan_pose", perception, "pose"),
        (perception, "observation", route, "observation"),
        (station, "localization.pose", route, "pose"),
        (route, "guidance", controller, "guidance"),
        (perception, "surroundings", controller, "surroundings"),
        (station, "localization.state", controller, "state"),
        (controller, "desired_twist", shield, "desired_twist"),
        (perception, "surroundings", shield, "surroundings"),
        (station, "localization.state", shield, "state"),
        (shield, "twist_command", station, "drive.twist_command"),
    ):
        builder.Connect(source.GetOutputPort(name), system.GetInputPort(port))
    ArrivalMonitor.AddToBuilder(builder, Navigation(world, station, goal), tolerance=0.1)
    CollisionMonitor.AddToBuilder(builder, station)
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
