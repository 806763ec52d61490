"""Parameters of the roadmap: its regions, its growth and its search."""

from dataclasses import dataclass

from drake_starnav.parameters import check_parameters, parameter
from drake_starnav.regions.parameters import StarParameters


@dataclass(frozen=True)
class PlannerParameters(StarParameters):
    """How scans become a roadmap and the roadmap a short-term goal.

    Attributes:
        drop_seen_through: discard nodes whose hits a new scan sees through; derived, as are those of `StarParameters`.
    """

    drop_seen_through: bool = False
    comfort: float = parameter(
        0.02,
        "clearance kept beyond the safety margin where there is room",
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
    inspection_detour: float = parameter(
        1.0,
        "if giving up a target would lengthen the optimistic path by more than this, the robot first drives to the "
        "target's stand; 20: never",
        unit="m",
        low=0.0,
        high=20.0,
    )
    progress_distance: float = parameter(0.15, "motion that counts as progress", unit="m", above=0.0, high=5.0)
    progress_timeout: float = parameter(
        4.0,
        "time without progress after which the target is given up",
        unit="s",
        above=0.0,
        high=600.0,
        when="raise it for a robot that takes longer for `planner.progress_distance`",
    )
    grid_resolution: float = parameter(
        0.05,
        "cell size of the distance grid",
        unit="m",
        low=0.01,
        high=0.5,
        when="raise it for worlds of more than 100 m: faster searches",
    )
    grid_beyond: float = parameter(
        0.2, "the distance grid holds distances up to the robot's radius plus this", unit="m", low=0.0, high=2.0
    )
    near_wall_cost: float = parameter(
        0.4,
        "additional cost of a metre right at an obstacle in the cost-to-go, as a multiple of its length",
        low=0.0,
        high=20.0,
        when="raise it to prefer wide paths to short ones",
    )
    hysteresis: float = parameter(
        0.5,
        "bonus of the current target, against oscillation between targets",
        unit="m",
        low=0.0,
        high=20.0,
        when="raise it if the robot oscillates between two paths",
    )
    contradiction: float = parameter(
        0.2,  # twice the distance between two beams at 5 m: smaller contradictions stem from coarse older scans
        "regions with hits of a new scan deeper inside than this, such as of a table leg too thin to be detected from "
        "afar, are cut back or discarded; 0 for never, unless drift or jumps are declared",
        unit="m",
        low=0.0,
        high=5.0,
    )
    retries: int = parameter(
        6, "how often, at one place, failed targets are retried when nothing else leads to the goal", low=0
    )
    rate: float = parameter(20.0, "updates of the planner", unit="Hz", low=0.1, high=1000.0)

    def __post_init__(self) -> None:
        check_parameters(self, "planner")
