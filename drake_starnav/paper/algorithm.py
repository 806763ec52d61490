"""Algorithm 1, line by line.

Its loop is cut where the systems of a navigation loop meet: each scan passes `perceive` (line 2) and `plan` (lines 9 to
19), each command `control` (lines 20 to 22). Lines are numbered as printed, one statement after another, `end` not
counted. Nothing is certified.
"""

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from drake_starnav.control.inputs import ControllerInputs, Proposal
from drake_starnav.errors import StarnavError
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.mounts import ON_AXIS
from drake_starnav.lidar.outlier_filter import HitHistory
from drake_starnav.paper import choices, pid
from drake_starnav.paper.blend import combine_vectors, find_nearest_hit, smooth_distances
from drake_starnav.paper.modulation import guiding_vector, modulate_vector
from drake_starnav.paper.roadmap import PaperState, delete_point, generate_roadmap, is_feasible, is_near
from drake_starnav.paper.short_term_goal import find_shortest_sequence
from drake_starnav.paper.star_region import make_traversable_region
from drake_starnav.planning.state import PlannerInput, PlannerState, PlannerStatus, Route
from drake_starnav.robot import RobotParameters
from drake_starnav.robot.base import convert_to_twist
from drake_starnav.surroundings.observation import Observation
from drake_starnav.surroundings.perception import PerceptionSettings, PerceptionState
from drake_starnav.surroundings.recent_hits import Hits, RecentHits
from drake_starnav.surroundings.surroundings import Surroundings
from drake_starnav.surroundings.view import View
from drake_starnav.utils.snapshot import replace_fields

STOP = Proposal(np.zeros(2), np.zeros(2))


def perceive(
    state: PerceptionState, scans: Sequence[LaserScan], pose: np.ndarray, settings: PerceptionSettings
) -> PerceptionState:
    """Line 2: P <- fit piecewise polynomials to L; arguments as for `surroundings.perception.perceive`.

    Of the surroundings there are only the time and the hits in which p_n is sought. Raises a `StarnavError` unless
    there is one lidar, on the robot's axis.
    """
    if tuple(settings.mounts) != (ON_AXIS,):
        raise StarnavError(f"the paper's method with {len(scans)} lidars or one off the axis; allowed: one on the axis")
    (scan,) = scans
    region = make_traversable_region(scan, pose, settings.footprint.cover_radius)
    distances = smooth_distances(scan)
    hit_points = scan.points_at(distances, scan.hits & (distances < choices.RANGE), pose)
    surroundings = replace_fields(
        Surroundings.unknown(),
        recent_hits=RecentHits(Hits(hit_points)),
        time=scan.time,
        previous_time=state.surroundings.time,
    )
    view = View(scan, scan, ON_AXIS, pose, HitHistory(), settings.view_params)
    return PerceptionState(Observation(region, scan, pose), surroundings, (view,))


def plan(state: PlannerState, inputs: PlannerInput) -> PlannerState:
    """Lines 9 to 19, for the scan of a pass; arguments as for `planning.plan_step`.

    Corrected: `update` and `replan`, which the printed algorithm never resets, are reset.
    """
    observation, p, p_goal = inputs.observation, inputs.position, inputs.goal
    if state.status is PlannerStatus.UNREACHABLE or observation.region is None:
        return state
    paper = note_progress(PaperState.of(state), inputs)  # line 9
    while True:  # line 10; that p reaches p_goal ends the drive
        is_there = len(paper.route.path) > 0 and is_near(p, paper.route.path[0], choices.ARRIVAL)  # p = p_sg
        nodes = np.flatnonzero(
            [is_there and np.array_equal(c, paper.route.path[0]) for c in paper.roadmap.union.center]
        )
        if len(nodes):  # "each time the robot reaches an unvisited node": this one was
            paper = dataclasses.replace(paper, node=int(nodes[0]))
        elif not len(paper.roadmap) or (is_there and not is_at_goal(paper)) or paper.update:  # line 11
            paper = delete_point(paper, paper.route.path[0]) if is_there else paper  # it becomes the node
            paper = generate_roadmap(paper, observation)  # line 12
        places, reaches_goal = find_shortest_sequence(paper, p, p_goal)  # line 13
        paper = replace_path(paper, places, reaches_goal)
        if not len(places) or is_feasible(paper, observation, inputs.time):  # lines 14, 15 and 18
            return paper
        paper = delete_point(paper, places[0])  # line 16
        paper = note_progress(
            dataclasses.replace(paper, route=Route(places[:0]), update=True), inputs, anew=True
        )  # lines 17, 19


def control(inputs: ControllerInputs, robot: RobotParameters) -> Proposal:
    """Lines 20 to 22; arguments as for `control.followed`."""
    p, yaw, guidance = inputs.pose[:2], float(inputs.pose[2]), inputs.guidance
    if not len(guidance.path):
        return STOP
    guide = guiding_vector(p, guidance.path[0])  # Eq. (7)
    vector = modulate_vector(p, guide, guidance.regions)  # line 20, Eq. (14)
    nearest, hit_clearance = find_nearest_hit(p, inputs.surroundings.recent_hits.hits.points, robot.radius), math.inf
    if nearest is not None:
        vector, hit_clearance = combine_vectors(vector, guide, nearest), nearest.clearance  # line 21, Eq. (15)
    vector_length = float(np.hypot(*vector))
    if vector_length == 0.0:
        return STOP
    u = pid.follow_vector(vector, yaw, hit_clearance, robot.limits)  # line 22
    return Proposal(convert_to_twist(u, robot.drive), vector / vector_length)


def note_progress(state: PaperState, inputs: PlannerInput, anew: bool = False) -> PaperState:
    """Return the state that remembers where and when the robot last moved by `STUCK_DISTANCE`; or begins `anew`."""
    if not anew and is_near(inputs.position, state.progress.position, choices.STUCK_DISTANCE):
        return state
    progress = state.progress._replace(position=inputs.position.copy(), time=inputs.time)
    return dataclasses.replace(state, progress=progress)


def is_at_goal(state: PaperState) -> bool:
    """Whether the short-term goal is the goal itself."""
    return state.status is PlannerStatus.APPROACHING and len(state.route.path) == 1


def replace_path(state: PaperState, places: np.ndarray, reaches_goal: bool) -> PaperState:
    """Return the state with a new path; without one the goal is unreachable."""
    status = PlannerStatus.APPROACHING if reaches_goal else PlannerStatus.EXPLORING
    has_changed = not np.array_equal(places[:1], state.route.path[:1])
    return dataclasses.replace(
        state,
        status=status if len(places) else PlannerStatus.UNREACHABLE,
        route=Route(places, None if reaches_goal or not len(places) else np.vstack((places[-1], places[-1]))),
        progress=state.progress._replace(plan_count=state.progress.plan_count + has_changed),
    )
