"""Build the navigation diagram by hand, system by system, in a world of your own.

`drake_starnav.make_diagram(scenario)` does the same in one line. Here each system can be exchanged: any planner that
outputs a `Guidance` may stand before the controller, and any controller that outputs a twist behind the planner.

Run: python scripts/examples/02_build_the_diagram.py [--png FILE]
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
    LidarParameters,
    Navigation,
    NavigationStation,
    RobotParameters,
    Scenario,
    StarPerception,
    StarRoadmapPlanner,
    TwistShield,
    World,
    derive_margins,
)
from drake_starnav.plotting import draw_goal, draw_robot, save_figure, world_axes

BLUE = "#0072B2"


def main(png: Path | None) -> None:
    """Build, simulate until a monitor ends the run, and print what happened."""
    world = World(
        name="yard",
        start=(0.0, 0.0, 0.0),
        goal=(4.5, 0.5),
        cylinders=np.array([(1.5, 0.1, 0.3), (2.0, 1.4, 0.4), (3.6, -0.3, 0.25)]),
        polygons=(np.array([(2.3, -0.5), (3.0, -0.5), (3.0, -1.2), (2.3, -1.2)]),),
        bounds=(-1.0, -2.0, 6.0, 2.5),
    )
    scenario = Scenario("yard", world, RobotParameters(max_speed=0.6), LidarParameters(noise=0.02))
    robot, lidar, margins = scenario.robot, scenario.lidar, derive_margins(scenario)

    builder = DiagramBuilder()
    station = builder.AddSystem(NavigationStation(world, scenario))
    goal = builder.AddSystem(FixedGoal(world.goal))
    perception = builder.AddSystem(StarPerception(robot, margins, lidar))
    planner = builder.AddSystem(StarRoadmapPlanner(robot, scenario.planner, margins))
    controller = builder.AddSystem(DsmController(robot, scenario.controller, margins))
    shield = builder.AddSystem(TwistShield(robot, scenario.controller, margins))

    builder.Connect(station.GetOutputPort("lidar.scan"), perception.GetInputPort("scan"))
    builder.Connect(station.GetOutputPort("localization.scan_pose"), perception.GetInputPort("pose"))
    builder.Connect(perception.GetOutputPort("observation"), planner.GetInputPort("observation"))
    builder.Connect(station.GetOutputPort("localization.pose"), planner.GetInputPort("pose"))
    builder.Connect(goal.get_output_port(), planner.GetInputPort("goal"))
    builder.Connect(planner.GetOutputPort("guidance"), controller.GetInputPort("guidance"))
    builder.Connect(perception.GetOutputPort("surroundings"), controller.GetInputPort("surroundings"))
    builder.Connect(station.GetOutputPort("localization.state"), controller.GetInputPort("state"))
    builder.Connect(controller.GetOutputPort("desired_twist"), shield.GetInputPort("desired_twist"))
    builder.Connect(perception.GetOutputPort("surroundings"), shield.GetInputPort("surroundings"))
    builder.Connect(station.GetOutputPort("localization.state"), shield.GetInputPort("state"))
    builder.Connect(shield.GetOutputPort("twist_command"), station.GetInputPort("drive.twist_command"))

    ArrivalMonitor.AddToBuilder(builder, Navigation(world, station, goal, planner=planner), tolerance=0.1)
    CollisionMonitor.AddToBuilder(builder, station)
    log = LogVectorOutput(station.GetOutputPort("localization.state"), builder, 0.5)

    simulator = Simulator(builder.Build())
    status = simulator.AdvanceTo(60.0)

    print("   time      x      y  speed")
    record = log.FindLog(simulator.get_context())
    for time, (x, y, _, v, _) in zip(record.sample_times(), record.data().T, strict=True):
        print(f"{time:5.1f} s {x:4.1f} m {y:4.1f} m {v:4.2f} m/s")
    roadmap = planner.GetOutputPort("planner_state").Eval(planner.GetMyContextFromRoot(simulator.get_context()))
    print(f"{status.message() or 'out of time'} at {simulator.get_context().get_time():.2f} s", end="")
    print(f" with {len(roadmap.roadmap)} regions in the roadmap")
    if png is not None:
        figure, axis = world_axes(world, "A diagram built by hand: the star-shaped regions of its roadmap")
        for number, region in enumerate(roadmap.roadmap.regions):
            axis.fill(*region.outline().T, color=BLUE, alpha=0.12, label="" if number else "region")
        axis.plot(*record.data()[:2], ".-", color=BLUE, label="driven, a dot every half second")
        draw_robot(axis, record.data()[:3, -1], robot.radius, BLUE)
        draw_goal(axis, world.goal)
        save_figure(figure, png)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--png", type=Path, metavar="FILE", help="also draw what happened")
    main(parser.parse_args().png)
