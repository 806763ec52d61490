"""Parameters of the roadmap: its regions, its growth and its search."""

from dataclasses import dataclass

from drake_starnav.parameters import Checked, parameter

CLEARANCE = 0.06
"""Preferred, in narrow radii of the robot, unless it is given."""


@dataclass(frozen=True)
class PlannerParameters(Checked, place="planner"):
    """How scans become a roadmap and the roadmap a short-term goal."""

    preferred_clearance: float = parameter(
        0.0,
        f"clearance kept beyond the safety margin where there is room; 0: {CLEARANCE:g} of the robot's radius",
        unit="m",
        low=0.0,
        high=1.0,
        when="larger to keep farther from walls; narrower passages are still entered",
    )
    node_spacing: float = parameter(
        0.7,
        "distance driven after which a node is added",
        unit="m",
        above=0.0,
        high=20.0,
        when="raise it for long drives: fewer regions, faster searches",
    )
    progress_timeout: float = parameter(
        4.0,
        "time without progress after which the target is given up",
        unit="s",
        above=0.0,
        high=600.0,
        when="raise it for a robot that takes longer to get 0.15 m ahead",
    )
    grid_resolution: float = parameter(
        0.05,
        "cell size of the distance grid",
        unit="m",
        low=0.01,
        high=0.5,
        when="raise it for worlds of more than 100 m: faster searches",
    )

    def clearance(self, radius: float) -> float:
        """`preferred_clearance` of a robot with a narrow radius, m."""
        return self.preferred_clearance or CLEARANCE * radius
