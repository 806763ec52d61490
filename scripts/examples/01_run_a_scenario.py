"""Run a scenario from Python: load it, change a parameter, simulate one trial, read the result.

Run: python scripts/examples/01_run_a_scenario.py [--png FILE]
"""

import argparse
from pathlib import Path

import numpy as np

from drake_starnav import load_scenario, make_world, run_trial
from drake_starnav.plotting import draw_goal, draw_robot, save_figure, world_axes

BLUE, ORANGE = "#0072B2", "#D55E00"
SEED = 1


def main(png: Path | None) -> None:
    """Drive a room twice, with and without a speed limit of half the usual one."""
    paths = {}
    for overrides in ([], ["robot.max_speed=0.4"]):
        scenario = load_scenario("room", overrides=overrides)
        trial = run_trial(scenario, seed=SEED)
        paths[f"at up to {scenario.robot.max_speed:g} m/s: {trial.time_s:.1f} s"] = np.array(trial.path)
        print(f"{scenario.name} at up to {scenario.robot.max_speed:g} m/s: {trial.outcome} in {trial.time_s:.1f} s")
        print(f"  drove {trial.path_length_m:.1f} m; the shortest path there is: {trial.shortest_path_m:.1f} m")
        print(f"  came within {100.0 * trial.min_clearance_m:.1f} cm of an obstacle")
    if png is not None:
        world = make_world(scenario.world, SEED, scenario.robot.radius)
        figure, axis = world_axes(world, "A room, driven twice")
        for (label, path), color in zip(paths.items(), (BLUE, ORANGE), strict=True):
            axis.plot(*path.T, color=color, label=label)
        draw_robot(axis, world.start, scenario.robot.radius, BLUE)
        draw_goal(axis, world.goal)
        save_figure(figure, png)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--png", type=Path, metavar="FILE", help="also draw what happened")
    main(parser.parse_args().png)
