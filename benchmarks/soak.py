"""Measure the growth of roadmap, planning time and memory over many goals in one process.

Run in the checkout: python -m benchmarks.soak [SCENARIO] [--goals 1000] [--set world.size=24] [--out out/soak]

One robot drives through one world in one simulation, from each goal to the next; the goals are random reachable
places. Writes a CSV with a row for each finished goal, and a plot; when interrupted, for the goals so far.
"""

import argparse
import csv
import dataclasses
import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydrake.systems.analysis import Simulator, SimulatorStatus
from pydrake.systems.framework import DiagramBuilder

from drake_starnav.cli.options import INTERRUPTED, add_overrides, run_for_exit_code
from drake_starnav.navigation import Navigation, Parts, add_navigation
from drake_starnav.planning import PlannerStatus
from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.scenario.schema import Scenario
from drake_starnav.simulation.trial import find_omniscient_path
from drake_starnav.station.model_world import make_world_with_footprints
from drake_starnav.station.monitors import COLLISION, STRUCK, CollisionMonitor
from drake_starnav.utils.files import replace_file
from drake_starnav.utils.stopwatch import Stopwatch
from drake_starnav.worlds import compute_clearance
from drake_starnav.worlds.world import World

STEP = 0.5
"""Period at which the robot's position is checked, s."""
MARGIN = 0.15
"""Least clearance around a robot at a goal, m."""
SLOWEST = 0.2
"""A goal is given up after the time that its shortest path takes at this speed, and ALLOWANCE, m/s."""
ALLOWANCE = 60.0


@dataclass(frozen=True)
class Leg:
    """The drive to one goal: outcome and figures."""

    goal: int
    outcome: str
    shortest_path_m: float
    time_s: float
    nodes: int
    plans: int
    plan_p50_ms: float
    memory_mb: float


def random_place(world: World, radius: float, rng: np.random.Generator) -> np.ndarray:
    """A random free position for a robot of a radius (m), shape (2,), W, m."""
    x0, y0, x1, y1 = world.extent
    while True:
        places = rng.uniform((x0, y0), (x1, y1), (100, 2))
        free = places[compute_clearance(world, places) > radius]
        if len(free):
            return free[0]


def memory_mb() -> float:
    """Resident memory of this process, MB."""
    status = Path("/proc/self/status").read_text(encoding="ascii")
    return int(status.partition("VmRSS:")[2].split()[0]) / 1024.0


class Soak:
    """One simulation with a sequence of goals."""

    def __init__(self, scenario: Scenario, seed: int) -> None:
        self.scenario = scenario
        self.world = make_world_with_footprints(scenario.world, seed, scenario.robot.radius)
        self.stopwatch = Stopwatch()
        builder = DiagramBuilder()
        self.navigation: Navigation = add_navigation(
            builder, scenario, Parts(self.world), seed, stopwatch=self.stopwatch
        )
        CollisionMonitor.AddToBuilder(builder, self.navigation.station)
        self.simulator = Simulator(builder.Build())
        self.rng = np.random.default_rng(seed)

    def drive(self, number: int) -> Leg:
        """Give the robot a new goal, and follow it until it arrives or gives up."""
        root = self.simulator.get_mutable_context()
        navigation, start = self.navigation, root.get_time()
        assert navigation.planner is not None
        pose = navigation.station.GetOutputPort("localization.pose")
        here = navigation.station.GetMyContextFromRoot(root)
        position = pose.Eval(here)[:2]
        radius, way = self.scenario.robot.radius, None
        while way is None:
            goal = random_place(self.world, radius + MARGIN, self.rng)
            trip = dataclasses.replace(self.world, start=(*position, 0.0), goal=tuple(goal))
            way = find_omniscient_path(trip, radius)
        navigation.goal.GetMyMutableContextFromRoot(root).SetDiscreteState(goal)
        self.stopwatch.seconds["plan"].clear()
        outcome, limit = "timeout", start + way[0] / SLOWEST + ALLOWANCE
        planner = navigation.planner.GetMyContextFromRoot(root)
        status = navigation.planner.GetOutputPort("status")
        while root.get_time() < limit:
            ended = self.simulator.AdvanceTo(root.get_time() + STEP)
            if ended.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition:
                outcome = ended.message().split()[0]
                break
            if np.hypot(*(pose.Eval(here)[:2] - goal)) < self.scenario.simulation.goal_tolerance:
                outcome = "reached"
                break
            if root.get_time() > start + 2 * STEP and status.Eval(planner) is PlannerStatus.UNREACHABLE:
                outcome = "unreachable"
                break
        plans = np.array(self.stopwatch.seconds["plan"])
        for name in self.stopwatch.seconds:
            self.stopwatch.seconds[name].clear()
        return Leg(
            goal=number,
            outcome=outcome,
            shortest_path_m=round(float(way[0]), 3),
            time_s=round(root.get_time() - start, 3),
            nodes=len(navigation.planner.GetOutputPort("planner_state").Eval(planner).roadmap),
            plans=len(plans),
            plan_p50_ms=round(float(np.median(plans)) * 1e3, 3) if len(plans) else 0.0,
            memory_mb=round(memory_mb(), 1),
        )


def draw(legs: Sequence[Leg], path: Path) -> None:
    """Nodes, time of a plan and memory over the goals, as a PNG."""
    from matplotlib.figure import Figure

    figure = Figure((8.0, 6.0), layout="constrained")
    axes = figure.subplots(3, sharex=True)
    number = np.array([leg.goal for leg in legs])
    for ax, name, label in zip(
        axes, ("nodes", "plan_p50_ms", "memory_mb"), ("nodes", "a plan, ms", "memory, MB"), strict=True
    ):
        values = np.array([getattr(leg, name) for leg in legs])
        ax.plot(number, values, ".", ms=3, color="#0072b2")
        ax.set_ylabel(label)
        ax.set_ylim(0.0, 1.1 * max(float(values.max()), 1e-9))
        ax.grid(alpha=0.3)
    axes[-1].set_xlabel("goal")
    with replace_file(path) as file:
        figure.savefig(file, dpi=110, format="png")


def main(arguments: Sequence[str] | None = None) -> int:
    """Drive, write, and print a summary; returns the exit code."""
    parser = argparse.ArgumentParser(prog="soak", description=__doc__.partition("\n")[0])
    parser.add_argument("scenario", nargs="?", default="maze")
    parser.add_argument("--goals", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    add_overrides(parser)
    parser.add_argument("--out", type=Path, default=Path("out/soak"), metavar="FOLDER")
    options = parser.parse_args(arguments)
    return run_for_exit_code(parser.prog, lambda: run(options))


def run(options: argparse.Namespace) -> int:
    """Drive to all goals; write each leg as it ends, then the plot."""
    soak = Soak(load_scenario(options.scenario, overrides=options.overrides), options.seed)
    legs: list[Leg] = []
    options.out.mkdir(parents=True, exist_ok=True)
    with (options.out / "soak.csv").open("w", encoding="utf-8", newline="") as file, suppress(KeyboardInterrupt):
        rows = csv.DictWriter(file, [field.name for field in dataclasses.fields(Leg)], lineterminator="\n")
        rows.writeheader()
        for number in range(options.goals):
            legs.append(soak.drive(number))
            rows.writerow(dataclasses.asdict(legs[-1]))
            file.flush()
            if legs[-1].outcome in (COLLISION, STRUCK):
                break
    if not legs:
        return INTERRUPTED
    draw(legs, options.out / "soak.png")
    ended = [leg.outcome for leg in legs]
    print({outcome: ended.count(outcome) for outcome in dict.fromkeys(ended)})
    tenth = max(len(legs) // 10, 1)
    for part in (legs[:tenth], legs[-tenth:]):
        plan = np.median([leg.plan_p50_ms for leg in part if leg.plans] or [0.0])
        print(
            f"goals {part[0].goal} to {part[-1].goal}: up to {max(leg.nodes for leg in part)} nodes, "
            f"a plan {plan:.2f} ms, "
            f"memory {max(leg.memory_mb for leg in part):.0f} MB"
        )
    print(f"wrote {options.out}/soak.csv and soak.png")
    return 0


if __name__ == "__main__":
    sys.exit(main())
