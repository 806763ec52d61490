"""Your own robot, by its URDF and its limits, drives without a change to any code.

`tugbot.yaml` names `tugbot.urdf` and says how fast it is. Planner and controller take the rest from there: regions are
eroded by its radius, commands keep its speeds and accelerations, and the certificate knows how it brakes.

Run: python scripts/examples/08_own_robot.py [--png FILE]
"""

import argparse
import dataclasses
from pathlib import Path

import numpy as np

from drake_starnav import load_scenario, make_world, run_trial
from drake_starnav.plotting import draw_goal, draw_robot, save_figure, world_axes

BLUE, ORANGE = "#0072B2", "#D55E00"


def main(png: Path | None) -> None:
    """Drive the same warehouse with tugbot and with the shipped robot."""
    tugbot = load_scenario(str(Path(__file__).with_name("tugbot.yaml")))
    starbot = dataclasses.replace(tugbot, robot=load_scenario("room").robot)
    world = make_world(tugbot.world, 0, tugbot.robot.radius)
    trails = {}
    for name, scenario in (("tugbot", tugbot), ("starbot", starbot)):
        trial = run_trial(scenario)
        trails[name] = np.array(trial.path)
        print(f"{name}: {trial.outcome} in {trial.time_s:.1f} s at {trial.mean_speed_mps:.2f} m/s", end=", ")
        print(f"no nearer than {100.0 * trial.min_clearance_m:.1f} cm to an obstacle")
    if png is not None:
        figure, axis = world_axes(world, "Two robots in the same warehouse, one after the other")
        for (name, trail), robot, color in zip(
            trails.items(), (tugbot.robot, starbot.robot), (ORANGE, BLUE), strict=True
        ):
            axis.plot(*trail.T, color=color, label=f"{name}, radius {robot.radius:g} m")
            draw_robot(axis, world.start, robot.radius, color)
        draw_goal(axis, world.goal)
        save_figure(figure, png)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--png", type=Path, metavar="FILE", help="also draw what happened")
    main(parser.parse_args().png)
