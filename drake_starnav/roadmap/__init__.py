"""Star-shaped regions -> where to go next."""

from drake_starnav.roadmap.fastest_step import fastest_step
from drake_starnav.roadmap.parameters import PlannerParameters
from drake_starnav.roadmap.planner import plan_step
from drake_starnav.roadmap.roadmap import StarRoadmap
from drake_starnav.roadmap.state import Observation, PlannerInput, PlannerState, PlannerStatus

__all__ = [
    "Observation",
    "PlannerInput",
    "PlannerParameters",
    "PlannerState",
    "PlannerStatus",
    "StarRoadmap",
    "fastest_step",
    "plan_step",
]
