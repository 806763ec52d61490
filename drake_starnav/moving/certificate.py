"""The braking certificate in time: a twist is sent only if the robot can stop before a dynamic obstacle can reach it.

Guarantee. With caution 1: if a command is accepted, and the robot keeps its last twist for a declared delay, follows
the command for one control period and then brakes as hard as its limits allow, then until no point of it moves no
dynamic obstacle touches its footprint, provided that
 (1) it is a disc no larger than `max_radius` and no faster than `max_speed`, whatever it did before,
 (2) it is visible, or occluded by something visible: nothing comes from outside the lidars' views or from nowhere, and
 (3) as for static obstacles, the robot follows its commands and the errors are at most the margin.
A place q at the time of the scan is taken to be anywhere within

    | p - q - (1 - c) u t | <= c g t        u its track's velocity, g = max_speed

a time t later, with the caution c. With c = 1 that is all directions. The places are

    hits of tracks                                trusted by 1 - c to continue with u
    hits neither tracked nor static               always with c = 1: there is no motion to trust
    hits on static objects that are small enough  with c = 1 only: they may start to move
    the edges of occluded areas                   with c = 1 only: something may come out

Obstacles that are declared to brake are left the room for it as well: the radius of each place is greater by their
stopping distance, so that whoever begins to brake in time never meets the robot, be it driving or standing
(passive-friendly safety).

A robot that is near to such a place already may move away: a motion that at no time comes nearer to any of them than
standing would is accepted with ESCAPE less of the margin.

Convex surfaces wider than 2 max_radius are static (`surfaces`). No certificate prevents an obstacle from hitting the
robot while it stands. A disc that turns about its centre stands; of polygons every point has to.
"""

import math
from typing import NamedTuple

import numpy as np

from drake_starnav.geometry.compiled import kernel
from drake_starnav.geometry.footprint import find_top_speed, measure_gap_to_disc
from drake_starnav.moving.kalman_tracks import Tracks
from drake_starnav.moving.parameters import DynamicObstacleParameters
from drake_starnav.moving.tracker import TrackedObstacles
from drake_starnav.robot.motion import Actuation, Motion
from drake_starnav.safety.certificates import Certificate
from drake_starnav.safety.clear import ClearanceCertificate
from drake_starnav.surroundings.surroundings import Surroundings

MOVING_MARGIN = 0.12
"""Clearance kept from obstacles that move, in cover radii of the robot."""
ESCAPE = 0.08
"""A motion that comes no nearer to them than standing would may use this much of that clearance: it makes way."""
STANDING_SPEED = 0.005
"""A command with which no point of the robot is faster counts as standing, m/s. The body does not follow exactly, so
this is well below `trajectory.STANDING`, which is about the body."""
X, Y, VX, VY, GROWTH, RADIUS = range(6)
"""Columns of the reachable discs."""
ANYWHERE = np.zeros(2)


class MovingCertificate(NamedTuple):
    """Accepts motions during which no moving obstacle can touch the robot while any point of it moves.

    Attributes:
        discs: shape (n, 6), as from `find_reachable_discs`.
        distance: that the footprint keeps from them, m.
        age: time since the scan that they are of, s.
        escape: by how much that distance may be less if standing still would keep no more clearance, m.
    """

    discs: np.ndarray
    distance: float
    age: float
    escape: float = 0.0

    @staticmethod
    def near(tracked_obstacles: TrackedObstacles, position: np.ndarray, actuation: Actuation) -> "MovingCertificate":
        """Return the certificate for the discs that may reach a robot at a place (2,), W, m, before it has stopped."""
        limits, footprint, obstacles = actuation.limits, actuation.footprint, tracked_obstacles.parameters
        braking = limits.max_speed / limits.max_deceleration
        if not (footprint.is_disc or limits.steers):
            braking = max(braking, limits.max_yaw_rate / limits.max_yaw_acceleration)
        longest = tracked_obstacles.age + actuation.delay + actuation.hold + braking
        margin, escape = MOVING_MARGIN * footprint.cover_radius, ESCAPE * footprint.cover_radius
        farthest_distance = footprint.radius + margin + (limits.max_speed + obstacles.max_speed) * longest
        discs = find_reachable_discs(tracked_obstacles.tracks, obstacles, position, farthest_distance)
        return MovingCertificate(discs, margin, tracked_obstacles.age, escape)

    def accepts(self, motion: Motion) -> bool:
        """Return whether the robot stands, or keeps its distance, wherever the discs go until it has stopped."""
        return _stays_clear(motion.samples, motion.braking, self, motion.footprint.body)


def make_certificates(
    surroundings: Surroundings,
    margin: float,
    actuation: Actuation,
    position: np.ndarray,
    tracked_obstacles: TrackedObstacles,
) -> tuple[Certificate, Certificate]:
    """Return the certificates among obstacles that move: against what stands still, and against what moves.

    Args:
        surroundings: what is known of the space around the robot.
        margin: kept to static obstacles, m.
        actuation: what commands do.
        position: of the robot, shape (2,), W, m.
        tracked_obstacles: the moving obstacles.
    """
    clear = ClearanceCertificate(surroundings, margin, actuation.footprint)
    return clear, MovingCertificate.near(tracked_obstacles, position, actuation)


def find_reachable_discs(
    tracks: Tracks, parameters: DynamicObstacleParameters, position: np.ndarray = ANYWHERE, reach: float = np.inf
) -> np.ndarray:
    """Return the `emergence_discs` that a braking robot must keep clear of, (n, 6), at the time of the tracks.

    Columns: position, m, velocity, m/s, growth of its radius, m/s, and radius, m, with the room to brake. Discs of
    trusted tracks come last.

    Args:
        tracks: of the last scan.
        parameters: what is declared.
        position, reach: only discs whose edge is within `reach` (m) of a place (2,).
    """
    (places, hit_track), caution, max_speed = tracks.emergence_discs, parameters.caution, parameters.max_speed
    is_trusted = np.append(tracks.is_trusted, False)[hit_track]  # the last one is of hits without a track, -1
    velocity = np.vstack((tracks.velocity, np.zeros(2)))[hit_track]
    radius = places[:, 2] + parameters.stopping_distance
    growth = np.where(is_trusted, caution * max_speed, max_speed)
    trusted_velocity = np.where(is_trusted[:, None], (1.0 - caution) * velocity, 0.0)
    is_near = np.hypot(places[:, 0] - position[0], places[:, 1] - position[1]) - radius < reach
    rows = np.concatenate((np.flatnonzero(is_near & ~is_trusted), np.flatnonzero(is_near & is_trusted)))
    return np.column_stack((places[:, :2], trusted_velocity, growth, radius))[rows]


@kernel
def _measure_clearance(sample, moving, time, body):
    """Return the least distance of a robot at a sample to where discs may have come at a time, less what it needs."""
    least_clearance, frame = np.inf, (sample[0], sample[1], math.cos(sample[2]), math.sin(sample[2]))
    for disc in moving.discs:
        x, y = disc[X] + disc[VX] * time, disc[Y] + disc[VY] * time
        least_clearance = measure_gap_to_disc(frame, body, x, y, disc[RADIUS] + disc[GROWTH] * time, least_clearance)
    return least_clearance - moving.distance


@kernel
def _stays_clear(samples, braking, moving, body):
    """Return whether a robot keeps clear of the discs of a `MovingCertificate` at all samples of a motion, as it moves.

    It must keep `distance`. It may keep up to `escape` less if, at that time, it is no nearer to the discs than a robot
    that stands at the first sample would be. Samples are skipped while the last clearance cannot have been used up.
    """
    fastest = spare = 0.0
    for disc in moving.discs:
        fastest = max(fastest, math.hypot(disc[VX], disc[VY]) + disc[GROWTH])
    speed_before = find_top_speed(samples[0, 3], samples[0, 4], body.lever)
    for k in range(1, len(samples)):
        last_sample, current_sample = samples[k - 1], samples[k]
        if not math.isfinite(current_sample[0] + current_sample[1] + current_sample[2]):
            return False
        spare -= math.hypot(current_sample[0] - last_sample[0], current_sample[1] - last_sample[1]) + body.lever * abs(
            current_sample[2] - last_sample[2]
        )
        spare -= fastest * (current_sample[5] - last_sample[5])
        top_speed = find_top_speed(current_sample[3], current_sample[4], body.lever)
        if spare <= 0.0:
            time = moving.age + current_sample[5]
            spare = _measure_clearance(current_sample, moving, time, body)
            if spare < 0.0 and max(top_speed, speed_before) >= STANDING_SPEED:
                standing_clearance = _measure_clearance(samples[0], moving, time, body)
                if spare < max(standing_clearance, -moving.escape):
                    return False
        if k >= braking and top_speed < STANDING_SPEED:
            return True
        speed_before = top_speed
    return True
