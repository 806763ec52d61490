"""No body that is accepted touches anything, judged from its declared numbers alone."""

import json

import numpy as np
import pytest
import shapely
from shapely.affinity import rotate, translate

from drake_starnav.errors import StarnavError
from drake_starnav.loading import parse_scenario
from drake_starnav.simulation.run import run_trial
from tests.station.test_robot_body import random_robots

pytestmark = pytest.mark.slow


def test_random_bodies_drive_among_posts_without_a_contact(tmp_path) -> None:
    """Of 200 with seed 5 three touched a post: wheels that were too near to each other could not stop their turn."""
    rng, driven = np.random.default_rng(82), 0
    for k, robot in enumerate(random_robots(80, 5)):
        size = robot.shape.radius
        low, high = size * np.array((-4.0, -4.5, 0.15)), size * np.array((4.0, 4.5, 0.8))
        posts = rng.uniform(low, high, (5, 3)).tolist()
        bounds = [-8.0 * size, -6.0 * size, 8.0 * size, 6.0 * size]
        world = {"bounds": bounds, "cylinders": posts, "start": [-6.0 * size, 0.0, 1.0], "goal": [6.0 * size, 0.0]}
        body = {"model": robot.model, "base": robot.base, "least_radius": max(0.5, 0.6 * size)}
        body |= (
            {"footprint": np.array(robot.footprint, object).tolist()} if robot.footprint else {"radius": robot.radius}
        )
        text = f"world: !Obstacles {json.dumps(world)}\nrobot: {json.dumps(body)}\n"
        text += f"lidar: {{range_max: {max(5.0, 5.0 * size)}}}\nsimulation: {{timeout: 20}}\n"
        try:
            trial = run_trial(parse_scenario(text, name="body"), seed=k, csv=tmp_path / "run.csv")
        except StarnavError:
            continue
        states = np.loadtxt(tmp_path / "run.csv", delimiter=",", skiprows=1)[::4]
        parts = robot.footprint if not robot.footprint or isinstance(robot.footprint[0][0], list) else [robot.footprint]
        area = shapely.union_all([shapely.Polygon(part) for part in parts])
        area = area if robot.footprint else shapely.Point(0.0, 0.0).buffer(robot.radius, 64)
        around = [shapely.Point(x, y).buffer(radius, 64) for x, y, radius in posts]
        obstacles = shapely.union_all([*around, shapely.box(*bounds).exterior])
        turned = [translate(rotate(area, yaw, (0, 0), use_radians=True), x, y) for x, y, yaw in states[:, 1:4]]
        assert trial.outcome != "collision" and shapely.distance(turned, obstacles).min() > 0.0, text
        driven += 1
    assert driven > 30
