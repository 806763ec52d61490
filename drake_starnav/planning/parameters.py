"""Parameters of the roadmap: its regions, its growth and its search."""

from dataclasses import dataclass

from drake_starnav.errors import StarnavError
from drake_starnav.parameters import Checked, parameter

FINEST = 0.01
"""The smallest cell, m: numerics, by what a grid of the largest worlds may hold."""
CLEARANCE, SPACING, CELL = 0.06, 2.8, 0.2
"""Preferred clearance, node spacing and grid resolution in cover radii of the robot, unless they are given."""


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
        0.0,
        f"distance driven after which a node is added; 0: {SPACING:g} radii of the robot",
        unit="m",
        low=0.0,
        high=20.0,
        when="raise it for long drives: fewer regions, faster searches",
    )
    progress_timeout: float = parameter(
        4.0,
        "time without progress after which the way is closed; at least 1.5 times that of 0.6 radii from rest",
        unit="s",
        above=0.0,
        high=600.0,
        when="raise it for a robot that waits longer for what is in its way",
    )
    obstacle_patience: float = parameter(
        0.0,
        "time for which the robot waits where no way is left but past something that is small enough to be one of the "
        "declared obstacles, and may leave; 0: as long as it drives",
        unit="s",
        low=0.0,
        high=86400.0,
        when="set it where the goal is to be given up, as nobody may leave",
    )
    grid_resolution: float = parameter(
        0.0,
        f"cell size of the distance grid; 0: {CELL:g} of the robot's radius",
        unit="m",
        low=0.0,
        high=0.5,
        when="raise it for worlds of more than 100 m: faster searches",
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if 0.0 < self.grid_resolution < FINEST:
            raise StarnavError(
                f"planner.grid_resolution is {self.grid_resolution:g}; allowed: 0, or {FINEST:g} to 0.5 m"
            )

    def clearance(self, radius: float) -> float:
        """`preferred_clearance` of a robot with a cover radius, m."""
        return self.preferred_clearance or CLEARANCE * radius

    def spacing(self, radius: float) -> float:
        """`node_spacing` of a robot with a cover radius, m."""
        return self.node_spacing or SPACING * radius

    def cell(self, radius: float) -> float:
        """`grid_resolution` of a robot with a cover radius, m."""
        return self.grid_resolution or CELL * radius
