"""What each part of the method is worth: the same trials with one part left out or replaced."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Ablation:
    """One row of the table.

    Attributes:
        name: also that of its file of trials.
        meaning: what differs from the full method, in a few words.
        overrides: "section.key=value" texts that make the difference.
        reference: where the part is described: a section of the paper (arXiv 2403.11484), or of the method's page.
        method: see `drake_starnav.scenario.METHODS`.
    """

    name: str
    meaning: str
    overrides: tuple[str, ...]
    reference: str
    method: str = "star"


REFERENCE = Ablation("star", "the full method", (), "paper III; method 1 to 9")
"""What the others are compared with."""

ABLATIONS = (
    REFERENCE,
    Ablation("no_certificate", "no braking certificate", ("controller.certificate=false",), "method 9"),
    Ablation(
        "no_protection",
        "no certificate, modulation and near-wall term",
        ("controller.certificate=false", "controller.modulation=false", "controller.near_wall_term=false"),
        "paper III-C.3; method 7, 9",
    ),
    Ablation("no_erosion", "ranges less the radius instead of eroded ones", ("planner.erosion=radial",), "method 1"),
    Ablation("two_sided_fit", "cubics through the samples, not inside", ("planner.one_sided_fit=false",), "method 2"),
    Ablation(
        "fixed_segments",
        "16 equal segments",
        ("planner.segmentation=fixed", "planner.segments=16"),
        "paper III-B.1, fig. 5; method 2",
    ),
    Ablation("dbscan_frontiers", "the paper's frontiers", ("planner.frontiers=dbscan",), "paper III-B.2; method 4"),
    Ablation("no_gates", "targets are frontiers only", ("planner.gates=false",), "method 6"),
    Ablation("no_retirement", "dead ends are not remembered", ("planner.retire_dead_ends=false",), "method 4"),
    Ablation(
        "straight_cost_to_go",
        "frontiers ranked by the straight line to the goal",
        ("planner.cost_to_go=straight",),
        "paper III-C.2; method 6",
    ),
    Ablation("no_string_pulling", "the path runs over the nodes", ("planner.string_pulling=false",), "method 6"),
    Ablation("no_anticipation", "each frontier is driven to first", ("planner.anticipation=false",), "method 6"),
    Ablation("no_replanning", "a barred way on is no cause to plan", ("planner.replanning=false",), "method 6"),
    Ablation("no_closer_look", "dead ends are told from afar", ("planner.closer_look=20",), "method 6"),
    Ablation("any_bend", "modulation turns as far as it likes", ("controller.max_bend=3.2",), "method 7"),
    Ablation("no_margin_shrinking", "the margin stays", ("planner.margin_shrinking=false",), "method 6"),
    Ablation("clipped_weights", "regions weighted by min(Gamma, 8)", ("controller.weights=clipped",), "method 7"),
    Ablation(
        "paper_weights",
        "the paper's sum: by max(Gamma, 1), of vectors as long as they are",
        ("controller.weights=paper",),
        "paper III-C.3; method 7",
    ),
    Ablation("wide_near_wall_zone", "near-wall zone of 0.10 m", ("controller.near_wall_zone=0.10",), "method 7"),
    Ablation("no_swerve", "straight on where the certificate refuses it", ("controller.max_swerve=0",), "method 9"),
    Ablation("one_scan", "safety star from the last scan only", ("controller.scan_memory=1",), "method 9"),
    Ablation("noisy_lidar", "range noise of 3 cm", ("lidar.noise=0.03",), "method, what each part is worth"),
    Ablation("star_paper", "the paper's configuration", (), "paper III, IV; method, star_paper", "star_paper"),
    Ablation(
        "star_paper_fast",
        "the paper's, but driven at 0.8 m/s",
        ("controller.tracking=law",),
        "paper III; method 8",
        "star_paper",
    ),
    Ablation(
        "star_paper_slow",
        "the paper's, but driven at 0.4 m/s",
        ("controller.tracking=law", "robot.max_speed=0.4"),
        "paper III; method 8",
        "star_paper",
    ),
)
"""The table. The paper's PID settles at a third of a metre a second whatever the limit, hence the last two rows."""
