"""The method of arXiv 2403.11484, with its errors corrected and its gaps filled: both are listed.

Each file is a part of section III or IV, and a function that is an equation begins with its number.

It stands beside our method as one of a user's own does: `method` has the functions that replace perception, planner and
controller. docs/paper.md has the map from each equation to its place, and what is not printed.
"""

from typing import Any

from drake_starnav.errors import StarnavError
from drake_starnav.paper.algorithm import control, perceive, plan

__all__ = ["control", "method", "perceive", "plan"]


def method(scenario: Any) -> dict[str, Any]:
    """Return what drives in the place of our parts, by the fields of `Parts`. Nothing is certified.

    Raises:
        StarnavError: the robot of the scenario is no differential drive, or a goal has a heading.
    """
    if scenario.robot.base != "differential":
        raise StarnavError(
            f"method star_paper with robot.base {scenario.robot.base}; allowed: star, or a differential drive"
        )
    for k, goal in enumerate(scenario.goals):
        if len(goal) == 3:
            raise StarnavError(
                f"goals[{k}] has a yaw with method star_paper, which follows no turns on the spot; allowed: [x, y]"
            )
    return {"perception": perceive, "planner": plan, "controller": control, "certified": False}
