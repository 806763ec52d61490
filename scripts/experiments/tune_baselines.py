"""Choose the baselines' parameters: python scripts/experiments/tune_baselines.py --out out/tuning

Every combination of a small grid drives the same trials, with a batch seed that no benchmark uses. The robot follows
each twist exactly, which ranks parameters as well as the full simulation does, and is many times faster. Names in
capitals are constants of a baseline's module, which are replaced for a combination.
"""

import argparse
import contextlib
import itertools
import math
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from unittest import mock

import numpy as np
from tqdm import tqdm

from drake_starnav.baselines import (
    DsmParameters,
    KnownObstacles,
    Situation,
    baseline_step,
    dwa,
    known_obstacles,
    potential_field,
)
from drake_starnav.cli.options import check_numbers, exit_code
from drake_starnav.evaluation import trial_seed
from drake_starnav.evaluation.summary import markdown_table
from drake_starnav.parameters import unknown_name
from drake_starnav.scenario import Scenario, load_scenario
from drake_starnav.utils.files import check_writable, write_text
from drake_starnav.worlds import World, clearance, make_world
from drake_starnav.worlds.view import scan_from, visible_shapes

SEED = 77
"""Seed of the batch; the benchmark's is 0."""
TIMEOUT = 75.0
"""About 2.5 times the duration at full speed, which limits the cost of a robot that is stuck, s."""
SCENARIOS = ("forest", "paper_forest")
"""In a maze the path determines the result of these methods, not their parameters."""
Grid = dict[str, tuple[str, ...]]
GRIDS: dict[str, Grid] = {
    "dsm": {
        "dsm.margin": ("0.01", "0.03", "0.06", "0.1"),
        "dsm.max_speed": ("0.3", "0.4", "0.6", "0.8"),
    },
    "foa": {"foa.margin": ("0.0", "0.03", "0.06", "0.1"), "foa.max_speed": ("0.3", "0.4", "0.6", "0.8")},
    "dwa": {
        "dwa.PERIOD": ("0.25", "0.5"),
        "dwa.CLEARANCE_WEIGHT": ("0.5", "1.0"),
        "dwa.SPEED_WEIGHT": ("0.1", "0.5"),
    },
    "apf": {
        "apf.repulsive_gain": ("0.0003", "0.001", "0.003", "0.01"),
        "apf.INFLUENCE_DISTANCE": ("0.3", "0.6", "1.0"),
        "apf.max_speed": ("0.6", "0.8"),
    },
}
"""By method, the tried values of its parameters and constants. The other FOA methods use the values chosen for FOA."""
MODULES = {"dwa": dwa, "apf": potential_field}
"""Those whose constants are tuned, by method."""


_worlds: dict[tuple[str, int], World] = {}


def cached_world(scenario: Scenario, seed: int) -> World:
    """The world of a trial, which is the same for all parameters."""
    key = (scenario.name, seed)
    if key not in _worlds:
        _worlds[key] = make_world(scenario.world, seed, scenario.robot.radius)
    return _worlds[key]


def drive(scenario: Scenario, seed: int) -> tuple[str, float]:
    """The outcome of one trial without dynamics, and its time, s."""
    robot, controller, lidar = scenario.robot, scenario.controller, scenario.lidar
    settings = getattr(scenario, controller.kind)
    world = cached_world(scenario, seed)
    knows = isinstance(settings, DsmParameters)
    obstacles = KnownObstacles.none()
    if knows:
        obstacles = known_obstacles(world.discs, world.bounds, robot.radius + settings.margin)
    shapes, goal, period = visible_shapes(world), np.array(world.goal), 1.0 / controller.rate
    pose, twist, points, scans = np.array(world.start), np.zeros(2), np.zeros((0, 2)), 0
    for k in range(int(TIMEOUT / period)):
        if math.hypot(*(pose[:2] - goal)) < scenario.simulation.goal_tolerance:
            return "reached", k * period
        if clearance(world, pose[None, :2])[0] < robot.radius:
            return "collision", k * period
        if not knows and k * period * lidar.rate >= scans:
            points = scan_from(shapes, pose, lidar, seed, scans).points(pose)
            scans += 1
        situation = Situation(pose, twist, goal, goal, points, obstacles)
        twist, _ = baseline_step(situation, settings, controller, robot)
        heading = pose[2] + 0.5 * twist[1] * period
        pose = pose + period * np.array((twist[0] * math.cos(heading), twist[0] * math.sin(heading), twist[1]))
    return "timeout", TIMEOUT


@contextlib.contextmanager
def replaced_constants(chosen: Sequence[str]) -> Iterator[list[str]]:
    """Replaces constants, e.g. by "dwa.PERIOD=0.5"; yields the rest of what is chosen, overrides of a scenario."""
    overrides = []
    with contextlib.ExitStack() as replaced:
        for text in chosen:
            key, _, value = text.partition("=")
            method, _, name = key.partition(".")
            if name.isupper():
                replaced.enter_context(mock.patch.object(MODULES[method], name, float(value)))
            else:
                overrides.append(text)
        yield overrides


def tune(method: str, trials: int) -> str:
    """The table of one method's grid, the best first: most trials reached, then least time."""
    rows = []
    grid = GRIDS[method]
    choices = list(itertools.product(*([f"{key}={value}" for value in values] for key, values in grid.items())))
    size = f"{len(choices)} combinations of {trials * len(SCENARIOS)} trials each"
    print(f"{method}: {size}", file=sys.stderr, flush=True)
    for chosen in tqdm(choices, desc=method, disable=None, leave=False):
        with replaced_constants(chosen) as overrides:
            scenarios = [load_scenario(name, method=method, overrides=overrides) for name in SCENARIOS]
            ends = {s.name: [drive(s, trial_seed(SEED, k)) for k in range(trials)] for s in scenarios}
        times = [time for results in ends.values() for outcome, time in results if outcome == "reached"]
        time = float(np.mean(times)) if times else math.inf
        cells = [" ".join(chosen)]
        for results in ends.values():
            outcomes = [outcome for outcome, _ in results]
            cells += [str(outcomes.count(outcome)) for outcome in ("reached", "collision", "timeout")]
        rows.append((-len(times), time, [*cells, f"{time:.1f}"]))
    head = ["parameters"]
    for name in SCENARIOS:
        head += [f"{name}: reached", "collision", "timeout"]
    return markdown_table([*head, "mean time s"], [cells for _, _, cells in sorted(rows)])


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the grids; see `--help`. Returns the exit code."""
    parser = argparse.ArgumentParser(prog="tune_baselines.py", description="Try grids of the baselines' parameters.")
    parser.add_argument("--method", nargs="+", default=list(GRIDS), help=f"of {', '.join(GRIDS)} (default: all)")
    parser.add_argument("--trials", type=int, default=8, help="of each scenario and combination (default: 8)")
    parser.add_argument("--out", type=Path, default=Path("out/tuning"), metavar="FOLDER", help="default: out/tuning")
    options = parser.parse_args(arguments)
    return exit_code(parser.prog, lambda: run_grids(options))


def run_grids(options: argparse.Namespace) -> int:
    """Try the grid of each method, and write its table."""
    check_numbers(options, trials=(1, math.inf))
    for method in options.method:
        if method not in GRIDS:
            raise unknown_name(f"method {method!r}", method, GRIDS)
    for method in options.method:
        path = options.out / f"{method}.md"
        check_writable(path)
        write_text(path, tune(method, options.trials) + "\n")
        print(f"wrote {path}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
