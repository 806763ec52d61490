"""Collision avoidance: a search over sequences of manoeuvres for the best way past obstacles that move.

A manoeuvre is held for MANOEUVRE_STEPS steps: follow the path, stop, keep the velocity, or drive in a direction as the
base does it, forwards or backwards: turning and then driving sideways is one manoeuvre. The first one must begin with a
twist that the certificates accept. Of each generation the BEAM_WIDTH best rollouts that differ are continued, up to the
horizon.

In a rollout the movers follow their predicted trajectories; static objects are assumed to stay. The robot stops at the
edge of known free space, and brakes as soon as the certificate in time would make it, also for static objects, which
might start: a rollout that the robot's own caution would cut short thus shows where it really ends. In seconds,

    cost = time passed + time to go + comfort lost + contact + risk + walls + change of the twist

Comfort is lost by the least predicted distance d to a mover at a time t: w (1 - d / COMFORT)_+^2 (1 - t / (2 HORIZON)).
Movers that a rollout has still to pass at its end count, too, by where they would be nearest if all went straight on:
who retreats only puts the encounter off. A contact at t ends a rollout and costs w (1 + 3 (1 - t / HORIZON)): a late
contact costs less, since predictions far ahead are uncertain.

Risk is what it costs to be where a mover may come that turns: robots that keep their distance only once it is predicted
to be short are struck while they stand. Per time it is the rate at which movers turn, times the share of directions in
which one would meet the robot, times w; it falls with the distance and vanishes where the mover is farther than it
drives in the time to escape. New directions at an angle from the old one are as likely as 1 + cos of it: movers rather
bend their course than turn back.
"""

import functools
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from drake_starnav.control.inputs import ControllerInputs
from drake_starnav.control.path_following import CREEP, compute_goal_slowdown
from drake_starnav.geometry.compiled import kernel, leaf
from drake_starnav.moving.certificate import MOVING_MARGIN, STANDING_SPEED
from drake_starnav.moving.driving_times import (
    compute_time_to_escape,
    compute_time_to_go,
    compute_times_along,
    find_next_way_point,
)
from drake_starnav.moving.modulation import modulate_around_movers
from drake_starnav.moving.prediction import HORIZON, PREDICTION_STEP
from drake_starnav.moving.tracker import TrackedObstacles
from drake_starnav.robot import Limits, RobotParameters
from drake_starnav.robot.base import convert_to_twist
from drake_starnav.robot.limits import Velocity, cap_speed, find_velocity_towards, limit_value, wrap_angle
from drake_starnav.robot.motion import Actuation, Pose, convert_to_velocity, integrate_step, ramp_velocity, roll_out
from drake_starnav.safety.certificates import Certificate, all_accept
from drake_starnav.surroundings.region_union import RegionUnion, covers, find_covering_region

MANOEUVRE_STEPS = 5
"""Steps of a rollout for which it drives a manoeuvre."""
STEP = 0.1
"""Time step of a rollout, s."""
BEAM_WIDTH = 16
"""Rollouts that are continued."""
HEADINGS = 8
"""Directions that are tried."""
SAME_PLACE, SAME_HEADING, SAME_SPEED = 0.6, 0.5, 0.375
"""Two rollouts count as one if their ends differ by less in place (radii of the robot), heading (rad) and speed."""
CHANGE_WEIGHT = 0.15
"""What a change of speed or turning rate by its whole range costs, s. No other way is searched while the path costs no
more comfort and risk than that."""
COMFORT = 0.4
"""Predicted distance from a moving obstacle below which the robot gives way, m: as persons like it, nature."""
STANDING_SPACING = 0.4
"""Hits on static objects that are nearer to each other than this, in radii of the robot, are treated as one."""
CONTACT_COST = 8.0
"""w, s."""
TURNING_RATE = 0.8
"""How often a mover turns to another direction, 0.2 a second, times 4, as a contact at once costs 4 w; 1/s."""
WALL_ZONE = 0.4
WALL_COST = 0.6
"""Cost of the least clearance to static obstacles, s, if less than the zone, in radii: walls leave no room to evade."""
ARRIVED_WITHIN = 0.48
"""A rollout this near to the end of the path has arrived, in radii of the robot."""

FOLLOW_PATH, KEEP_VELOCITY, DRIVE_IN_DIRECTION = range(3)
"""Kinds of manoeuvre."""
MANOEUVRE = np.dtype(
    [("kind", np.int64), *((name, np.float64) for name in ("speed", "heading", "ahead", "aside", "turning"))]
)
"""What the robot may do next: follow the path at a speed, keep a `Velocity`, or drive in a direction at a speed."""
DISC = np.dtype([(name, np.float64) for name in ("x", "y", "vx", "vy", "radius", "hazard")])
"""A mover at one time: its place and velocity in W, its radius, and how far it comes, if it turns to the robot, before
that has left; m and m/s."""
ROLLOUT = np.dtype(
    [
        *((name, np.float64) for name in ("x", "y", "yaw", "ahead", "aside", "turning")),
        *((name, np.int64) for name in ("first_manoeuvre", "way_point")),
        *((name, np.float64) for name in ("clearance", "least_clearance")),
        *((name, np.float64) for name in ("change_cost", "comfort_cost", "risk", "cost")),
        *((name, np.float64) for name in ("time", "arrival_time")),
        *((name, np.bool_) for name in ("is_over", "is_held")),
    ]
)
"""A rollout: pose and `Velocity` at its end; the manoeuvre it began with, and the way point ahead; clearance to static
obstacles, and the least so far, m; what its first change of velocity, lost comfort, risk and all of it costs, s; its
time, and that of arrival, s; whether it ended early, and whether what might start held the robot."""


class Movers(NamedTuple):
    """The obstacles that move or might start, as avoidance sees them.

    Attributes:
        position, velocity: shape (n, 2), of the n that are predicted, now, W, m and m/s.
        radius: shape (n,), m.
        trajectory: shape (n, k, 2), places every PREDICTION_STEP from the time of the scan on, W, m.
        may_start: shape (m, 2), places on static objects that might start to move, W, m.
        age: time since the scan, s.
        spacing: distance that the certificate keeps from them, m.
        caution: share of the declared speed that it allows for in all directions.
        max_speed: that is declared, m/s.
    """

    position: np.ndarray
    velocity: np.ndarray
    radius: np.ndarray
    trajectory: np.ndarray
    may_start: np.ndarray
    age: float
    spacing: float
    caution: float
    max_speed: float

    @staticmethod
    def near(tracked_obstacles: TrackedObstacles, position: np.ndarray, robot: RobotParameters) -> "Movers":
        """Return those that are tracked, and what might start within reach of a robot at a place (2,)."""
        tracks, parameters = tracked_obstacles.tracks, tracked_obstacles.parameters
        is_predicted, velocity = tracks.is_predicted, tracks.expected_velocity[tracks.is_predicted]
        farthest, spacing = HORIZON * robot.max_speed, STANDING_SPACING * robot.radius
        return Movers(
            position=tracks.position[is_predicted] + tracked_obstacles.age * velocity,
            velocity=velocity,
            radius=tracks.radius[is_predicted],
            trajectory=tracks.predicted_trajectories[is_predicted],
            may_start=thin_places(tracks.possible_starters[:, :2], position, farthest, spacing),
            age=float(tracked_obstacles.age),  # a whole number would have all compiled again
            spacing=float(MOVING_MARGIN * robot.shape.cover_radius + parameters.stopping_distance),
            caution=float(parameters.caution),
            max_speed=float(parameters.max_speed),
        )


class Scene(NamedTuple):
    """What the rollouts share.

    What loops call is handed only what it reads of it: Numba would count the references to all of it at each call,
    which takes a third of the time.

    Attributes:
        line: shape (n, 2), the robot's place and the way points, W, m.
        times_left: shape (n,), time from each way point to the end, as from `compute_times_along`, s.
        regions: of the roadmap.
        star: the certified star as a union of one region.
        hits: shape (k, 2), filtered hits close to the robot, W, m.
        movers: the obstacles that move or might start.
        limits: of the robot.
        radius: of the robot, m.
        slowdown: speed per distance to the goal, 1/s; infinite where the path ends at a frontier.
    """

    line: np.ndarray
    times_left: np.ndarray
    regions: RegionUnion
    star: RegionUnion
    hits: np.ndarray
    movers: Movers
    limits: Limits
    radius: float
    slowdown: float

    @staticmethod
    def of(inputs: ControllerInputs, tracked_obstacles: TrackedObstacles, robot: RobotParameters) -> "Scene":
        """Return the scene of what the controller is given."""
        path, limits = inputs.guidance.path, robot.limits
        line = np.vstack((inputs.pose[:2], path if len(path) else inputs.pose[:2]))
        return Scene(
            line=line,
            times_left=compute_times_along(line, limits),
            regions=inputs.guidance.regions,
            star=inputs.surroundings.certified_star.union,
            hits=inputs.surroundings.near_hits,
            movers=Movers.near(tracked_obstacles, inputs.pose[:2], robot),
            limits=limits,
            radius=float(robot.radius),
            slowdown=float(compute_goal_slowdown(limits) if inputs.guidance.arrives or not len(path) else np.inf),
        )


def avoid_collision(
    inputs: ControllerInputs,
    tracked_obstacles: TrackedObstacles,
    certificates: tuple[Certificate, ...],
    actuation: Actuation,
    robot: RobotParameters,
) -> np.ndarray | None:
    """Return the certified twist, of the base, with which the best sequence of manoeuvres past movers begins.

    None if following the path needs no avoidance, or if no manoeuvre is certified.

    Args:
        inputs: what the controller is given.
        tracked_obstacles: the moving obstacles.
        certificates: that the twist with which a manoeuvre begins must pass.
        actuation: what commands do.
        robot: its size and limits.
    """
    if not (tracked_obstacles.tracks.is_predicted.any() or len(tracked_obstacles.tracks.possible_starters)):
        return None
    pose, twist = inputs.pose, inputs.twist
    scene = Scene.of(inputs, tracked_obstacles, robot)
    start = make_initial_rollout(pose, twist, scene)
    if is_path_comfortable(start, list_manoeuvres(twist, robot.limits)[:1], scene):
        return None
    velocity_around = find_velocity_around(pose, inputs.guidance.path, scene, robot)
    manoeuvres = list_manoeuvres(twist, robot.limits, velocity_around)
    velocities, rollouts = begin_manoeuvres(manoeuvres, start, scene)
    twists = convert_to_twist(velocities, actuation.base)

    def is_accepted(first: np.ndarray) -> bool:
        return all_accept(roll_out(pose, twist, first, actuation), certificates)

    refuse_rollouts(rollouts, twists, scene, is_accepted)
    best_manoeuvre = search_rollouts(manoeuvres, rollouts, scene)
    return twists[best_manoeuvre] if best_manoeuvre >= 0 else None


def refuse_rollouts(
    rollouts: np.ndarray, twists: np.ndarray, scene: Scene, is_accepted: Callable[[np.ndarray], bool]
) -> None:
    """End rollouts (n,) that begin with twists (n, k) which are not accepted, and have them cost infinitely much.

    Only those that the search would continue, or that may be its result, are asked about.
    """
    accepts = functools.cache(lambda *twist: is_accepted(np.array(twist)))  # several manoeuvres begin alike
    refused_indices = [0]
    while refused_indices:
        results = np.flatnonzero(rollouts["is_over"] & (rollouts["cost"] < np.inf))
        candidates = [*select_best_rollouts(rollouts, scene), *results]
        refused_indices = [k for k in candidates if not accepts(*twists[k].tolist())]
        rollouts["is_over"][refused_indices], rollouts["cost"][refused_indices] = True, np.inf


def is_path_comfortable(start: np.ndarray, follow_path: np.ndarray, scene: Scene) -> bool:
    """Return whether following the path costs no more than a change of the twist would, and nothing holds the robot.

    Args:
        start: the rollout before its first step, shape (1,).
        follow_path: the manoeuvre, shape (1,).
        scene: what the rollouts share.
    """
    rollout, discs = start.copy(), predict_discs(scene, 0.0, round(HORIZON / STEP))
    continue_rollout(start[0], follow_path, discs, scene, rollout)
    last_rollout = rollout[0]
    return bool(last_rollout["comfort_cost"] + last_rollout["risk"] <= CHANGE_WEIGHT and not last_rollout["is_held"])


def list_manoeuvres(twist: np.ndarray, limits: Limits, velocity_around: np.ndarray | None = None) -> np.ndarray:
    """Return what the robot may do next, shape (n,) of `MANOEUVRE`.

    Args:
        twist: of the base, commanded last.
        limits: of the robot.
        velocity_around: a velocity that leads around movers, shape (2,), W, m/s.
    """
    max_speed = limits.max_speed
    rows = [(FOLLOW_PATH, share * max_speed, 0.0, 0.0, 0.0, 0.0) for share in (1.0, 0.5)]
    kept_velocities = (Velocity(0.0, 0.0, 0.0), convert_to_velocity(twist), Velocity(-0.5 * max_speed, 0.0, 0.0))
    rows += [(KEEP_VELOCITY, 0.0, 0.0, *velocity) for velocity in kept_velocities]
    for k in range(HEADINGS):
        heading = 2.0 * math.pi * k / HEADINGS
        rows += [(DRIVE_IN_DIRECTION, speed, heading, 0.0, 0.0, 0.0) for speed in (max_speed, -max_speed)]
    if velocity_around is not None:
        speed = min(math.hypot(*velocity_around), max_speed)
        heading = math.atan2(velocity_around[1], velocity_around[0])
        rows.append((DRIVE_IN_DIRECTION, speed, heading, 0.0, 0.0, 0.0))
    return np.array(rows, MANOEUVRE)


def find_velocity_around(pose: np.ndarray, path: np.ndarray, scene: Scene, robot: RobotParameters) -> np.ndarray | None:
    """Return the velocity towards the next way point, modulated around predicted movers; None without one."""
    if not len(path):
        return None
    path_vector = path[0] - pose[:2]
    velocity = robot.max_speed * path_vector / max(math.hypot(*path_vector), 1e-9)
    movers = scene.movers
    inflated_radii = movers.radius + robot.radius + movers.spacing
    modulated_velocity = modulate_around_movers(pose[:2], velocity, movers.position, movers.velocity, inflated_radii)
    return modulated_velocity if math.hypot(*modulated_velocity) > STANDING_SPEED else None


def make_initial_rollout(pose: np.ndarray, twist: np.ndarray, scene: Scene) -> np.ndarray:
    """Return the rollout before its first step, shape (1,) of `ROLLOUT`, for any base's twist."""
    rollout = np.zeros(1, ROLLOUT)
    rollout["x"], rollout["y"], rollout["yaw"] = pose
    rollout["ahead"], rollout["aside"], rollout["turning"] = convert_to_velocity(twist)
    rollout["way_point"], rollout["arrival_time"] = 1, np.inf
    rollout["clearance"] = rollout["least_clearance"] = measure_clearance(pose[0], pose[1], scene)
    return rollout


@kernel
def thin_places(places, position, farthest_distance, spacing):
    """Return the places (n, 2) within `farthest_distance` (m) of a position, no two nearer to each other than `spacing`
    (m)."""
    kept_places = np.empty((len(places), 2))
    n = 0
    for k in range(len(places)):
        x, y = places[k, 0], places[k, 1]
        is_apart = math.hypot(x - position[0], y - position[1]) < farthest_distance
        for q in range(n):
            is_apart = is_apart and (x - kept_places[q, 0]) ** 2 + (y - kept_places[q, 1]) ** 2 >= spacing**2
        if is_apart:
            kept_places[n, 0], kept_places[n, 1] = x, y
            n += 1
    return kept_places[:n]


@kernel
def predict_discs(scene, start_time, steps):
    """Return the movers at a time (s) and after each step from it, shape (steps + 1, n) of `DISC`."""
    trajectory, radius = scene.movers.trajectory, scene.movers.radius
    discs, last_sample = np.empty((steps + 1, len(radius)), DISC), trajectory.shape[1] - 1.001
    escape_time = [compute_time_to_escape(scene.radius + r, scene.limits) for r in radius]
    for s in range(steps + 1):
        sample = min((scene.movers.age + start_time) / PREDICTION_STEP, last_sample)
        i = int(sample)
        share = sample - i
        for j in range(len(radius)):
            disc, x, y = discs[s, j], trajectory[j, i, 0], trajectory[j, i, 1]
            dx, dy = trajectory[j, i + 1, 0] - x, trajectory[j, i + 1, 1] - y
            speed = math.hypot(dx, dy) / PREDICTION_STEP
            disc.x, disc.y, disc.radius = x + share * dx, y + share * dy, radius[j]
            disc.vx, disc.vy = dx / PREDICTION_STEP, dy / PREDICTION_STEP
            disc.hazard = speed * escape_time[j]
        start_time += STEP
    return discs


@kernel
def begin_manoeuvres(manoeuvres, start, scene):
    """Return the velocities (n, 3) with which manoeuvres begin, within the robot's limits, and their rollouts (n,)."""
    velocities, rollouts, limits = np.empty((len(manoeuvres), 3)), np.empty(len(manoeuvres), ROLLOUT), scene.limits
    rollout = start[0]
    continue_rollout(rollout, manoeuvres, predict_discs(scene, 0.0, MANOEUVRE_STEPS), scene, rollouts)
    for m in range(len(manoeuvres)):
        wanted_velocity = choose_velocity(manoeuvres[m], rollout, scene.line, limits, scene.radius, scene.slowdown)
        forward_speed = limit_value(wanted_velocity.v_x, limits.max_speed)
        sideways_speed = limit_value(wanted_velocity.v_y, limits.max_speed)
        turning_rate = limit_value(wanted_velocity.turning, limits.max_yaw_rate)
        velocities[m, 0], velocities[m, 1], velocities[m, 2] = forward_speed, sideways_speed, turning_rate
        velocity_change = math.hypot(forward_speed - rollout.ahead, sideways_speed - rollout.aside) / limits.max_speed
        velocity_change += abs(turning_rate - rollout.turning) / limits.max_yaw_rate
        rollouts[m].first_manoeuvre, rollouts[m].change_cost = m, CHANGE_WEIGHT * velocity_change
        rollouts[m].cost += CHANGE_WEIGHT * velocity_change
    return velocities, rollouts


@kernel
def search_rollouts(manoeuvres, rollouts, scene):
    """Return the index of the first manoeuvre of the best rollout that continues one of these (n,); -1: none does."""
    manoeuvre_count, segments = len(manoeuvres), int(math.ceil(HORIZON / (MANOEUVRE_STEPS * STEP) - 1e-9))
    best_manoeuvre, least_found = find_best_result(rollouts, False, -1, np.inf)
    for segment in range(2, segments + 1):
        generation, is_last_segment = rollouts, segment == segments
        continued_indices = select_best_rollouts(generation, scene)
        if not len(continued_indices):
            break
        discs = predict_discs(scene, generation[continued_indices[0]].time, MANOEUVRE_STEPS)
        rollouts = np.empty(len(continued_indices) * manoeuvre_count, ROLLOUT)
        for k in range(len(continued_indices)):
            continuations = rollouts[k * manoeuvre_count : (k + 1) * manoeuvre_count]
            continue_rollout(generation[continued_indices[k]], manoeuvres, discs, scene, continuations)
            best_manoeuvre, least_found = find_best_result(continuations, is_last_segment, best_manoeuvre, least_found)
    return best_manoeuvre


@leaf
def find_best_result(rollouts, is_last, best_manoeuvre, least_cost):
    """Return first manoeuvre and cost of the best rollout that ended, or reached the horizon, if any is better."""
    for m in range(len(rollouts)):
        if (is_last or rollouts[m].is_over) and rollouts[m].cost < least_cost:
            best_manoeuvre, least_cost = rollouts[m].first_manoeuvre, rollouts[m].cost
    return best_manoeuvre, least_cost


@kernel
def select_best_rollouts(rollouts, scene):
    """Return the indices of the BEAM_WIDTH best rollouts that have not ended and do not count as one, best first."""
    same_place, same_speed = SAME_PLACE * scene.radius, SAME_SPEED * scene.limits.max_speed
    kept_indices = np.empty(BEAM_WIDTH, np.int64)
    n = 0
    rollout_costs = np.array([rollout.cost for rollout in rollouts])
    for i in np.argsort(rollout_costs, kind="mergesort"):
        rollout = rollouts[i]
        if rollout.is_over:
            continue
        for q in range(n):
            kept_rollout = rollouts[kept_indices[q]]
            if (
                (rollout.x - kept_rollout.x) ** 2 + (rollout.y - kept_rollout.y) ** 2 < same_place * same_place
                and abs(wrap_angle(rollout.yaw - kept_rollout.yaw)) < SAME_HEADING
                and math.hypot(rollout.ahead - kept_rollout.ahead, rollout.aside - kept_rollout.aside) < same_speed
            ):
                break
        else:
            kept_indices[n] = i
            n += 1
        if n == BEAM_WIDTH:
            break
    return kept_indices[:n]


@kernel
def continue_rollout(start, manoeuvres, discs, scene, rollouts):
    """Simulate each manoeuvre (n,) from `start` on, over the steps of `discs`, into `rollouts` (n,).

    A rollout ends early if the robot is touched or reaches a frontier.
    """
    line, limits, radius, slowdown = scene.line, scene.limits, scene.radius, scene.slowdown
    for m in range(len(manoeuvres)):
        rollouts[m] = start
        rollout = rollouts[m]
        for s in range(len(discs) - 1):
            if rollout.is_over:
                break
            wanted_velocity = choose_velocity(manoeuvres[m], rollout, line, limits, radius, slowdown)
            if must_brake(rollout, discs, s, scene.movers, limits, radius):
                wanted_velocity = Velocity(0.0, 0.0, wanted_velocity.turning)
            drive_step(rollout, wanted_velocity, scene)
            add_nearness(rollout, discs, s + 1, radius)
            note_arrival(rollout, line, radius, slowdown)
        rollout.cost = compute_total_cost(rollout, discs, scene)


@leaf
def drive_step(rollout, wanted_velocity, scene):
    """Drive a rollout for a step towards a `Velocity`.

    It stays where it is if the step leads out of known free space, unless away from hits.
    """
    star, limits = scene.star, scene.limits
    velocity, mean_velocity = ramp_velocity(read_end_velocity(rollout), wanted_velocity, STEP, limits)
    pose = integrate_step(Pose(rollout.x, rollout.y, rollout.yaw), mean_velocity, STEP, limits)
    rollout.yaw, rollout.turning = pose.yaw, velocity.turning
    rollout.ahead, rollout.aside = velocity.v_x, velocity.v_y
    is_free = covers(star.center, star.bearing_0, star.values, np.int64(0), pose.x, pose.y, 0.0)
    is_free = is_free or find_covering_region(scene.regions, pose.x, pose.y, 0.0) >= 0
    clearance = measure_clearance(pose.x, pose.y, scene)
    if is_free or clearance > rollout.clearance:
        rollout.x, rollout.y, rollout.clearance = pose.x, pose.y, clearance
        rollout.least_clearance = min(rollout.least_clearance, clearance)
        rollout.way_point = find_next_way_point(scene.line, rollout.way_point, pose.x, pose.y, scene.radius)
    else:
        rollout.ahead = rollout.aside = 0.0
    rollout.time += STEP


@leaf
def note_arrival(rollout, line, radius, slowdown):
    """Note when a rollout has first been at the end of the path; there it is over if that is a frontier."""
    dx, dy = line[-1, 0] - rollout.x, line[-1, 1] - rollout.y
    is_near = dx * dx + dy * dy < (ARRIVED_WITHIN * radius) * (ARRIVED_WITHIN * radius)
    if is_near and not rollout.is_over and rollout.way_point == len(line) - 1:
        rollout.arrival_time = min(rollout.arrival_time, rollout.time)
        rollout.is_over = slowdown == np.inf  # where exploration continues


@leaf
def compute_total_cost(rollout, discs, scene):
    """Return what a rollout costs, s."""
    line, limits, radius = scene.line, scene.limits, scene.radius
    comfort_cost, time = rollout.comfort_cost, rollout.arrival_time
    if time == np.inf:  # else it has been at the goal, wherever it goes to make way
        comfort_cost = max(comfort_cost, compute_comfort_to_go(rollout, discs, scene))
        pose, velocity = Pose(rollout.x, rollout.y, rollout.yaw), read_end_velocity(rollout)
        time = rollout.time + compute_time_to_go(line, scene.times_left, rollout.way_point, pose, velocity, limits)
    wall_cost = WALL_COST * (1.0 - rollout.least_clearance / (WALL_ZONE * radius)) ** 2
    return comfort_cost + rollout.risk + wall_cost + time + rollout.change_cost


@leaf
def read_end_velocity(rollout):
    """Return the `Velocity` at the end of a rollout."""
    return Velocity(rollout.ahead, rollout.aside, rollout.turning)


@leaf
def choose_velocity(manoeuvre, rollout, line, limits, radius, slowdown):
    """Return the `Velocity` that a manoeuvre wants at the end of a rollout."""
    speed, k = manoeuvre.speed, rollout.way_point
    if manoeuvre.kind == KEEP_VELOCITY:
        return Velocity(manoeuvre.ahead, manoeuvre.aside, manoeuvre.turning)
    if manoeuvre.kind == DRIVE_IN_DIRECTION:
        course = manoeuvre.heading if speed > 0.0 else manoeuvre.heading + math.pi
        return find_velocity_towards(wrap_angle(course - rollout.yaw), speed, limits)
    dx, dy = line[k, 0] - rollout.x, line[k, 1] - rollout.y
    is_last, arrival_distance = k == len(line) - 1, ARRIVED_WITHIN * radius
    if dx * dx + dy * dy < (arrival_distance * arrival_distance if is_last else 1e-12):
        return Velocity(0.0, 0.0, 0.0)
    wanted_velocity = find_velocity_towards(wrap_angle(math.atan2(dy, dx) - rollout.yaw), speed, limits)
    if is_last:
        wanted_velocity = cap_speed(wanted_velocity, slowdown * math.hypot(dx, dy) + limits.max_speed / CREEP)
    return wanted_velocity


@leaf
def must_brake(rollout, discs, s, movers, limits, radius):
    """Return whether a robot that brakes fully might be touched before it stops, by discs as predicted at step s.

    Or, from the next step on, by what might start; that is noted as `is_held`. Checked at half the braking time and at
    its end, for all discs, whether it approaches them or not: a robot that only watches those ahead is soon surrounded.
    """
    robot_speed, driving_direction = rollout.ahead, rollout.yaw
    starters, caution = movers.may_start, movers.caution
    if rollout.aside != 0.0:
        robot_speed = math.hypot(rollout.ahead, rollout.aside)
        driving_direction += math.atan2(rollout.aside, rollout.ahead)
    if abs(robot_speed) < STANDING_SPEED:
        return False
    braking, mover_speed = math.copysign(limits.max_deceleration, robot_speed), movers.max_speed
    stopping_time, needed_distance = abs(robot_speed) / limits.max_deceleration, radius + movers.spacing
    cosine, sine = math.cos(driving_direction), math.sin(driving_direction)
    for share in (0.5, 1.0):
        t = share * stopping_time
        way = robot_speed * (t + STEP) - 0.5 * braking * t * t
        x, y = rollout.x + way * cosine, rollout.y + way * sine
        reach_distance = needed_distance + mover_speed * (t + STEP)
        for j in range(len(starters)):
            if (x - starters[j, 0]) ** 2 + (y - starters[j, 1]) ** 2 < reach_distance * reach_distance:
                rollout.is_held = True
                return True
    needed_distance += MOVING_MARGIN * radius  # twice the margin: tracks err more than hits
    for j in range(discs.shape[1]):
        disc = discs[s, j]
        for share in (0.5, 1.0):
            t = share * stopping_time
            way = robot_speed * t - 0.5 * braking * t * t
            dx = rollout.x + way * cosine - disc.x - (1.0 - caution) * disc.vx * t
            dy = rollout.y + way * sine - disc.y - (1.0 - caution) * disc.vy * t
            reach_distance = needed_distance + disc.radius + caution * mover_speed * t
            if dx * dx + dy * dy < reach_distance * reach_distance:
                return True
    return False


@leaf
def add_nearness(rollout, discs, s, radius):
    """Add to a rollout what its place costs among the discs of step s: comfort, contact and risk."""
    certainty = 1.0 - 0.5 * rollout.time / HORIZON
    least_gap, risk = COMFORT, 0.0
    for j in range(discs.shape[1]):
        disc = discs[s, j]
        dx, dy, radius_sum = rollout.x - disc.x, rollout.y - disc.y, radius + disc.radius
        squared_distance, reach_distance = dx * dx + dy * dy, radius_sum + max(COMFORT, disc.hazard)
        if squared_distance > reach_distance * reach_distance:
            continue
        distance = math.sqrt(squared_distance)
        gap = distance - radius_sum
        least_gap = min(least_gap, gap)
        if gap < disc.hazard:
            share_of_directions = math.asin(min(radius_sum / max(distance, radius_sum), 1.0)) / math.pi
            approach = (disc.vx * dx + disc.vy * dy) / max(math.hypot(disc.vx, disc.vy) * distance, 1e-9)
            risk += (1.0 + approach) * share_of_directions * min(1.0 - gap / disc.hazard, 1.0)
    rollout.risk += certainty * CONTACT_COST * TURNING_RATE * risk * STEP
    if least_gap < COMFORT:
        lost_share = 1.0 - max(least_gap, 0.0) / COMFORT
        rollout.comfort_cost = max(rollout.comfort_cost, CONTACT_COST * lost_share**2 * certainty)
    if least_gap < 0.0:  # it is touched
        rollout.is_over = True
        rollout.comfort_cost = CONTACT_COST * (1.0 + 3.0 * (1.0 - rollout.time / HORIZON))


@leaf
def compute_comfort_to_go(rollout, discs, scene):
    """Return the comfort lost to movers that the end of a rollout leaves to be passed on the way to its way point, s.

    As if robot and movers went straight on, the robot at full speed.
    """
    speed, comfort_cost, last_step, k = scene.limits.max_speed, 0.0, len(discs) - 1, rollout.way_point
    x, y = scene.line[k, 0] - rollout.x, scene.line[k, 1] - rollout.y
    way_length = max(math.hypot(x, y), 1e-9)
    for j in range(discs.shape[1]):
        disc = discs[last_step, j]
        dx, dy = rollout.x - disc.x, rollout.y - disc.y
        vx, vy = speed * x / way_length - disc.vx, speed * y / way_length - disc.vy
        closest_time = -(dx * vx + dy * vy) / max(vx * vx + vy * vy, 1e-9)  # of the closest approach
        closest_time = min(max(closest_time, 0.0), way_length / speed)
        distance = math.hypot(dx + closest_time * vx, dy + closest_time * vy)
        lost_share = max(1.0 - distance / (scene.radius + disc.radius + COMFORT), 0.0)
        certainty = max(1.0 - 0.5 * (rollout.time + closest_time) / HORIZON, 0.0)
        comfort_cost = max(comfort_cost, CONTACT_COST * lost_share * lost_share * certainty)
    return comfort_cost


@leaf
def measure_clearance(x, y, scene):
    """Return the clearance of a robot at (x, y) to the nearest hit, m, at most that of the zone near walls."""
    reach = (1.0 + WALL_ZONE) * scene.radius
    nearest = reach * reach
    for q in range(len(scene.hits)):
        dx, dy = x - scene.hits[q, 0], y - scene.hits[q, 1]
        nearest = min(nearest, dx * dx + dy * dy)
    return max(min(math.sqrt(nearest), reach) - scene.radius, 0.0)
