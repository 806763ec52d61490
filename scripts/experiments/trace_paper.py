"""Trace where the paper's method is stuck to the equation that holds it there.

Run: python scripts/experiments/trace_paper.py --trials 50 --seed 1000

The robot follows each twist exactly, as in `tune_baselines.py`.
"""

import argparse
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from itertools import repeat

import numpy as np

from drake_starnav.control.inputs import ControllerInputs
from drake_starnav.evaluation.jobs import trial_seed
from drake_starnav.evaluation.summary import markdown_table
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.paper import choices
from drake_starnav.paper.blend import blend_share
from drake_starnav.paper.modulation import modulated_vector
from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.scenario.schema import Scenario
from drake_starnav.worlds import World
from scripts.experiments.tune_baselines import WITH_ROADMAP, Guided, cached_world, drive

BLENDED = 0.5
"""From this share on, the vector away from the nearest hit decides."""
DAMPED = 0.3
"""The modulation stops the robot if less than this share of the vector's length remains along it."""
CAUSES = {
    "midpoint": "a hit is nearer to the short-term goal than the robot's radius (III-B.2)",
    "blend": "the vector leads away from the nearest hit (Eq. (15))",
    "modulation": "the regions damp the vector (Eq. (14))",
    "other": "",
}
"""What holds a robot that is stuck, in the order of the search."""


class Traced(Guided):
    """The paper's method, with the causes for which it was stuck."""

    def __init__(self, scenario: Scenario, world: World) -> None:
        super().__init__(scenario, world)
        self.causes: list[str] = []
        self._radius = scenario.robot.radius

    def twist(self, pose: np.ndarray, twist: np.ndarray, time: float, scan: LaserScan | None) -> np.ndarray | None:
        before, inputs = self.state, self.inputs
        desired = super().twist(pose, twist, time, scan)
        away = np.hypot(*(pose[:2] - before.progress_position))
        late = time - before.progress_time > choices.STUCK_TIME
        if self.state.roadmap is not before.roadmap and len(before.path) and late and away < choices.STUCK_DISTANCE:
            self.causes.append(cause(inputs, self._radius))
        return desired


def cause(inputs: ControllerInputs, radius: float) -> str:
    """Which of CAUSES holds a robot of this radius (m) that is stuck on its way to the first way point."""
    position, target, hits = inputs.pose[:2], inputs.guidance.path[0], inputs.star.near_hits
    if len(hits) and np.hypot(*(hits - target).T).min() < radius:
        return "midpoint"
    if len(hits) and blend_share(np.hypot(*(hits - position).T).min() - radius) >= BLENDED:
        return "blend"
    vector = target - position
    modulated = modulated_vector(position, vector, inputs.guidance.regions)
    return "modulation" if modulated @ vector < DAMPED * (vector @ vector) else "other"


def traced(name: str, seed: int) -> tuple[str, str, list[str]]:
    """Scenario, outcome and causes of one trial."""
    scenario = load_scenario(name, method="star_paper")
    method = Traced(scenario, cached_world(scenario, seed))
    return name, drive(scenario, seed, method)[0], method.causes


def table(results: list[tuple[str, str, list[str]]]) -> str:
    """A row for each scenario and outcome: trials, and how often a trial was stuck for each cause."""
    rows = []
    for name, outcome in sorted({(name, outcome) for name, outcome, _ in results}):
        causes = [found for *key, found in results if key == [name, outcome]]
        counts = Counter(cause for found in causes for cause in found)
        rows.append([name, outcome, str(len(causes)), *(f"{counts[cause] / len(causes):.1f}" for cause in CAUSES)])
    return markdown_table(["scenario", "outcome", "trials", *(f"stuck by {cause}" for cause in CAUSES)], rows)


def main() -> None:
    """Run the trials and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=50, help="of each scenario; default: 50")
    parser.add_argument("--seed", type=int, default=1000, help="of the batch; default: 1000")
    parser.add_argument("--jobs", type=int, default=1, help="processes; default: 1")
    options = parser.parse_args()
    seeds = [trial_seed(options.seed, k) for k in range(options.trials)]
    with ProcessPoolExecutor(options.jobs) as pool:
        results = [found for name in WITH_ROADMAP for found in pool.map(traced, repeat(name), seeds)]
    print(table(results))
    print(*(f"{name}: {text}" for name, text in CAUSES.items() if text), sep="\n")


if __name__ == "__main__":
    main()
