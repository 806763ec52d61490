"""The method of arXiv 2403.11484, with its errors corrected and its gaps filled: both are listed.

Each file is a part of section III or IV, and a function that is an equation begins with its number.

It stands beside our method as one of a user's own does: `method` has the functions that replace perception, planner and
controller. docs/paper.md has the map from each equation to its place, and what is not printed.
"""

from typing import Any

from drake_starnav.paper.algorithm import control, perceive, plan
from drake_starnav.scenario.schema import check_plain_robot

__all__ = ["control", "method", "perceive", "plan"]


def method(scenario: Any) -> dict[str, Any]:
    """Return what drives in the place of our parts, by the fields of `Parts`. Nothing is certified.

    Raises:
        StarnavError: the robot of the scenario is no differential drive, or a goal has a heading.
    """
    check_plain_robot(scenario)
    return {"perception": perceive, "planner": plan, "controller": control, "certified": False}
