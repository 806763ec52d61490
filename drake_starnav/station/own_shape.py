"""Scenarios whose robot's shape is that of its model."""

import dataclasses
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import MultibodyPlant

from drake_starnav import scenario as scenarios
from drake_starnav.errors import StarnavError
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario import Scenario
from drake_starnav.station.robot_geometry import link_poses, robot_outline
from drake_starnav.station.robot_model import add_robot

LARGEST_RADIUS = 5.0
"""A model may reach so far while its shape is read, m."""
ROUND = 0.97
"""A model that covers this share of the disc around it counts as a disc."""
SIMPLIFIED = 0.004
"""Corners are left out where the outline grows by no more than about this, m."""


def load_scenario(name_or_path: str | Path, *, method: str = "star", overrides: Sequence[str] = ()) -> Scenario:
    """A shipped scenario by name, or one from a YAML file by path.

    If nothing is said of the shape of a robot of the user's own, it is that of the model's collision shapes.

    Args:
        name_or_path: e.g. "forest", or "my/world.yaml".
        method: whose settings the scenario's own keys are laid over; see `METHODS`.
        overrides: "dotted.key=value" texts, laid over the scenario's keys.

    Raises:
        StarnavError: no such scenario, method or model, broken YAML, unknown key, or a value that is not allowed.
    """
    return with_own_shape(scenarios.load_scenario(name_or_path, method=method, overrides=overrides))


def parse_scenario(text: str, *, name: str, **given: Any) -> Scenario:
    """A scenario from YAML text; arguments as of `scenario.parse_scenario`, and the shape as for `load_scenario`."""
    return with_own_shape(scenarios.parse_scenario(text, name=name, **given))


def with_own_shape(scenario: Scenario) -> Scenario:
    """The scenario with the shape of the robot's model, where `robot.radius` is 0."""
    robot = scenario.robot
    if robot.radius > 0.0:
        return scenario
    shape = own_shape(dataclasses.replace(robot, radius=LARGEST_RADIUS))
    return dataclasses.replace(scenario, robot=dataclasses.replace(robot, **shape))


def own_shape(robot: RobotParameters) -> dict[str, Any]:
    """`radius`, and `footprint` unless it is round, from a model's collision shapes with all joints at zero."""
    plant, scene_graph = MultibodyPlant(1.0), SceneGraph()
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    model = add_robot(plant, scene_graph, robot, (0.0, 0.0, 0.0))
    outline = robot_outline(plant, scene_graph, link_poses(plant, model))
    if outline is None:
        raise StarnavError(
            f"robot model {robot.model} has no collision shapes that enclose anything; allowed: robot.radius or "
            "robot.footprint"
        )
    hull, radius = shapely.Polygon(outline), float(np.hypot(*outline.T).max())
    if hull.area > ROUND * math.pi * radius**2:
        return {"radius": math.ceil(1e3 * radius) / 1e3}
    simple = hull.simplify(SIMPLIFIED).buffer(SIMPLIFIED, join_style="mitre") if len(outline) > 8 else hull
    corners = shapely.get_coordinates(simple)[:-1].round(4).tolist()
    return {"radius": RobotParameters.radius, "footprint": corners}
