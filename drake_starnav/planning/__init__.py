"""Regions -> roadmap, path and short-term goal."""

from drake_starnav.planning.guidance import Guidance
from drake_starnav.planning.parameters import PlannerParameters
from drake_starnav.planning.planner import plan_step
from drake_starnav.planning.roadmap import StarRoadmap
from drake_starnav.planning.state import PlannerInput, PlannerState, PlannerStatus

__all__ = [
    "Guidance",
    "PlannerInput",
    "PlannerParameters",
    "PlannerState",
    "PlannerStatus",
    "StarRoadmap",
    "plan_step",
]
