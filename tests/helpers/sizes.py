"""A shipped scenario at another size: world, robot, lidar, speeds and tolerance are all scaled."""

import dataclasses

import numpy as np

from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.scenario.schema import Scenario
from drake_starnav.simulation.run import run_trial
from drake_starnav.worlds.formats.obstacles import Obstacles

LARGEST_AT_RATE = 6.0
"""Accelerations grow with size up to this scale: wheels slide from 6 m/s^2 on."""


def sized(name: str, scale: float, seed: int) -> Scenario:
    """The scenario of a name with the world of a seed, `scale` times as large.

    Times stay as they are, as far as wheels have the grip: beyond they become longer, so that rates fall.
    """
    slower = max(scale / LARGEST_AT_RATE, 1.0)
    base = load_scenario(name)
    world = base.world.make(np.random.default_rng(seed), base.robot.shape)
    robot, lidar = base.robot, base.lidar
    return dataclasses.replace(
        base,
        world=Obstacles(
            cylinders=(scale * np.reshape(world.cylinders, (-1, 3))).tolist(),
            polygons=[(scale * np.asarray(polygon)).tolist() for polygon in world.polygons],
            bounds=[] if world.bounds is None else (scale * np.asarray(world.bounds)).tolist(),
            start=[scale * world.start[0], scale * world.start[1], world.start[2]],
            goal=[scale * coordinate for coordinate in world.goal],
            timeout=300.0 * slower,
        ),
        robot=dataclasses.replace(
            robot,
            radius=scale * robot.radius,
            max_speed=scale * robot.max_speed / slower,
            max_acceleration=scale * robot.max_acceleration / slower**2,
            max_yaw_rate=robot.max_yaw_rate / slower,
            max_yaw_acceleration=robot.max_yaw_acceleration / slower**2,
        ),
        lidar=dataclasses.replace(
            lidar,
            range_min=scale * lidar.range_min,
            range_max=scale * lidar.range_max,
            noise=scale * lidar.noise,
        ),
        simulation=dataclasses.replace(base.simulation, goal_tolerance=scale * base.simulation.goal_tolerance),
    )


def ratios(name: str, scale: float, seeds: range) -> tuple[float, float]:
    """Means over seeds of the time, in the time that full speed takes for a radius, and of path / shortest path.

    All must be reached.
    """
    driven = [run_trial(sized(name, scale, seed), seed=seed) for seed in seeds]
    assert [trial.outcome for trial in driven] == ["reached"] * len(driven)
    paths = [trial.path_length_m / trial.shortest_path_m for trial in driven if trial.shortest_path_m]
    robot = sized(name, scale, seeds[0]).robot
    times = [trial.time_s * robot.max_speed / robot.radius for trial in driven]
    return float(np.mean(times)), float(np.mean(paths))
