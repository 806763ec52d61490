"""A small world with two posts, and runs in it to test with."""

from typing import Any

from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Diagram

from drake_starnav.scenario.scenario_file import parse_scenario
from drake_starnav.scenario.schema import Scenario

POSTS = """
world: !Obstacles
  bounds: [-1, -2, 5, 2]
  cylinders: [[1.7, 0.1, 0.4], [2.8, -0.9, 0.3]]
  start: [0.2, 0.1, 0.3]
  goal: [3.8, 0.0]
"""
GOALS = ([3.8, 0.0], [-0.4, 1.5])
LOOP_OUTPUTS = [
    "planner.guidance",
    "planner.short_term_goal",
    "planner.planner_state",
    "planner.status",
    "planner.blocked_by",
    "controller.desired_twist",
    "controller.guiding_vector",
    "shield.twist_command",
    "shield.certificate",
]
"""What a diagram exports of its planner and its controller."""
STATION_OUTPUTS = [
    "lidar.scan",
    "lidar.ranges",
    "lidar.point_cloud",
    "lidar.X_WS",
    "localization.pose",
    "localization.state",
    "localization.scan_pose",
    "cheat.robot_state",
    "cheat.contact_results",
    "cheat.geometry_query",
]
"""What a station exports."""


def posts(**changes: Any) -> Scenario:
    """The scenario; `changes` as `parse_scenario` takes them."""
    return parse_scenario(POSTS, name="posts", **changes)


def simulated(diagram: Diagram, goal=GOALS[0]) -> Simulator:
    """A simulator of its own context, in which the goal is set."""
    simulator = Simulator(diagram)
    context = diagram.GetSubsystemByName("goal").GetMyMutableContextFromRoot(simulator.get_mutable_context())
    context.SetDiscreteState(goal)
    return simulator
