"""Parameters of the roadmap: its regions, its growth and its search."""

from dataclasses import dataclass

from drake_starnav.parameters import check_parameters, parameter
from drake_starnav.regions.parameters import StarParameters


@dataclass(frozen=True)
class PlannerParameters(StarParameters):
    """How scans become a roadmap and the roadmap a short-term goal."""

    frontiers: str = parameter(
        "edges",
        "where unknown space may be entered: edges (range jumps and arcs at maximum range) or dbscan (the paper: "
        "between clusters of hits)",
        choices=("edges", "dbscan"),
    )
    frontier_jump: float = parameter(
        0.2, "step of the free range that makes an edge frontier", unit="m", above=0.0, high=10.0
    )
    frontier_spacing: float = parameter(0.25, "distance between frontier points", unit="m", above=0.0, high=5.0)
    probe_distance: float = parameter(
        0.1, "distance of a frontier's probe inside unknown space", unit="m", above=0.0, high=1.0
    )
    cluster_radius: float = parameter(0.2, "DBSCAN's eps for frontiers: dbscan", unit="m", above=0.0, high=5.0)
    cluster_points: int = parameter(2, "DBSCAN's min_samples for frontiers: dbscan", low=1, high=100)
    growth: str = parameter(
        "continuous",
        "when a node is added: continuous (as described by node_spacing and the events) or arrival (the paper: "
        "on arrival at the short-term goal)",
        choices=("continuous", "arrival"),
    )
    node_spacing: float = parameter(
        0.7,
        "distance driven after which a node is added",
        unit="m",
        above=0.0,
        high=20.0,
        when="raise it for long drives: fewer regions, faster searches",
    )
    arrival_distance: float = parameter(
        0.12, "distance at which a frontier counts as reached (the paper: 0.25)", unit="m", above=0.0, high=2.0
    )
    prune_covered: bool = parameter(True, "drop frontiers that a newer region covers (the paper keeps them)")
    inspection_detour: float = parameter(
        1.0,
        "if giving up a target would lengthen the optimistic path by more than this, the robot first drives to the "
        "target's stand: grid; 20: never",
        unit="m",
        low=0.0,
        high=20.0,
    )
    stuck_distance: float = parameter(
        0.0,
        "the target is stuck when a hit is nearer to it than this (the paper: 0.05); 0 for never",
        unit="m",
        low=0.0,
        high=2.0,
    )
    blacklist: bool = parameter(True, "remember places that were tried and led nowhere")
    blacklist_radius: float = parameter(
        0.2, "distance from a failed target within which frontiers are discarded", unit="m", above=0.0, high=2.0
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
    cost_to_go: str = parameter(
        "grid",
        "how frontiers are ranked: grid (optimistic path through unknown space) or straight (line to the goal)",
        choices=("grid", "straight"),
    )
    virtual_frontiers: bool = parameter(
        True, "where the optimistic path leaves the regions far from any frontier, add a virtual frontier: grid"
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
    string_pulling: bool = parameter(
        True, "shorten the path inside the union of the regions (the paper drives from node to node)"
    )
    anticipation: bool = parameter(
        True,
        "on the way to a frontier, turn towards the optimistic path beyond it as soon as a scan shows that",
        when="turn it off to drive to each frontier before turning, as the paper does",
    )
    replanning: bool = parameter(
        True,
        "replan as soon as a scan blocks the optimistic path beyond the target: grid",
        when="turn it off for fewer plans on a slow computer",
    )
    contradiction: float = parameter(
        0.2,  # twice the distance between two beams at 5 m: smaller contradictions stem from coarse older scans
        "regions with hits of a new scan deeper inside than this, such as of a table leg too thin to be detected from "
        "afar, are cut back or discarded; 0 for never, unless drift or jumps are declared",
        unit="m",
        low=0.0,
        high=5.0,
    )
    drop_seen_through: bool = parameter(
        False,
        "with `contradiction`: discard nodes whose hits a new scan sees through; declared drift or jumps set it",
    )
    retries: int = parameter(
        6, "how often, at one place, failed targets are retried when nothing else leads to the goal", low=0
    )
    rate: float = parameter(20.0, "updates of the planner", unit="Hz", low=0.1, high=1000.0)

    def __post_init__(self) -> None:
        check_parameters(self, "planner")
