"""A rectangular robot, an omnidirectional one and a car drive through one room, selected by `robot.model` alone.

Each robot has its footprint, its base and its limits in a file beside its URDF. Certificate, planner and drive take
them from there; twists have as many components as the base.

Run: python scripts/examples/15_other_robots.py [--png FILE]
"""

import argparse
from pathlib import Path

import numpy as np
from pydrake.systems.analysis import Simulator

from drake_starnav import Parts, Scenario, World, load_scenario, make_diagram, make_world
from drake_starnav.plotting import draw_goal, draw_robot, save_figure, world_axes

COLORS = {"carrier": "#0072B2", "omnibot": "#D55E00", "carbot": "#117733"}
PERIOD, TIMEOUT = 0.05, 60.0
DRAWN_EVERY = 1.25
"""Footprints are drawn so often, s."""


def driven(scenario: Scenario, world: World) -> tuple[np.ndarray, bool]:
    """Poses of a robot every PERIOD, shape (n, 3), and whether it reached the goal."""
    diagram = make_diagram(scenario, Parts(world))
    simulator, port = Simulator(diagram), diagram.GetOutputPort("localization.pose")
    poses: list[np.ndarray] = []
    while len(poses) * PERIOD < TIMEOUT:
        poses.append(port.Eval(simulator.get_context()).copy())
        if np.hypot(*(poses[-1][:2] - world.goal)) < scenario.simulation.goal_tolerance:
            return np.array(poses), True
        simulator.AdvanceTo(len(poses) * PERIOD)
    return np.array(poses), False


def main(png: Path | None) -> None:
    """Let one robot after the other drive, and say how it did."""
    scenarios = {model: load_scenario("room", overrides=[f"robot.model={model}"]) for model in COLORS}
    largest = max(scenario.robot.radius for scenario in scenarios.values())
    world = make_world(scenarios["carrier"].world, 3, largest)
    figure, axis = world_axes(world, "Three robots in one room, one after the other") if png else (None, None)
    for model, scenario in scenarios.items():
        poses, reached = driven(scenario, world)
        twist = ", ".join(scenario.robot.drive.components)
        outcome = "reached the goal" if reached else "did not reach the goal"
        print(f"{model}, commanded {twist}: {outcome} in {len(poses) * PERIOD:.1f} s")
        if axis is not None:
            axis.plot(*poses[:, :2].T, color=COLORS[model], label=model)
            for pose in poses[:: round(DRAWN_EVERY / PERIOD)]:
                draw_robot(axis, pose, scenario.robot.shape, COLORS[model])
    if png is not None:
        draw_goal(axis, world.goal)
        save_figure(figure, png)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--png", type=Path, metavar="FILE", help="also draw what happened")
    main(parser.parse_args().png)
