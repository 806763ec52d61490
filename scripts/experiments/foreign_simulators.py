"""Drive worlds in MuJoCo and in ir-sim, and compare the times with those of the simulation in Drake.

Run: python scripts/experiments/foreign_simulators.py [--trials N] [--seed S] [--simulators mujoco irsim]

Both run in lock step, at the rates of the scenario. A time ends where the goal is reached, before the robot stands. The
second table is the CPU time of `Navigator.step`.
Needs `pip install drake-starnav[simulators]`.
"""

import argparse
import importlib
import time
from typing import Any

import numpy as np

from drake_starnav.evaluation.jobs import derive_trial_seed
from drake_starnav.evaluation.summary import format_markdown_table
from drake_starnav.runtime import Command, Navigator
from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.scenario.schema import Scenario
from drake_starnav.simulation.run import run_trial
from tests.helpers.driver_faults import driven

ROBOTS = {"mujoco": "MujocoRobot", "irsim": "IrsimRobot"}
"""Classes of `tests.helpers.*_robot`."""


class Timed(Navigator):
    """Keeps how much CPU each step takes, s."""

    def __init__(self, scenario: Scenario) -> None:
        self.took: list[float] = []
        super().__init__(scenario)
        self.took.clear()  # of the warm-up

    def step(self, *reading: Any) -> Command:
        begin = time.thread_time()
        command = super().step(*reading)
        self.took.append(time.thread_time() - begin)
        return command


def main() -> None:
    """Drive and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenario", nargs="*", default=["forest", "maze", "room"])
    parser.add_argument("--trials", type=int, default=20, help="drives of each (default: 20)")
    parser.add_argument("--seed", type=int, default=1000, help="of the batch (default: 1000)")
    parser.add_argument("--simulators", nargs="+", default=list(ROBOTS), choices=ROBOTS)
    options = parser.parse_args()
    rows, steps = [], []
    for name in options.scenario:
        scenario = load_scenario(name)
        navigator, times = Timed(scenario), np.full((options.trials, 1 + len(options.simulators)), np.nan)
        reached, touched = np.zeros(len(options.simulators), int), np.zeros(len(options.simulators), int)
        for k in range(options.trials):
            seed = derive_trial_seed(options.seed, k)
            times[k, 0] = run_trial(scenario, seed=seed).time_s
            for j, simulator in enumerate(options.simulators):
                module: Any = importlib.import_module(f"tests.helpers.{simulator}_robot")
                robot = getattr(module, ROBOTS[simulator])(scenario, seed=seed)
                navigator.reset()
                commands = driven(navigator, robot, robot.world.timeout)
                reached[j] += commands[-1].status == "reached"
                touched[j] += robot.touched > 0
                times[k, 1 + j] = robot.period * sum(each.status != "reached" for each in commands)
        shares = 1e3 * np.percentile(navigator.took, (50.0, 99.0, 100.0))
        steps.append([name, str(len(navigator.took)), *(f"{share:.2f}" for share in shares)])
        for j, simulator in enumerate(options.simulators):
            ratios = times[:, 1 + j] / times[:, 0]
            spread = f"{np.median(ratios):.3f} ({ratios.min():.2f} to {ratios.max():.2f})"
            total = f"{times[:, 1 + j].sum() / times[:, 0].sum():.3f}"
            rows.append([simulator, name, f"{reached[j]} of {options.trials}", str(touched[j]), total, spread])
    head = ("simulator", "world", "reached", "with contact", "time / in Drake, of all", "of a drive: median (range)")
    print(format_markdown_table(head, rows))
    print(format_markdown_table(("world", "steps", "p50, ms", "p99, ms", "longest, ms"), steps))


if __name__ == "__main__":
    main()
