"""Six robots of three kinds change places in one room: the shipped scenario `six_robots`.

Each has a lidar, a planner and a controller of its own and knows of the others only what its lidar sees; nothing
coordinates them. It takes about a minute. `starnav record six_robots` leaves one recording of all.

Run: python scripts/examples/16_several_robots.py [--png FILE]
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from drake_starnav import load_scenario, make_world
from drake_starnav.plotting import draw_goal, draw_robot, save_figure, world_axes

COLORS = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"


def main(png: Path | None) -> None:
    """Drive the robots, and say how each fared."""
    with tempfile.TemporaryDirectory() as folder:
        figures = Path(folder) / "robots.json"
        command = "-m", "drake_starnav", "simulate", "six_robots", "--json", str(figures), "--quiet"
        subprocess.run([sys.executable, *command], check=True)
        records = json.loads(figures.read_text())["robots"]
    for each in records:
        gap = f"{each['min_gap_m']:.2f} m from the others at least"
        print(f"{each['robot']}: {each['outcome']} in {each['time_s']:.1f} s, {gap}")
    if png is not None:
        scenario = load_scenario("six_robots")
        figure, axis = world_axes(make_world(scenario.world, 0, 0.25), "Six robots change places")
        for each, robot, color in zip(records, scenario.robots, COLORS, strict=True):
            axis.plot(*np.array(each["path"]).T, color=color, label=each["robot"])
            draw_robot(axis, robot.start or (), robot.robot.shape, color)
            draw_goal(axis, np.array(robot.goals[-1][:2]), "")
        save_figure(figure, png)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--png", type=Path, metavar="FILE", help="also draw what happened")
    main(parser.parse_args().png)
