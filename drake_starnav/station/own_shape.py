"""The shape of a robot as its model has it."""

import dataclasses
import math
from typing import Any

import numpy as np
import shapely
from pydrake.geometry import SceneGraph
from pydrake.multibody.plant import MultibodyPlant

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


def with_own_shape(scenario: Scenario) -> Scenario:
    """The scenario with the shape of the robot's model, of which nothing was said: `robot.radius` is 0."""
    robot = scenario.robot
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
