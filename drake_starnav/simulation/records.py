"""A run of one robot or of several: its record as JSON, and its recording, also of several methods in one scene."""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydrake.systems.framework import DiagramBuilder

from drake_starnav.errors import counted
from drake_starnav.geometry.trajectory import Motion
from drake_starnav.navigation import Navigation
from drake_starnav.navigation.robot import robot_world
from drake_starnav.scenario.schema import Scenario
from drake_starnav.simulation.robots import RobotTrial, make_worlds_of_robots, run_robots
from drake_starnav.simulation.run import run_trial
from drake_starnav.simulation.trial import make_caption_lines, make_trial_record

if TYPE_CHECKING:
    from drake_starnav.visualization.timeline import RecordedRun

DECIDES = "collision", "struck", "unreachable", "blocked", "occupied", "timeout"
"""Outcomes of which the first that any robot has is that of all."""


def make_driven_record(
    scenario: Scenario,
    *,
    method: str | None = None,
    seed: int = 0,
    html: Path | None = None,
    progress: Callable[[float, float], None] | None = None,
) -> dict[str, Any]:
    """Run a scenario of one robot or of several, and return its record; arguments and errors as in `run_trial`."""
    if not scenario.robots:
        return make_trial_record(run_trial(scenario, method=method, seed=seed, html=html, progress=progress))
    trials = run_robots(scenario, method=method, seed=seed, progress=progress)
    if html is not None:
        record_robots(scenario, trials, seed, html)
    return make_robots_record(trials)


def make_robots_record(trials: Sequence[RobotTrial]) -> dict[str, Any]:
    """The trials of several robots as one JSON-compatible mapping.

    Its figures are those of the robot that decides: the last one to arrive, or one that did not. `min_gap_m` is the
    least of all, `state_hash` is of all, and `robots` holds the record of each.
    """
    each = [{"robot": robot.robot, "min_gap_m": robot.min_gap_m, **make_trial_record(robot.trial)} for robot in trials]
    outcome_ranks = {outcome: number for number, outcome in enumerate(reversed(DECIDES), start=1)}
    decides = max(trials, key=lambda robot: (outcome_ranks.get(robot.trial.outcome, 0), robot.trial.time_s)).trial
    state_hashes = hashlib.sha256("".join(robot.trial.state_hash for robot in trials).encode()).hexdigest()
    least_gap = min(robot.min_gap_m for robot in trials)
    return {**make_trial_record(decides), "min_gap_m": least_gap, "state_hash": state_hashes, "robots": each}


def record_robots(
    scenario: Scenario,
    trials: Sequence[RobotTrial],
    seed: int,
    html: Path,
    *,
    view: str = "top",
    shown: frozenset[str] | None = None,
) -> "RecordedRun":
    """Record the robots of one scenario, which drove together, in one scene.

    Args:
        scenario: with `robots`.
        html: the file to write.
        view: camera preset that it opens with.
        shown: layers that are shown at first; None for all.
    """
    from drake_starnav.visualization.tracks import RobotTrack, record_tracks  # late: it loads Meshcat

    robots = [
        RobotTrack(each.robot, robot, each.motion, make_caption_lines(each.trial)[-1], robot.goals)
        for each, robot in zip(trials, scenario.robots, strict=True)
    ]
    world = make_worlds_of_robots(scenario, seed)[0]
    line = f"{counted(len(robots), 'robot')}, method {trials[0].trial.method}, seed {seed}"
    return record_tracks(robots, world, scenario.name, line, html, view, shown)


class _Witness:
    """Observes a trial to store its outcome and motion."""

    def add_to(self, builder: DiagramBuilder, navigation: Navigation, scenario: Scenario) -> None:
        pass

    def finish(self, lines: tuple[str, ...], motion: Motion) -> None:
        self.outcome, self.motion = lines[-1], motion


def record_comparison(
    scenarios: Mapping[str, Scenario],
    seed: int,
    html: Path,
    *,
    view: str = "top",
    shown: frozenset[str] | None = None,
    progress: Callable[[float, float], None] | None = None,
) -> "RecordedRun":
    """Let each method drive the same world alone, then record all their robots in one scene.

    The robots do not interact: each repeats its own run and stays at the pose where that ended.

    Args:
        scenarios: method -> the scenario with its settings; they have the same world.
        seed, html, view, shown: as for `record_robots`.
        progress: called repeatedly with the simulated time of the current run and its time limit, s.
    """
    from drake_starnav.visualization.tracks import RobotTrack, record_tracks  # late: it loads Meshcat

    robots = []
    for method, scenario in scenarios.items():
        witness = _Witness()
        run_trial(scenario, method=method, seed=seed, observer=witness, progress=progress)
        robots.append(RobotTrack(method, scenario, witness.motion, witness.outcome))
    line = f"{counted(len(robots), 'method')}, seed {seed}"
    return record_tracks(robots, robot_world(scenario, seed), scenario.name, line, html, view, shown)
