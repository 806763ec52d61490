"""What the paper does not print: every value and reading, why it is so, and what others give.

This is the only place of them: the code reads the values below, docs/paper.md shows the table, and a test compares the
two. Figures are drives that arrive in the authors' forest in 180 s, of seeds 0 to 3, and their mean time, of a robot
that follows each twist within its accelerations. With the values chosen 4 of 4 do, in 59 s: four drives tell the kind
of an effect, not its size.
"""

import math
from typing import Any, NamedTuple


class Choice(NamedTuple):
    """One of them.

    Attributes:
        value: as chosen, or the name of the function that is the reading.
        meaning: what it is, with its unit.
        printed: what the paper says of it.
        reason: why this value.
        others: what other values or readings give.
    """

    value: Any
    meaning: str
    printed: str
    reason: str
    others: str


CHOICES: dict[str, Choice] = {}
"""By name, in the order of the paper."""


def _choose(name: str, value: Any, meaning: str, printed: str, reason: str, others: str = "not tried") -> Any:
    """Enter a choice in the table, and return its value."""
    CHOICES[name] = Choice(value, meaning, printed, reason, others)
    return value


SLOPE_CHANGE = _choose(
    "SLOPE_CHANGE", 0.02 * math.pi, "change of the boundary's slope angle that begins a cubic, rad",
    "IV: \"the rate of change in radial distance\", no threshold", "the authors' code: pi / 50",
)  # fmt: skip
SHORTEST_SEGMENT = _choose(
    "SHORTEST_SEGMENT", 4, "samples after which a change of slope may begin a cubic", "nothing",
    "as many as determine a cubic", "the authors' code: any, on ranges smoothed by a Gaussian of 10 beams",
)  # fmt: skip
JUMP = _choose(
    "JUMP", 0.12, "step of the range that begins a cubic, m", "nothing", "12 standard deviations of the range"
)
RANGE = _choose(
    "RANGE", 100.0, "largest range that is used, m", "that of the lidar, which is not given", "all that it sees",
    "the authors' code: 2 m",
)  # fmt: skip
EPS = _choose(
    "EPS", 0.5, "eps of DBSCAN, m", "nothing", "a gap that the robot of 0.2 m passes", "the authors' code: 0.2"
)
MIN_SAMPLES = _choose(
    "MIN_SAMPLES", 3, "min_samples of DBSCAN", "nothing", "noise is no cluster", "the authors' code: 2"
)
FRONTIER_BEARING = _choose(
    "FRONTIER_BEARING", "compute_mean_bearing", "theta_f of a frontier point",
    "Eq. (5): the mean of two bearings; its text: that of their midpoint",
    "the equation is what is printed", "`compute_midpoint_bearing`: 4 of 4, 65 s",
)  # fmt: skip
FRONTIER_DISTANCE = _choose(
    "FRONTIER_DISTANCE", "the midpoint's", "distance of a frontier point from p_ref",
    "\"on the boundary\", and \"midpoint\": contradictory", "the text before Eq. (5), and the authors' code",
)  # fmt: skip
INSET = _choose(
    "INSET", 0.05, "a frontier point lies this far inside the boundary, m", "nothing", "it is in the region"
)
WIDE_OPENING = _choose(
    "WIDE_OPENING", 0.9 * math.pi, "across a wider opening the midpoint is replaced, rad", "nothing",
    "it would be at or behind the robot",
)  # fmt: skip
WIDE_SHARE = _choose("WIDE_SHARE", 0.6, "by a point at this share of the range", "nothing", "well inside the region")
EDGES = _choose(
    "EDGES", "StarRoadmap.edges", "edges of the roadmap", "III-B.2: from a node to its own frontier points",
    "also between nodes where one region holds the centre of the other, so that a robot that was stuck leaves by any "
    "of them",
    "the authors' code: a tree",
)  # fmt: skip
ARRIVAL = _choose(
    "ARRIVAL", 0.2, "p = p_sg when this near, m", "p = p_sg", "the robot's radius", "the authors' code: 0.25"
)
FEASIBLE_DISTANCE = _choose(
    "FEASIBLE_DISTANCE", 0.0, "p_sg with a hit nearer than this is infeasible, m",
    "line 14: \"check the feasibility of p_sg\"", "off, as midpoints between two obstacles may lie close to a third",
    "0.1: 0 of 4, in 3 of which no frontier point is left; the authors' code: 0.05, on arrival",
)  # fmt: skip
STUCK_DISTANCE = _choose(
    "STUCK_DISTANCE", 0.15, "p_sg is infeasible, too, when the robot has not moved this far, m", "the same",
    "else a robot between two obstacles stands for good", "the authors' code: no such rule",
)  # fmt: skip
STUCK_TIME = _choose("STUCK_TIME", 5.0, "in this time, s", "the same", "as above", "10: 2 of 4, 66 s")
SEARCH_END = _choose(
    "SEARCH_END", "find_shortest_sequence", "where Eq. (6) ends while p_goal is no node", "p_f,M = p_goal",
    "least path and straight line on to the goal", "the authors' code: the frontier point nearest to the goal",
)  # fmt: skip
SIGMA = _choose("SIGMA", 2.0, "sigma of Gamma", '"predefined"', "the authors' code")
RHO = _choose(
    "RHO", 0.02, "rho of Eq. (15), m", "\"predefined\"",
    "a is 1 below rho of clearance, and the authors' forest leaves 26 to 95 mm a side",
    "0.01: 2 of 4, 50 s; 0.035: 2 of 4, 88 s; the others by timeout in gaps",
)  # fmt: skip
NEAREST_BEAMS = _choose(
    "NEAREST_BEAMS", 5, "p_n is sought in the medians of so many neighbouring beams", "\"the nearest point\" of L",
    "the nearest of raw hits lies up to 25 mm too near, at 10 mm of noise: as much as gaps leave",
    "1, raw hits: 3 of 4, 108 s",
)  # fmt: skip
NEAREST_VECTOR = _choose(
    "NEAREST_VECTOR", "compute_vector_along_and_away", "p~_n* of Eq. (15)", "not defined",
    "the authors' code; where p_n changes sides in a gap it turns by a quarter, where `compute_vector_away` turns "
    "about; the share along fades below rho of clearance, without which it leads into gaps that are too narrow",
    "`compute_vector_away`: 4 of 4, 99 s; `compute_vector_along`, by the notation: 2 of 4, 109 s, the others by "
    "contact",
)  # fmt: skip
PUSH = _choose(
    "PUSH", 1.0, "share of the vector away in `compute_vector_along_and_away`", "nothing",
    "the authors' code: 1.5 - 2 |p - p_n|, near r 1.1", "0.5: 3 of 4, 53 s",
)  # fmt: skip
FOLLOW_VECTOR = _choose(
    "FOLLOW_VECTOR", "turn_towards", "the low-level controller", "\"a PID controller\", no gains",
    "it turns before it drives, and can stop within its clearance: p~_n* turns at once where p_n changes sides, and "
    "the robot, which can not, would reach the other side before it has turned",
    "at a constant speed: 1 of 4, `follow_authors_pid`: 1 of 4, the others by contact",
)  # fmt: skip
SPEED = _choose(
    "SPEED", 1.0 / 3.0, "largest speed of `turn_towards`, m/s", "0.4 m/s on average, in the room",
    "the fixed point of the authors' PID",
)  # fmt: skip
CREEP = _choose(
    "CREEP", 0.02, "speed of `turn_towards` without any clearance, m/s", "nothing",
    "noise shows less clearance than there is, and a robot that stands does not leave", "0.05: 3 of 4, 94 s",
)  # fmt: skip
