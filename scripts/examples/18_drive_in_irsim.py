"""A disc in ir-sim drives through a forest: its lidar's scans and its pose come in, twists go out.

Needs `pip install drake-starnav[simulators]`.

Run: python scripts/examples/18_drive_in_irsim.py [--png FILE]
"""

import argparse
import contextlib
import tempfile
from pathlib import Path

import numpy as np
import yaml

from drake_starnav import LaserScan, load_scenario, make_world
from drake_starnav.plotting import save_drive
from drake_starnav.runtime import Navigator, Odometry


def main(png: Path | None) -> None:
    """Drive, and say how it went."""
    with contextlib.redirect_stdout(None):
        import irsim  # here, as it prints
    scenario = load_scenario("forest", overrides=["lidar.rate=50", "controller.rate=50"])
    world, lidar, radius = make_world(scenario.world, 0, scenario.robot.radius), scenario.lidar, scenario.robot.radius
    obstacles = [
        {"shape": {"name": "circle", "radius": r}, "state": [x, y, 0.0]} for x, y, r in world.cylinders.tolist()
    ]
    x0, y0, x1, y1 = world.extent
    walls = [[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]]
    obstacles.append({"shape": {"name": "linestring", "vertices": walls}, "state": [0.0, 0.0, 0.0]})
    sensor = {"name": "lidar2d", "range_max": lidar.range_max, "number": lidar.beams, "angle_range": 2.0 * np.pi}
    robot = {"kinematics": {"name": "diff"}, "shape": {"name": "circle", "radius": radius}, "sensors": [sensor]}
    robot |= {"state": list(world.start), "goal": [*world.goal, 0.0], "vel_max": [2, 6], "vel_min": [-2, -6]}
    area = {"width": x1 - x0, "height": y1 - y0, "offset": [x0, y0], "step_time": 0.02, "sample_time": 0.02}
    area |= {"collision_mode": "unobstructed"}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "forest.yaml"
        path.write_text(yaml.safe_dump({"world": area, "robot": [robot], "obstacle": obstacles}))
        simulation = irsim.make(str(path), display=False, disable_all_plot=True, log_level="ERROR")
    navigator, trail, contacts, twist = Navigator(scenario), [np.array(world.start)], 0, np.zeros(2)
    while len(trail) < 3000 and np.hypot(*(trail[-1][:2] - world.goal)) > scenario.simulation.goal_tolerance:
        time, seen = 0.02 * (len(trail) - 1), simulation.robot.get_lidar_scan()
        ranges = np.where(np.array(seen["ranges"]) < lidar.range_max - 1e-6, seen["ranges"], np.inf)
        scan = LaserScan(time, seen["angle_min"], seen["angle_increment"], 0.0, lidar.range_max, ranges)
        twist = navigator.step(time, [scan], [Odometry(time, *trail[-1], *twist)], world.goal).twist
        simulation.step(twist[:, None])
        trail.append(simulation.robot.state[:3, 0].copy())
        contacts += bool(simulation.robot.collision)
    away = np.hypot(*(trail[-1][:2] - world.goal))
    print(f"{away:.2f} m from the goal after {time:.1f} s; {contacts} contacts")
    if png is not None:
        save_drive(world, np.array(trail)[:, :2], "A drive in ir-sim", png)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--png", type=Path, metavar="FILE", help="also draw what happened")
    main(parser.parse_args().png)
