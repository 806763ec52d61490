"""Two robots in one plant, each with its own navigator, change places and see each other.

The plant is the user's own: `add_robot` puts a robot into it, `RobotInterface` gives it lidar and wheels, and
`add_navigation` the rest. It is continuous, which `make_simulator` steps twice as fast as any simulator steps the plant
of `plant_config()`. To each robot the other is an obstacle that was not there before. The braking certificate holds for
static obstacles; both keep a wider margin from moving ones.

Run: python scripts/examples/07_two_robots.py [--png FILE]
"""

import argparse
import dataclasses
from pathlib import Path

import numpy as np
from pydrake.geometry import Cylinder
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlant, CoulombFriction
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput

from drake_starnav import CollisionMonitor, Parts, RobotInterface, World, add_navigation, make_simulator, parse_scenario
from drake_starnav.plotting import draw_goal, draw_robot, save_figure, world_axes
from drake_starnav.station import add_ground, add_robot, add_world, connect_robot, plant_config

BLUE, ORANGE = "#0072B2", "#D55E00"
SCENARIO = parse_scenario(
    """
    world: !Obstacles
      bounds: [-1, -2, 7, 2]
      cylinders: [[1.5, 0.9, 0.3], [3.3, -1.6, 0.4], [4.4, 1.2, 0.3]]
      start: [0, 0, 0]
      goal: [6, 0]
    robot: {max_speed: 0.4}
    lidar: {noise: 0.005}
    drive: {error: 0.15}
    """,
    name="two robots",
)
COLLAR = Cylinder(SCENARIO.robot.radius, 0.1)
"""The lidars scan in the plane of the hulls' tops. A collar reaches through it, so that they see each other."""


def navigator(robot: RobotInterface, world: World) -> Diagram:
    """A robot's interface with all that drives it to the goal of a world, as one system."""
    builder = DiagramBuilder()
    builder.AddNamedSystem("robot", robot)
    add_navigation(builder, SCENARIO, Parts(world, robot))
    builder.ExportInput(robot.GetInputPort("geometry_query"), "geometry_query")
    builder.ExportInput(robot.GetInputPort("multibody_state"), "multibody_state")
    for name in ("actuation", "localization.pose"):
        builder.ExportOutput(robot.GetOutputPort(name), name)
    return builder.Build()


def main(png: Path | None) -> None:
    """Let the robots change places, and say how near they came to each other."""
    there = SCENARIO.world.make(np.random.default_rng(0), SCENARIO.robot.radius)
    back = dataclasses.replace(there, start=(*there.goal, np.pi), goal=there.start[:2])
    worlds = {"blue": there, "orange": back}
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlant(plant_config(time_step=0.0), builder)
    ground = add_ground(plant, there.extent)
    add_world(plant, there)
    models = {
        name: add_robot(plant, scene_graph, SCENARIO.robot, world.start, name=name) for name, world in worlds.items()
    }
    for name, model in models.items():
        base, X_BC = plant.GetBodyByName("base_link", model), RigidTransform([0.0, 0.0, 0.07])
        plant.RegisterCollisionGeometry(base, X_BC, COLLAR, f"collar of {name}", CoulombFriction(0.3, 0.3))
    plant.Finalize()
    logs = {}
    for seed, (name, model) in enumerate(models.items()):
        robot = RobotInterface(plant, scene_graph, model, SCENARIO, seed=seed)
        system = builder.AddNamedSystem(name, navigator(robot, worlds[name]))
        connect_robot(builder, plant, scene_graph, model, system)
        monitor = builder.AddSystem(CollisionMonitor(robot=robot.robot_geometries, ground=[ground]))
        builder.Connect(scene_graph.get_query_output_port(), monitor.GetInputPort("geometry_query"))
        logs[name] = LogVectorOutput(system.GetOutputPort("localization.pose"), builder, 0.05)

    simulator = make_simulator(builder.Build())
    status = simulator.AdvanceTo(30.0)
    context = simulator.get_context()
    trails = {name: log.FindLog(context).data() for name, log in logs.items()}
    gap = np.hypot(*(trails["blue"] - trails["orange"])[:2]) - 2.0 * SCENARIO.robot.radius
    for name, trail in trails.items():
        print(f"{name}: {np.hypot(*(trail[:2, -1] - worlds[name].goal)):.2f} m from its goal", end=", ")
    print(f"never nearer to each other than {gap.min():.2f} m; {status.message() or 'no contact'}")
    if png is not None:
        figure, axis = world_axes(there, "Two robots change places; rims where they came nearest")
        for (name, trail), color in zip(trails.items(), (BLUE, ORANGE), strict=True):
            axis.plot(*trail[:2], color=color, label=name)
            draw_robot(axis, trail[:, gap.argmin()], SCENARIO.robot.radius, color)
            draw_goal(axis, worlds[name].goal, "")
        save_figure(figure, png)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--png", type=Path, metavar="FILE", help="also draw what happened")
    main(parser.parse_args().png)
