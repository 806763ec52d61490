"""The result of a run: its outcome, its metrics, and how they are written."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from drake_starnav.geometry.footprint import Footprint, as_footprint
from drake_starnav.geometry.trajectory import Motion, compute_motion_metrics, sample_evenly, select_samples
from drake_starnav.scenario.margins import derive_margins
from drake_starnav.scenario.schema import Scenario
from drake_starnav.station.monitors import COLLISION, describe_contact, find_contact
from drake_starnav.systems.goal_sequence import HEADING_TOLERANCE
from drake_starnav.systems.star_roadmap_planner import NO_WAY, STANDSTILL
from drake_starnav.worlds.moving_obstacles import compute_moving_obstacle_clearance
from drake_starnav.worlds.solvable import find_leg, make_poses
from drake_starnav.worlds.view import find_tightest_gap
from drake_starnav.worlds.world import World

INTERRUPTED = "interrupted"
"""The outcome of a trial that was ended by Ctrl-C, as its files have it."""
TIMEOUT = "timeout"
NEVER_MOVED = 0.05
"""A robot that has driven less than this, m, in more than STANDSTILL s has never moved: it turned, or was pushed."""
METRICS_PERIOD = 0.01
"""Metrics of the motion are of states at equal steps of this length, s, interpolated between the logged ones."""
PATH_TOLERANCE = 0.02
"""Largest deviation of the path in a trial's record from the driven one, m."""

Goals = Sequence[tuple[float, ...]]
"""Goals (x, y) or (x, y, yaw), as `Scenario.goals`."""


@dataclass(frozen=True)
class Trial:
    """The result of one run; the field names are those of its JSON form.

    Attributes:
        outcome: reached, collision, struck (by a moving obstacle, while no point of it moved), unreachable, blocked
            (out of time while the robot stood still, or had never moved), timeout or, instead of these three, occupied
            (in the end a moving obstacle covered all places within the goal's tolerance).
        contact: the bodies that touched, the robot's first: `base_link with crate`; None without a contact.
        blocked_s: when the planner first reported that the robot stood still, to a second, or gave up; None if it
            never did.
        blocked_by: why, as its port `blocked_by` said then.
        goals_s: when each of the scenario's goals was reached, in order, s, or the only one, the world's.
        time_s: simulated time until the outcome.
        path_length_m: driven by the robot's centre.
        shortest_path_m: shortest path of the same radius given the full map, from goal to goal among the static
            obstacles; None if there is none, or a model file's obstacles move. Of a robot that is no disc it is that of
            the disc around it; where that has no way, but the robot has, that of the largest disc inside it.
        straight_line_m: from the start to the goal, by way of the others.
        tightest_gap_m: least width of the free space along the shortest path; None where nothing narrows it.
        score: of the benchmark that the world is from, 0 to 0.5; None for other worlds. See `compute_benchmark_score`.
        min_clearance_m: least distance of the footprint to an obstacle, except the moving ones of a model file;
            negative in a collision.
        mean_speed_mps: path length over time.
        mean_clearance_m, jerk_mps3, yaw_rate_change_radps2, twist_energy_m2ps, stops, stuck_s: see `MotionMetrics`.
        nodes: in the roadmap at the end; 0 without one.
        wall_s: wall-clock time of the simulation.
        state_hash: SHA-256 of the logged plant state.
        command, scan, plan: `count, mean_s, p50_s, p99_s` of the wall-clock time of each step.
        path: places (x, y) where the robot's centre was, m, W, at the times of `path_s`; interpolated between them, it
            is off by up to `PATH_TOLERANCE` at any time.
        path_s: when it was there, s.
    """

    scenario: str
    method: str
    seed: int
    outcome: str
    contact: str | None
    blocked_s: float | None
    blocked_by: str | None
    goals_s: list[float]
    time_s: float
    path_length_m: float
    shortest_path_m: float | None
    straight_line_m: float
    tightest_gap_m: float | None
    score: float | None
    min_clearance_m: float
    mean_speed_mps: float
    mean_clearance_m: float
    jerk_mps3: float
    yaw_rate_change_radps2: float
    twist_energy_m2ps: float
    stops: int
    stuck_s: float
    nodes: int
    wall_s: float
    state_hash: str
    command: dict[str, float]
    scan: dict[str, float]
    plan: dict[str, float]
    path: list[list[float]]
    path_s: list[float]


@dataclass(frozen=True)
class Run:
    """What a simulation leaves.

    Attributes:
        elapsed: when it ended, s.
        times: of the states, shape (n,), s: the ends of the simulator's steps.
        driven: shape (n, 5): x, y, yaw, v, omega at these times.
        state_hash: of the logged plant states.
        standing_clearances, clearances: of the footprint at these times, from what stands, and from what stands or
            moves; each of shape (n,), m.
        nodes: in the roadmap.
        steps: wall-clock times of `STEPS`, as of `Stopwatch.summarize`.
        goals: when each of several goals was reached, s.
        message: why it ended.
        wall: wall-clock time, s.
        blocked: from when on, s, which reason was reported for a robot that stood still; an empty one when it moved on.
    """

    elapsed: float
    times: np.ndarray
    driven: np.ndarray
    standing_clearances: np.ndarray
    clearances: np.ndarray
    state_hash: str = ""
    nodes: int = 0
    steps: dict[str, Any] = field(default_factory=dict)
    goals: tuple[float, ...] = ()
    message: str = ""
    wall: float = 0.0
    blocked: tuple[tuple[float, str], ...] = ()

    @property
    def motion(self) -> Motion:
        """Where the robot was at which time."""
        return Motion(self.times, self.driven[:, :3])


class Task(NamedTuple):
    """What a trial is about.

    Attributes:
        name, method, seed: as the trial's record has them.
        scenario: of the robot.
        world: with the robot's start, and its last goal.
        shortest_path: as of `find_omniscient_path`.
    """

    name: str
    method: str
    seed: int
    scenario: Scenario
    world: World
    shortest_path: tuple[float, np.ndarray] | None

    @staticmethod
    def of(name: str, method: str, seed: int, scenario: Scenario, world: World) -> "Task":
        """The task in a world; a `StarnavError` where that is too large to find the shortest path."""
        path = find_omniscient_path(world, scenario.robot.shape, scenario.goals)
        return Task(name, method, seed, scenario, world, path)


def make_trial(task: Task, run: Run) -> Trial:
    """The trial of a run: its outcome, and what follows from where the robot drove."""
    path = run.driven[:, :2]
    length = float(np.hypot(*np.diff(path.T, axis=1)).sum())
    outcome = _find_outcome(task, run, length)
    blocked_s, blocked_by = run.blocked[-1 if outcome == "unreachable" else 0] if run.blocked else (None, None)
    kept_samples = select_samples(run.times, path, PATH_TOLERANCE)
    return Trial(
        scenario=task.name,
        method=task.method,
        seed=task.seed,
        outcome=outcome,
        contact=find_contact(run.message),
        blocked_s=blocked_s,
        blocked_by=blocked_by,
        goals_s=[round(time, 6) for time in run.goals or [run.elapsed] * (outcome == "reached")],
        time_s=round(run.elapsed, 6),
        path_length_m=length,
        **_describe_task(task),
        score=compute_benchmark_score(outcome, run.elapsed, task.world.optimal_time),
        min_clearance_m=float(run.clearances.min()),
        mean_speed_mps=length / run.elapsed if run.elapsed > 0.0 else 0.0,
        **_measure_motion(run, task.scenario.robot.shape),
        nodes=run.nodes,
        wall_s=run.wall,
        state_hash=run.state_hash,
        **run.steps,
        path=path[kept_samples].round(3).tolist(),
        path_s=run.times[kept_samples].round(3).tolist(),
    )


def _measure_motion(run: Run, shape: Footprint) -> dict[str, Any]:
    """The fields of `MotionMetrics`, of states at equal steps."""
    samples = sample_evenly(run.times, np.column_stack((run.driven, run.clearances)), METRICS_PERIOD)
    places, speeds, gaps = samples[:, :2], samples[:, 3:5], samples[:, 5]
    return vars(compute_motion_metrics(places, speeds, gaps, time_step=METRICS_PERIOD, footprint=shape))


def _find_outcome(task: Task, run: Run, length: float) -> str:
    """How a run over a path of a length, m, ended, see `Trial`."""
    outcome = COLLISION if run.standing_clearances.min() < 0.0 else run.message.split()[0]
    stood_still = length < NEVER_MOVED and run.elapsed > STANDSTILL
    if outcome == TIMEOUT and (stood_still or (run.blocked and run.blocked[-1][1])):
        outcome = "blocked"
    if outcome in (TIMEOUT, "blocked", "unreachable") and is_goal_occupied(task.world, run, task.scenario):
        outcome = "occupied"
    return outcome


def _describe_task(task: Task) -> dict[str, Any]:
    """Those fields of a `Trial` that do not depend on how the robot drove."""
    world, goals = task.world, task.scenario.goals or (task.world.goal,)
    legs = itertools.pairwise([world.start[:2], *(goal[:2] for goal in goals)])
    length, path = task.shortest_path or (None, None)
    return {
        "shortest_path_m": None if length is None else float(length),
        "straight_line_m": sum(math.dist(*leg) for leg in legs),
        "tightest_gap_m": None if path is None else _replace_infinite(find_tightest_gap(world, path)),
    }


def is_goal_occupied(world: World, run: Run, scenario: Scenario) -> bool:
    """Whether at the end a moving obstacle leaves the footprint no place within the tolerance of the goal it drives to.

    The certificate keeps the safety margin beyond the footprint, at the goal's heading, or at any where it has none.
    """
    goals = scenario.goals or [world.goal]
    footprint = scenario.robot.shape
    goal = goals[min(len(run.goals), len(goals) - 1)]
    poses = make_poses(goal, footprint)
    heading_step = HEADING_TOLERANCE if len(goal) > 2 else math.pi / len(poses)
    free_distance = compute_moving_obstacle_clearance(
        world.moving_obstacles, poses, np.full(len(poses), run.elapsed), footprint
    ).max()
    goal_slack = scenario.simulation.goal_tolerance + heading_step * footprint.lever
    return bool(free_distance + goal_slack < derive_margins(scenario).safety)


def compute_benchmark_score(outcome: str, trial_time: float, optimal_time: float | None) -> float | None:
    """OT / clip(AT, 2 OT, 8 OT) of a trial that reached the goal, 0 of another one; None without an optimal time.

    `time` is AT, until the outcome, and `optimal_time` OT of the world, s.

    Source: the BARN challenge since 2024; in 2022 the lower bound was 4 OT, and the largest score 0.25.
    """
    if optimal_time is None:
        return None
    return optimal_time / min(max(trial_time, 2.0 * optimal_time), 8.0 * optimal_time) if outcome == "reached" else 0.0


def make_caption_lines(trial: Trial) -> tuple[str, ...]:
    """The caption of a trial's picture."""
    reason = trial.blocked_by or ""
    barred_text = reason if reason.startswith(NO_WAY) else "found no way"
    outcome_texts = {"reached": f"reached in {trial.time_s:.1f}\u00a0s", "unreachable": barred_text}
    outcome_name = trial.outcome if trial.contact is None else describe_contact(trial.outcome, trial.contact)
    outcome = outcome_texts.get(trial.outcome, f"{outcome_name} after {trial.time_s:.1f}\u00a0s")
    return f"method {trial.method}, seed {trial.seed}", outcome


def find_omniscient_path(world: World, robot: Footprint | float, goals: Goals = ()) -> tuple[float, np.ndarray] | None:
    """The shortest path of a footprint, or a radius, m, given the full map, to a scenario's goals or else the world's.

    As `find_way_through`, 5 mm beyond the radius, on a grid of 2 cm, in a world of more than 5 million cells up to
    5 cm: it may miss passages with less than 2 to 4 cm to spare. None also where obstacles move.
    """
    if world.model is not None and world.model.moving:
        return None
    x0, y0, x1, y1 = world.extent
    resolution = min(max(math.sqrt((x1 - x0) * (y1 - y0) / 5e6), 0.02), 0.05)
    places = [world.start, *(goals or (world.goal,))]
    legs = list(itertools.pairwise(places))
    found_paths = (find_leg(world, as_footprint(robot), *leg, 0.005, resolution) for leg in legs)
    free_legs = [way for way in found_paths if way is not None]
    if len(free_legs) < len(legs):
        return None
    return sum(length for length, _ in free_legs), np.vstack([path for _, path in free_legs])


def make_trial_record(trial: Trial) -> dict[str, Any]:
    """The trial as a JSON-compatible mapping; an infinite clearance (nothing to hit) is null."""
    clearances = {name: _replace_infinite(getattr(trial, name)) for name in ("min_clearance_m", "mean_clearance_m")}
    return {**vars(trial), **clearances}


def _replace_infinite(value: float) -> float | None:
    """The value, or None for an infinite one, which JSON cannot represent."""
    return value if math.isfinite(value) else None
