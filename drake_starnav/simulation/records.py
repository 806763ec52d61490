"""A run of one robot or of several: its record as JSON, and its recording."""

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from drake_starnav.scenario import Scenario
from drake_starnav.simulation.robots import RobotTrial, run_robots
from drake_starnav.simulation.run import run_trial
from drake_starnav.simulation.trial import caption_lines, trial_record
from drake_starnav.station.model_world import make_world_with_footprints

if TYPE_CHECKING:
    from drake_starnav.visualization.scene_timeline import RecordedRun

DECIDES = "collision", "struck", "unreachable", "blocked", "occupied", "timeout"
"""Outcomes of which the first that any robot has is that of all."""


def driven_record(
    scenario: Scenario, *, method: str = "star", seed: int = 0, html: Path | None = None
) -> dict[str, Any]:
    """Run a scenario of one robot or of several, and return its record.

    Args:
        scenario, method, seed: as for `run_trial`.
        html: file for a recording, if any.

    Raises:
        StarnavError: as of `run_trial` and `run_robots`.
    """
    if not scenario.robots:
        return trial_record(run_trial(scenario, method=method, seed=seed, html=html))
    trials = run_robots(scenario, method=method, seed=seed)
    if html is not None:
        record_robots(scenario, trials, seed, html)
    return robots_record(trials)


def robots_record(trials: Sequence[RobotTrial]) -> dict[str, Any]:
    """The trials of several robots as one JSON-compatible mapping.

    Its figures are those of the robot that decides: the last one to arrive, or one that did not. `min_gap_m` is the
    least of all, `state_hash` is of all, and `robots` holds the record of each.
    """
    each = [{"robot": robot.robot, "min_gap_m": robot.min_gap_m, **trial_record(robot.trial)} for robot in trials]
    decides = min(trials, key=lambda robot: (_rank(robot.trial.outcome), -robot.trial.time_s)).trial
    states = hashlib.sha256("".join(robot.trial.state_hash for robot in trials).encode()).hexdigest()
    gap = min(robot.min_gap_m for robot in trials)
    return {**trial_record(decides), "min_gap_m": gap, "state_hash": states, "robots": each}


def _rank(outcome: str) -> int:
    return DECIDES.index(outcome) if outcome in DECIDES else len(DECIDES)


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
        trials: of each of them.
        seed: of the world.
        html: the file to write.
        view: camera preset that it opens with.
        shown: layers that are shown at first; None for all.
    """
    from drake_starnav.visualization import meshes  # late: they load Meshcat
    from drake_starnav.visualization.page import Caption
    from drake_starnav.visualization.tracks import record_tracks, track_of, trail_layer

    tracks, layers = {}, {}
    goals: dict[str, list[meshes.Mesh]] = {}
    for k, (each, robot) in enumerate(zip(trials, scenario.robots, strict=True)):
        tracks[each.robot] = track_of(robot.robot, each.motion, k)
        name, layer = trail_layer(each.robot, caption_lines(each.trial)[-1], k)
        layers[name], size = layer, 0.9 * robot.robot.radius
        height = meshes.LAYERS["goal"].height
        goals[name] = [meshes.five_pointed_star(np.array(goal[:2]), size, height) for goal in robot.goals]
    world = make_world_with_footprints(scenario.world, seed, max(each.robot.radius for each in scenario.robots))
    lines = (f"{len(tracks)} robots, method {trials[0].trial.method}, seed {seed}",)
    caption = Caption(scenario.name, lines, meshes.with_scene(layers, world), shown)
    return record_tracks(tracks, goals, world, caption, scenario.recording, html, view)
