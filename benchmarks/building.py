"""Time the updates of perception and planner in a building, where the robot is driven by somebody else or by the plan.

Run in the checkout: python -m benchmarks.building [--scans 1400] [--spacing 0.3] [--seed 0]

The robot has no dynamics. Times are CPU times of the thread, so that another load of the machine counts little. Each
drive is made twice, and the first time only compiles.
"""

import argparse
import hashlib
import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from unittest.mock import patch

import numpy as np

from benchmarks.building_world import LIDAR, building, tour, tour_log
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.planning import PlannerInput, PlannerState, plan_step, planner, route
from drake_starnav.planning.grid import Grid
from drake_starnav.scenario.margins import derive_margins
from drake_starnav.scenario.schema import Scenario
from drake_starnav.surroundings.perception import PerceptionSettings, PerceptionState, perceive
from drake_starnav.worlds.view import scan_from, visible_shapes

SCENARIO = Scenario("default", None)
ROBOT, PLANNER, MARGINS = SCENARIO.robot, SCENARIO.planner, derive_margins(SCENARIO)
SETTINGS = PerceptionSettings(MARGINS, ROBOT.shape)
PHASES = {
    "contradictions": (planner, "find_consistent_regions"),
    "revise": (planner, "replace_regions"),
    "extend": (planner, "add_latest_node"),
    "reopen": (planner, "reopen_closures"),
    "search": (planner, "find_route"),
    "cost-to-go": (route, "build_cost_field"),
    "frontier": (route, "find_frontier_point"),
    "string pulling": (route, "pull_string"),
    "distance grid": (Grid, "add_hits"),
}
"""Functions that are timed inside an update; some call others."""
GOALS = ((59.0, 27.25), (1.0, 1.0), (59.0, 1.0), (29.0, 39.0))
"""In turn, the goal of an equal share of the scans, W, m: in corridors."""


@dataclass
class Timed:
    """CPU times of a drive.

    Attributes:
        scan, update: for each scan, s.
        phases: for each scan, by name, s.
        nodes: for each scan, of the roadmap after it.
        digest: of all states, to compare two versions of the code.
    """

    scan: list[float] = field(default_factory=list)
    update: list[float] = field(default_factory=list)
    phases: list[dict[str, float]] = field(default_factory=list)
    nodes: list[int] = field(default_factory=list)
    digest: str = ""

    def row(self, name: str, values: Iterable[float]) -> str:
        """A line of the table: median, p90, p99 and greatest, ms, of those that took any time."""
        spent = 1e3 * np.array([value for value in values if value > 0.0])
        if not len(spent):
            return f"| {name} | 0 | | | | |"
        shown = " | ".join(f"{value:.2f}" for value in (*np.percentile(spent, (50, 90, 99)), spent.max()))
        return f"| {name} | {len(spent)} | {shown} |"

    def table(self) -> str:
        """All distributions."""
        rows = [self.row("scan", self.scan), self.row("update", self.update)]
        rows.append(self.row("both", np.add(self.scan, self.update)))
        rows += [self.row(name, (phases.get(name, 0.0) for phases in self.phases)) for name in PHASES]
        return "\n".join(("| step | count | p50, ms | p90 | p99 | max |", "|---|--:|--:|--:|--:|--:|", *rows))


@contextmanager
def timed_phases() -> Iterator[dict[str, float]]:
    """Within it, the functions of `PHASES` add their CPU times to the dictionary."""
    spent: dict[str, float] = defaultdict(float)

    def timed(name: str, function: Callable) -> Callable:
        def call(*arguments, **options):
            begin = time.thread_time()
            try:
                return function(*arguments, **options)
            finally:
                spent[name] += time.thread_time() - begin

        return call

    patches = [patch.object(owner, name, timed(key, getattr(owner, name))) for key, (owner, name) in PHASES.items()]
    for each in patches:
        each.start()
    try:
        yield spent
    finally:
        for each in patches:
            each.stop()


@dataclass
class Pipeline:
    """Perception and planner with their times."""

    timed: Timed = field(default_factory=Timed)
    known: PerceptionState = field(default_factory=PerceptionState.initial)
    state: PlannerState = field(default_factory=lambda: PlannerState.initial(PLANNER, ROBOT.radius))
    goal: np.ndarray | None = None

    def update(self, scan: LaserScan, pose: np.ndarray, goal: np.ndarray, spent: dict[str, float]) -> None:
        """One scan and one update."""
        if self.goal is not None and (goal != self.goal).any():
            self.state = self.state.with_new_goal()
        self.goal = goal
        spent.clear()
        begin = time.thread_time()
        self.known = perceive(self.known, (scan,), pose, SETTINGS)
        middle = time.thread_time()
        now = PlannerInput(self.known.observation, pose[:2], goal, scan.time, PLANNER, MARGINS, ROBOT.radius)
        self.state = plan_step(self.state, now)
        self.timed.update.append(time.thread_time() - middle)
        self.timed.scan.append(middle - begin)
        self.timed.phases.append(dict(spent))
        self.timed.nodes.append(len(self.state.roadmap))
        self.timed.digest = digest(self.timed.digest, self.state)


def digest(before: str, state: PlannerState) -> str:
    """A hash of a state and of the hash before it."""
    roadmap = state.roadmap
    arrays = (state.route.path, state.route.beyond, roadmap.union.values, roadmap.edges, roadmap.closures.failed_places)
    return hashlib.sha256(
        b"".join((before.encode(), state.status.value.encode(), *map(np.ndarray.tobytes, arrays)))
    ).hexdigest()


def replayed(scans: int, spacing: float, seed: int) -> Pipeline:
    """The log of a tour through the building."""
    world, middles = building(seed)
    log = tour_log(world, tour(world, middles, scans * spacing, seed), scans, spacing, seed)
    pipeline = Pipeline()
    with timed_phases() as spent:
        for k, seen in enumerate(log):
            pipeline.update(seen.scan, seen.pose, np.array(GOALS[k * len(GOALS) // len(log)]), spent)
    return pipeline


def driven(scans: int, spacing: float, seed: int) -> Pipeline:
    """A drive to the goals in turn: straight to the next way point, `spacing` metres from a scan to the next."""
    world, _ = building(seed)
    shapes, pose, pipeline, goals = visible_shapes(world), np.array(world.start), Pipeline(), list(GOALS)
    with timed_phases() as spent:
        for k in range(scans):
            if len(goals) > 1 and np.hypot(*(goals[0] - pose[:2])) < spacing:
                goals.pop(0)
            scan = scan_from(shapes, pose, LIDAR, seed, k)
            pipeline.update(scan, pose, np.array(goals[0]), spent)
            path = pipeline.state.guidance.path
            way = path[0] - pose[:2] if len(path) else np.zeros(2)
            length = float(np.hypot(*way))
            if length > 1e-9:
                step = min(spacing, length) / length * way
                pose = np.array((*(pose[:2] + step), np.arctan2(*way[::-1])))
    return pipeline


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scans", type=int, default=1400, help="of a drive (default: 1400)")
    parser.add_argument("--spacing", type=float, default=0.3, help="way between two scans, m (default: 0.3)")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    for name, drive in (("driven by somebody else", replayed), ("driven by the planner", driven)):
        drive(options.scans, options.spacing, options.seed)  # compiles what the other one runs
        pipeline = drive(options.scans, options.spacing, options.seed)
        print(f"{name}: {len(pipeline.timed.scan)} scans, {pipeline.state.progress.plan_count} plans, ", end="")
        print(f"{pipeline.timed.nodes[-1]} nodes, {pipeline.state.status.value}, {pipeline.timed.digest[:16]}")
        print(pipeline.timed.table(), end="\n\n", flush=True)


if __name__ == "__main__":
    main()
