"""Compare several methods in one scene: each drives alone, then all are shown together."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from pydrake.systems.framework import DiagramBuilder

from drake_starnav.geometry.trajectory import Motion
from drake_starnav.navigation import Navigation
from drake_starnav.scenario import Scenario
from drake_starnav.simulation import run_trial
from drake_starnav.station.model_world import make_world_with_footprints
from drake_starnav.visualization import meshes
from drake_starnav.visualization.meshes import LAYERS, Layer, five_pointed_star
from drake_starnav.visualization.page import Caption
from drake_starnav.visualization.scene_timeline import RecordedRun, RobotTrack
from drake_starnav.visualization.tracks import record_tracks, track_of, trail_layer


class _Witness:
    """Observes a trial to store its outcome and motion."""

    def add_to(self, builder: DiagramBuilder, navigation: Navigation, scenario: Scenario) -> None:
        pass

    def start(self) -> None:
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
) -> RecordedRun:
    """Let each method drive the same world alone, then record all their robots in one scene.

    The robots do not interact: each repeats its own run and stays at the pose where that ended.

    Args:
        scenarios: method -> the scenario with its settings; they have the same world.
        seed: of the world and of the sensor's noise.
        html: the file to write.
        view: camera preset that it opens with.
        shown: layers that are shown at first; None for all.
        progress: called repeatedly with the simulated time of the current run and its time limit, s.

    Raises:
        StarnavError: as of `run_trial`, or unknown view.
    """
    robots: dict[str, RobotTrack] = {}
    trails: dict[str, Layer] = {}
    for k, (method, scenario) in enumerate(scenarios.items()):
        witness = _Witness()
        run_trial(scenario, method=method, seed=seed, observer=witness, progress=progress)
        robots[method] = track_of(scenario.robot, witness.motion, k)
        trails |= dict([trail_layer(method, witness.outcome, k)])
    scenario = next(iter(scenarios.values()))
    world = make_world_with_footprints(scenario.world, seed, scenario.robot.radius)
    goal = five_pointed_star(np.array(world.goal), 0.9 * scenario.robot.radius, LAYERS["goal"].height)
    layers = meshes.with_scene({**trails, "goal": LAYERS["goal"]}, world)
    caption = Caption(scenario.name, (f"{len(robots)} method{'s' * (len(robots) > 1)}, seed {seed}",), layers, shown)
    return record_tracks(robots, {"goal": [goal]}, world, caption, scenario.recording, html, view)
