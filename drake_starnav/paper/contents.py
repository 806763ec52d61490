"""Where each equation, line, table and figure of arXiv 2403.11484 is, and what our method makes of it."""

from typing import NamedTuple

ROOM = "drake_starnav.paper"
MODULATION = f"{ROOM}.modulation"


class Entry(NamedTuple):
    """One of them.

    Attributes:
        name: as the paper numbers it.
        subject: what it says.
        place: module:name, or a file of the repository.
        as_here: "as printed" or what is corrected, of `star_paper`.
        in_star: "as printed", "corrected", "replaced by ..." or "not used", of `star`.
    """

    name: str
    subject: str
    place: str
    as_here: str
    in_star: str


PRINTED, UNUSED = "as printed", "not used"
ENTRIES = (
    Entry("(1)", "free space W = G without the obstacles", "drake_starnav.worlds:World", PRINTED, PRINTED),
    Entry("(2)", "polar coordinates", f"{ROOM}.star_region:compute_polar_coordinates", PRINTED, PRINTED),
    Entry("(3)", "cubic of a segment", f"{ROOM}.star_region:fit_boundary", "corrected: scaled abscissa", "corrected"),
    Entry(
        "(4)", "piecewise cubic Phi", f"{ROOM}.star_region:find_segment_breaks", "as printed; its breaks are a choice",
        "corrected: below all samples",
    ),
    Entry(
        "(5)", "bearing of a frontier point", f"{ROOM}.frontier_points:compute_mean_bearing",
        "as printed, but across the seam", "replaced by gaps in the boundary of what is known",
    ),
    Entry(
        "(6)", "search", f"{ROOM}.short_term_goal:find_shortest_sequence", "corrected: begins at the robot",
        "replaced by a cost field over known and unknown cells",
    ),
    Entry("(7)", "guiding vector p~", f"{MODULATION}:guiding_vector", PRINTED, "corrected: of unit length"),
    Entry("(8)", "modulation M p~", f"{MODULATION}:modulate_at_level", PRINTED, PRINTED),
    Entry("(9)", "E and D", f"{MODULATION}:make_modulation_matrix", "corrected: r, e are columns", "corrected"),
    Entry("(10)", "e", f"{MODULATION}:compute_boundary_tangent", "corrected: tangent of the boundary", "corrected"),
    Entry("(11)", "theta-bar", f"{MODULATION}:compute_boundary_tangent", "corrected: theta by atan2", "corrected"),
    Entry(
        "(12)", "eigenvalues", f"{MODULATION}:compute_eigenvalues", PRINTED, "corrected: outward motion alone is damped"
    ),
    Entry("(13)", "weights", f"{MODULATION}:compute_weights", PRINTED, "replaced by Gamma - 1, which is continuous"),
    Entry(
        "(14)", "weighted sum", f"{MODULATION}:modulate_vector", "corrected: from the first region", "corrected"
    ),
    Entry(
        "(15)", "blend with the nearest point", f"{ROOM}.blend:combine_vectors",
        "corrected: a is 1 inside r; p~_n* is a choice", "replaced by the braking certificate",
    ),
    Entry("line 1", "Function GenRoadmap(p, L, R)", f"{ROOM}.roadmap:generate_roadmap", PRINTED, UNUSED),
    Entry(
        "line 2", "P <- Fit", f"{ROOM}.star_region:make_traversable_region", PRINTED, "corrected: eroded by the robot"
    ),
    Entry(
        "line 3", "F <- Identify frontier points", f"{ROOM}.frontier_points:identify_frontier_points",
        "corrected, as (5)", UNUSED,
    ),
    Entry("line 4", "N <- p and F", f"{ROOM}.roadmap:generate_roadmap", PRINTED, "corrected: regions alone are nodes"),
    Entry(
        "line 5", "E <- edge set", "drake_starnav.planning.roadmap:StarRoadmap",
        "corrected: also where one region holds the centre of the other", "corrected: only drawn",
    ),
    Entry("line 6", "R* <- N and E", f"{ROOM}.roadmap:generate_roadmap", PRINTED, PRINTED),
    Entry("line 7", "R <- R and R*", f"{ROOM}.roadmap:generate_roadmap", PRINTED, PRINTED),
    Entry("line 8", "return R", f"{ROOM}.roadmap:generate_roadmap", PRINTED, PRINTED),
    Entry("line 9", "R is empty, p_sg does not exist", f"{ROOM}.roadmap:PaperState", PRINTED, PRINTED),
    Entry("line 10", "while p not reach p_goal", f"{ROOM}.algorithm:plan", PRINTED, PRINTED),
    Entry(
        "line 11", "if R is empty or p = p_sg or update", f"{ROOM}.algorithm:plan",
        "as printed, but not at visited nodes", "replaced: more causes",
    ),
    Entry("line 12", "R <- GenRoadmap(p, B, R)", f"{ROOM}.algorithm:plan", "corrected: L for B", "corrected"),
    Entry(
        "line 13", "p_sg <- Search in R", f"{ROOM}.short_term_goal:find_shortest_sequence", "corrected, as (6)",
        "replaced, as (6)",
    ),
    Entry(
        "line 14", "stuck <- feasibility of p_sg", f"{ROOM}.roadmap:is_feasible",
        "replaced by a rule on progress, a choice", "replaced by closures",
    ),
    Entry("line 15", "if stuck", f"{ROOM}.algorithm:plan", PRINTED, UNUSED),
    Entry("line 16", "Delete p_sg in R", f"{ROOM}.roadmap:delete_point", "corrected: points alone", UNUSED),
    Entry("line 17", "replan, update <- True", f"{ROOM}.algorithm:plan", "corrected: reset", UNUSED),
    Entry("line 18", "if p = p_goal or replan", f"{ROOM}.algorithm:plan", PRINTED, UNUSED),
    Entry("line 19", "Continue", f"{ROOM}.algorithm:plan", PRINTED, UNUSED),
    Entry("line 20", "modulated vector", f"{ROOM}.algorithm:control", PRINTED, "corrected, as (8) to (14)"),
    Entry("line 21", "combined vector", f"{ROOM}.algorithm:control", PRINTED, "replaced, as (15)"),
    Entry(
        "line 22", "u <- low-level controller", f"{ROOM}.pid:turn_towards", "replaced by a turning law, a choice",
        "replaced by our turning law",
    ),
    Entry("Table I", "methods in forest and maze", "drake_starnav.evaluation.suites:SUITES", "-", "-"),
    Entry(
        "Fig. 2", "the roadmap", "drake_starnav.visualization.star_roadmap_visualizer:StarRoadmapVisualizer", "-", "-"
    ),
    Entry("Fig. 5", "error and time of segments", "scripts/experiments/ablate_segments.py", "-", "-"),
    Entry("Fig. 6", "trajectories in both worlds", "scripts/maintenance/paper_figures.py", "-", "-"),
    Entry("Fig. 7", "the room with a dead end", "scripts/maintenance/paper_figures.py", "-", "-"),
)  # fmt: skip
"""Equations (1) to (15), lines of Algorithm 1 statement after statement, Table I, and figures."""
