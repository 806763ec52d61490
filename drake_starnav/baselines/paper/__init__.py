"""The method of arXiv 2403.11484 as printed, behind the interfaces of this project's: perception, planner, controller.

It shares the star regions, the roadmap and its search with this project's method, and none of what that changes.
"""

from drake_starnav.baselines.paper import constants
from drake_starnav.baselines.paper.control import proposal
from drake_starnav.baselines.paper.perception import perceive
from drake_starnav.baselines.paper.planner import plan_step

__all__ = ["constants", "perceive", "plan_step", "proposal"]
