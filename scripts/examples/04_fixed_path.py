"""A fixed path in place of our planner: our controller follows it and drives around obstacles on it.

Any system that outputs a `Guidance` may stand before the controller. That of `FixedPath` holds the part of a given path
that is still ahead, and the star-shaped region of the latest scan, along whose boundary the controller bends its way.

Run: python scripts/examples/04_fixed_path.py [--png FILE]
"""

import argparse
from pathlib import Path

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput

from drake_starnav import (
    ArrivalMonitor,
    CollisionMonitor,
    DsmController,
    FixedGoal,
    FixedPath,
    NavigationStation,
    StarPerception,
    TwistShield,
    World,
    derive_margins,
    load_scenario,
)
from drake_starnav.plotting import draw_goal, draw_robot, save_figure, world_axes

BLUE, ORANGE = "#0072B2", "#D55E00"
ANGLE = np.linspace(0.6, 6.1, 200)
ROUTE = np.column_stack((3.0 * np.sin(ANGLE), 1.5 * np.sin(2.0 * ANGLE)))  # most of an eight, m


def main(png: Path | None) -> None:
    """Follow the path, and say how far the robot strayed from it."""
    scenario = load_scenario("room", overrides=["robot.max_speed=0.6"])
    robot, margins = scenario.robot, derive_margins(scenario)
    obstacles = [(3.1, 0.3, 0.2), (-1.4, 1.2, 0.2), (1.2, -2.2, 0.3), (-3.3, -0.6, 0.25)]
    world = World("hall", (*ROUTE[0], 0.0), tuple(ROUTE[-1]), np.array(obstacles), bounds=(-4.5, -3, 4.5, 3))
    builder = DiagramBuilder()
    station = builder.AddSystem(NavigationStation(world, scenario))
    perception = builder.AddSystem(StarPerception(robot, margins, scenario.lidar))
    route = builder.AddSystem(FixedPath(ROUTE))
    controller = builder.AddSystem(DsmController(robot, scenario.controller, margins))
    shield = builder.AddSystem(TwistShield(robot, scenario.controller, margins))
    goal = builder.AddSystem(FixedGoal(world.goal))
    arrival = builder.AddSystem(ArrivalMonitor(tolerance=0.1, period=0.02))
    collision = builder.AddSystem(CollisionMonitor(robot=station.robot_geometries, ground=station.floor))
    for source, name, system, port in (
        (station, "lidar.scan", perception, "scan"),
        (station, "localization.scan_pose", perception, "pose"),
        (perception, "observation", route, "observation"),
        (station, "localization.pose", route, "pose"),
        (route, "guidance", controller, "guidance"),
        (perception, "certified_region", controller, "certified_region"),
        (station, "localization.state", controller, "state"),
        (controller, "desired_twist", shield, "desired_twist"),
        (perception, "certified_region", shield, "certified_region"),
        (station, "localization.state", shield, "state"),
        (shield, "twist_command", station, "drive.twist_command"),
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
