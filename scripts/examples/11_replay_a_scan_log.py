"""A recorded scan log through perception and planner, with no simulation and no Drake.

`room_scans.csv`, beside this file, was recorded by a robot that was driven through a room. A log of your own may be
such a table, or a ROS bag with `/scan` and either `/odom` or `/tf` (`pip install drake-starnav[rosbag]`).

Run: python scripts/examples/11_replay_a_scan_log.py [LOG] [--goal X Y] [--radius R] [--png FILE]
"""

import argparse
from pathlib import Path

import numpy as np

from drake_starnav import RobotParameters, Scenario, World, derive_margins
from drake_starnav.lidar import LoggedScan, read_scan_log
from drake_starnav.planning import PlannerInput, PlannerState, plan_step
from drake_starnav.plotting import draw_goal, draw_robot, save_figure, world_axes
from drake_starnav.surroundings import Observation, make_scan_region

BLUE, ORANGE = "#0072B2", "#D55E00"


def main(log: list[LoggedScan], goal: np.ndarray, radius: float, png: Path | None) -> None:
    """Feed the planner scan by scan, and say what it knows in the end and where it would go."""
    scenario = Scenario("log", None, RobotParameters(radius=radius))
    parameters, margins = scenario.planner, derive_margins(scenario)
    state = PlannerState.initial(parameters, radius)
    for seen in log:
        observation = Observation(make_scan_region(seen.scan, seen.pose, radius, margins), seen.scan, seen.pose)
        before = state.progress.plan_count
        now = PlannerInput(observation, seen.pose[:2], goal, seen.scan.time, parameters, margins, radius)
        state = plan_step(state, now)
        if state.progress.plan_count > before:
            x, y = state.route.path[0] if len(state.route.path) else seen.pose[:2]
            print(f"{seen.scan.time:5.2f} s: {state.status.value} by way of ({x:.2f}, {y:.2f})", end=", ")
            print(f"{len(state.roadmap)} regions, {len(state.roadmap.closures.failed_places)} closures")
    print(f"{len(log)} scans, {state.progress.plan_count} plans; in the end {state.status.value}")
    if png is not None:
        trail = np.array([seen.pose for seen in log])
        title = "A roadmap from a recorded scan log"
        figure, axis = world_axes(World("log", tuple(trail[0]), (goal[0], goal[1])), title)
        for number, region in enumerate(state.roadmap.regions):
            axis.fill(*region.outline().T, color=BLUE, alpha=0.1, label="" if number else "free for the robot's centre")
        hits = np.vstack([seen.scan.points(seen.pose) for seen in log])
        axis.plot(*hits.T, ".", color="0.35", markersize=1.0, label="hits")
        axis.plot(*trail[:, :2].T, color=ORANGE, label="driven")
        axis.plot(*np.vstack((trail[-1, :2], state.route.path)).T, "--", color=BLUE, label="planned")
        draw_robot(axis, trail[-1], radius, ORANGE)
        draw_goal(axis, goal)
        axis.autoscale()
        figure.set_size_inches(6.0, 8.5)
        save_figure(figure, png)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    shipped = Path(__file__).with_name("room_scans.csv")
    parser.add_argument("log", type=Path, nargs="?", default=shipped, help="a .csv file, or a bag")
    parser.add_argument("--goal", type=float, nargs=2, metavar=("X", "Y"), default=(4.2, 7.2), help="m")
    parser.add_argument("--radius", type=float, default=0.25, help="of the robot, m")
    parser.add_argument("--png", type=Path, metavar="FILE", help="also draw the roadmap")
    options = parser.parse_args()
    main(read_scan_log(options.log), np.array(options.goal), options.radius, options.png)
