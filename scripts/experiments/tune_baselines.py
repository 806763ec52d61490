"""Choose the baselines' parameters: python scripts/experiments/tune_baselines.py --out out/tuning

Every combination of a small grid drives the same trials, with a batch seed that no benchmark uses. The robot follows
each twist exactly, which ranks parameters as well as the full simulation does, and is many times faster. Names in
capitals are constants of a baseline's module, which are replaced for a combination. The many constants of `star_paper`
are tried one after another, each with the best values of those before it.
"""

import argparse
import contextlib
import itertools
import math
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Protocol
from unittest import mock

import numpy as np
from tqdm import tqdm

from drake_starnav import paper
from drake_starnav.baselines import dwa
from drake_starnav.baselines.baseline_step import BaselineInput, baseline_step
from drake_starnav.baselines.known_obstacles import KnownObstacles, known_obstacles
from drake_starnav.cli.options import check_numbers, exit_code
from drake_starnav.control import ControllerInputs
from drake_starnav.evaluation.jobs import trial_seed
from drake_starnav.evaluation.summary import markdown_table
from drake_starnav.geometry.footprint import disc
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.paper import choices
from drake_starnav.parameters import unknown_name
from drake_starnav.planning import PlannerInput, PlannerState, PlannerStatus
from drake_starnav.planning.guidance import Guidance
from drake_starnav.robot import BASES
from drake_starnav.robot.motion import Actuation
from drake_starnav.safety.shield import ramped_twist
from drake_starnav.scenario.margins import derive_margins
from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.scenario.schema import Scenario
from drake_starnav.surroundings.perception import PerceptionSettings, PerceptionState
from drake_starnav.surroundings.surroundings import Surroundings
from drake_starnav.utils.files import check_writable, write_text
from drake_starnav.worlds import World, clearance, make_world
from drake_starnav.worlds.view import scan_from, visible_shapes

SEED = 77
"""Seed of the batch; the benchmark's is 0."""
TIMEOUT = 75.0
"""About 2.5 times the duration at full speed, which limits the cost of a robot that is stuck, s. A method that searches
for a way has the world's own time."""
SCENARIOS = ("forest", "paper_forest")
"""For methods without a roadmap: in a maze the path determines their result, not their parameters."""
WITH_ROADMAP = ("paper_forest", "paper_maze")
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
    "star_paper": {
        "star_paper.RHO": ("0.01", "0.02", "0.035", "0.1"),
        "star_paper.EPS": ("0.2", "0.5"),
        "star_paper.RANGE": ("2.0", "100.0"),
        "star_paper.ARRIVAL": ("0.1", "0.2", "0.25"),
        "star_paper.FEASIBLE_DISTANCE": ("0.0", "0.05", "0.2"),
        "star_paper.STUCK_TIME": ("2.0", "5.0", "8.0"),
        "star_paper.SIGMA": ("1.0", "2.0", "4.0"),
    },
}
"""By method, the tried values of its parameters and constants. The other FOA methods use the values chosen for FOA."""
ONE_BY_ONE = ("star_paper",)
"""Methods whose grid is too large for all combinations."""
MODULES = {"dwa": dwa, "star_paper": choices}
"""Those whose constants are tuned, by method."""


_worlds: dict[tuple[str, int], World] = {}


def cached_world(scenario: Scenario, seed: int) -> World:
    """The world of a trial, which is the same for all parameters."""
    key = (scenario.name, seed)
    if key not in _worlds:
        _worlds[key] = make_world(scenario.world, seed, scenario.robot.radius)
    return _worlds[key]


class Steered(Protocol):
    """A method in one trial."""

    def twist(self, pose: np.ndarray, twist: np.ndarray, time: float, scan: LaserScan | None) -> np.ndarray | None:
        """The desired twist (v, omega), m/s and rad/s; None when it gives up.

        Args:
            pose: (x, y, yaw) of the robot in W, m and rad.
            twist: the one that is driven now.
            time: since the start, s.
            scan: a new one, if there is one.
        """


class Reactive:
    """A baseline that heads for the goal."""

    def __init__(self, scenario: Scenario, world: World) -> None:
        self._scenario, self._goal = scenario, np.array(world.goal)
        self._settings = getattr(scenario, scenario.controller.kind)
        self._points, self._obstacles = np.zeros((0, 2)), KnownObstacles.none()
        if self._settings.known:
            inflated = scenario.robot.radius + self._settings.margin
            self._obstacles = known_obstacles(world.discs, world.bounds, inflated)

    def twist(self, pose: np.ndarray, twist: np.ndarray, time: float, scan: LaserScan | None) -> np.ndarray | None:
        if scan is not None and not self._settings.known:
            self._points = scan.points(pose)
        robot = self._scenario.robot
        inputs = BaselineInput(pose, twist, self._goal, self._goal, self._points, self._obstacles, robot)
        return baseline_step(inputs, self._settings).twist


class Guided:
    """The paper's method, which follows its roadmap.

    Attributes:
        state: the planner's.
        inputs: of the controller, in the last period.
    """

    def __init__(self, scenario: Scenario, world: World) -> None:
        self._scenario, self._goal, radius = scenario, np.array(world.goal), scenario.robot.radius
        self._margins = derive_margins(scenario)
        self._settings = PerceptionSettings(self._margins, disc(radius))
        self._perceived, self.state = PerceptionState.initial(), PlannerState.initial(scenario.planner, radius)
        self.inputs = ControllerInputs(np.array(world.start), np.zeros(2), Guidance.none(), Surroundings.unknown())

    def twist(self, pose: np.ndarray, twist: np.ndarray, time: float, scan: LaserScan | None) -> np.ndarray | None:
        planner, robot = self._scenario.planner, self._scenario.robot
        if scan is not None:
            self._perceived = paper.perceive(self._perceived, (scan,), pose, self._settings)
            seen = self._perceived.observation
            now = PlannerInput(seen, pose[:2], self._goal, time, planner, self._margins, robot.radius)
            self.state = paper.plan(self.state, now)
        if self.state.status is PlannerStatus.UNREACHABLE:
            return None
        self.inputs = ControllerInputs(pose, twist, self.state.guidance, self._perceived.surroundings)
        return paper.control(self.inputs, robot).twist


def drive(scenario: Scenario, seed: int, method: Steered | None = None) -> tuple[str, float]:
    """The outcome of one trial without dynamics, and its time, s; the method is the scenario's unless given."""
    robot, lidar, world = scenario.robot, scenario.lidar, cached_world(scenario, seed)
    guided = scenario.method == "star_paper"
    method = method or (Guided if guided else Reactive)(scenario, world)
    shapes, goal, period = visible_shapes(world), np.array(world.goal), 1.0 / scenario.controller.rate
    pose, twist, scans, timeout = np.array(world.start), np.zeros(2), 0, world.timeout if guided else TIMEOUT
    actuation = Actuation(robot.limits, robot.shape, period, 0.0)
    free = -1.0  # the robot can drive so far without a collision, m
    for k in range(int(timeout / period)):
        if math.hypot(*(pose[:2] - goal)) < scenario.simulation.goal_tolerance:
            return "reached", k * period
        if free < 0.0:
            free = clearance(world, pose[None, :2])[0] - robot.radius
        if free < 0.0:
            return "collision", k * period
        scan = None
        if k * period * lidar.rate >= scans:
            scan, scans = scan_from(shapes, pose, lidar, seed, scans), scans + 1
        desired = method.twist(pose, twist, k * period, scan)
        if desired is None:
            return "unreachable", k * period
        twist = np.array(ramped_twist(twist, BASES["differential"].saturated(desired, robot.limits), actuation))
        heading, free = pose[2] + 0.5 * twist[1] * period, free - abs(twist[0]) * period
        pose = pose + period * np.array((twist[0] * math.cos(heading), twist[0] * math.sin(heading), twist[1]))
    return "timeout", timeout


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
    """The table of one method's grid, the best first: most trials reached, then least time.

    A grid that is searched one parameter after another has a table for each, in their order.
    """
    grid = GRIDS[method]
    if method not in ONE_BY_ONE:
        return _table(method, list(itertools.product(*(_settings(grid, key) for key in grid))), trials)[0]
    best = {key: f"{key}={getattr(MODULES[method], key.partition('.')[2])}" for key in grid}
    tables = []
    for key in grid:
        rest = [best[other] for other in grid if other != key]
        table, (best[key], *_) = _table(method, [(value, *rest) for value in _settings(grid, key)], trials)
        tables.append(table)
    return "\n".join(tables)


def _settings(grid: Grid, key: str) -> list[str]:
    return [f"{key}={value}" for value in grid[key]]


def _table(method: str, choices: list[tuple[str, ...]], trials: int) -> tuple[str, tuple[str, ...]]:
    """The table of some combinations, and the best of them."""
    names = WITH_ROADMAP if method in ONE_BY_ONE else SCENARIOS
    rows = []
    print(f"{method}: {len(choices)} combinations of {trials * len(names)} trials each", file=sys.stderr, flush=True)
    for chosen in tqdm(choices, desc=method, disable=None, leave=False):
        with replaced_constants(chosen) as overrides:
            scenarios = [load_scenario(name, method=method, overrides=overrides) for name in names]
            ends = {s.name: [drive(s, trial_seed(SEED, k)) for k in range(trials)] for s in scenarios}
        times = [time for results in ends.values() for outcome, time in results if outcome == "reached"]
        time = float(np.mean(times)) if times else math.inf
        cells = [" ".join(chosen)]
        for results in ends.values():
            outcomes = [outcome for outcome, _ in results]
            reached, collided = outcomes.count("reached"), outcomes.count("collision")
            cells += [str(reached), str(collided), str(trials - reached - collided)]
        rows.append((-len(times), time, [*cells, f"{time:.1f}"], chosen))
    rows.sort(key=lambda row: row[:2])
    head = ["parameters"]
    for name in names:
        head += [f"{name}: reached", "collision", "timeout"]
    return markdown_table([*head, "mean time s"], [cells for _, _, cells, _ in rows]), rows[0][3]


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
