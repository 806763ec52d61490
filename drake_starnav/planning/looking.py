"""A robot whose lidars do not see all around turns to look. Merged scans have lost beams where no lidar looks."""

import math

import numpy as np

from drake_starnav.planning.guidance import Guidance
from drake_starnav.planning.state import PlannerInput, PlannerState
from drake_starnav.surroundings.region_union import cover_at
from drake_starnav.surroundings.star_region import StarRegion
from drake_starnav.utils.snapshot import replaced

FACING = math.radians(30.0)
"""A robot faces a place that lies within this angle of its heading, rad."""
LOOKS_AFTER = 0.5
STILL_TURNS = 1.0
"""A robot that stands or faces its path for the first time without progress, s, or for the second while it still turns
to a free heading, looks at what it has not seen beside it."""
UNSEEN_WITHIN = 2.0
"""That is what is no farther than this, in radii of the disc that it covers when it turns."""
BEGINS_WITHIN = 0.1
"""No farther from where it began, in its radii, the robot has not left."""
LOOKED = 0.1
"""What a robot that heads for it within this angle does not see is hidden, rad."""


def faces(inputs: PlannerInput, place: np.ndarray) -> bool:
    """Whether the robot faces a place (2,) in W."""
    (x, y), (at_x, at_y, yaw) = place.tolist(), inputs.observation.pose.tolist()
    return math.cos(math.atan2(y - at_y, x - at_x) - yaw) > math.cos(FACING)


def is_turning(state: PlannerState) -> bool:
    """Whether the robot has turned between the last two scans, faster than by LOOKED in LOOKS_AFTER."""
    if len(state.recent) < 2:
        return False
    before, latest = state.recent[-2:]
    turned = abs(math.remainder(float(latest.pose[2] - before.pose[2]), 2.0 * math.pi))
    return turned * LOOKS_AFTER > LOOKED * (latest.time - before.time)


def sees_all_around(inputs: PlannerInput) -> bool:
    """Whether a single lidar on the robot's axis looks in all directions."""
    scan = inputs.observation.scan
    return scan.full_circle and not scan.merged


def turned_to_look(state: PlannerState, here: StarRegion, inputs: PlannerInput) -> bool:
    """Whether a lidar that does not look all around sees the probe since the robot has turned."""
    nodes, (pose, scan) = state.roadmap.nodes, (inputs.observation.pose, inputs.observation.scan)
    if not scan.merged or state.target is None or not len(nodes):
        return False
    turned = abs(math.remainder(float(pose[2] - nodes[-1].pose[2]), 2.0 * math.pi)) > FACING
    return turned and cover_at(here.as_union, *state.target[1], 0.0) >= 0


def looking_aside(state: PlannerState, inputs: PlannerInput) -> PlannerState:
    """The state with guidance to turn, where lidars have not seen all around.

    One that is no disc may turn where it begins, and faces its path before it leaves. Later a robot looks at what is
    beside the path if it stands before it. A lone lidar on the axis is turned until it faces a path of which it sees
    nothing; most bases turn so by themselves.
    """
    scan, pose = inputs.observation.scan, inputs.observation.pose
    looking, turning = state.aside is not None and len(state.aside.poses) > 0, is_turning(state)
    if state.aside is not None:
        state = replaced(state, aside=None)
    if sees_all_around(inputs) or not len(state.path):
        return state
    x, y, yaw = pose.tolist()
    ahead = math.atan2(state.path[0, 1] - y, state.path[0, 0] - x) - yaw
    beside = np.mod(scan.bearings - ahead + math.pi, 2.0 * math.pi) - math.pi
    if not scan.merged:
        blind = inputs.time - state.progress_time > LOOKS_AFTER and np.abs(beside).min() > scan.angle_increment
        if not blind and (not looking or faces(inputs, state.path[0])):
            return state
        return replaced(state, aside=_turn(state, x, y, yaw + ahead))
    near = scan.lost & (scan.distances < UNSEEN_WITHIN * inputs.swept_radius)
    unseen = np.flatnonzero(near & (np.abs(beside) <= 0.5 * math.pi))
    begun, spot = state.roadmap.nodes[0], BEGINS_WITHIN * inputs.robot_radius
    patient = inputs.time - begun.time < inputs.parameters.progress_timeout
    turns = inputs.body is not None and inputs.body.base.turns_on_the_spot
    if patient and turns and math.dist(begun.pose[:2], (x, y)) < spot and math.cos(ahead) < math.cos(LOOKED):
        return replaced(state, facing_time=inputs.time, aside=_turn(state, x, y, yaw + ahead))
    patience = STILL_TURNS if turning and not looking else LOOKS_AFTER
    waits = inputs.time - state.facing_time > patience and len(unseen) > 0
    if state.progress_time == inputs.time or not (waits or not turning or faces(inputs, state.path[0])):
        return replaced(state, facing_time=inputs.time)
    if not waits:
        return state
    aim = float(scan.bearings[unseen[np.abs(beside[unseen]).argmax()]])
    if abs(aim) < LOOKED:  # and it is hidden from there, too
        return replaced(state, facing_time=inputs.time)
    return replaced(state, aside=_turn(state, x, y, yaw + aim))


def _turn(state: PlannerState, x: float, y: float, yaw: float) -> Guidance:
    """Guidance to turn on the spot."""
    return Guidance(state.path, False, state.roadmap.union, np.array(((x, y, yaw, 0.0),)))
