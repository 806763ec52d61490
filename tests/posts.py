"""A small world with two posts, and runs in it to test with."""

from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Diagram

from drake_starnav.scenario import Scenario, parse_scenario

POSTS = """
world: !Obstacles
  bounds: [-1, -2, 5, 2]
  cylinders: [[1.7, 0.1, 0.4], [2.8, -0.9, 0.3]]
  start: [0.2, 0.1, 0.3]
  goal: [3.8, 0.0]
"""
GOALS = ([3.8, 0.0], [-0.4, 1.5])


def posts() -> Scenario:
    return parse_scenario(POSTS, name="posts")


def simulated(diagram: Diagram, goal=GOALS[0]) -> Simulator:
    """A simulator of its own context, in which the goal is set."""
    simulator = Simulator(diagram)
    source = diagram.GetSubsystemByName("goal")
    source.get_mutable_source_value(source.GetMyMutableContextFromRoot(simulator.get_mutable_context())).set_value(goal)
    return simulator
