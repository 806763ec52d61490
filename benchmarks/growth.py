"""How the cost of a drive grows with the sensor, the robot and the world, as a Markdown table.

Run in the checkout: python -m benchmarks.growth [--only lidar robot] [--trials 3]

The drives of a table take turns in one process, seed by seed, so that all see the same load of the machine. Its first
row is what the others are compared with. The time is the CPU time of whole trials per simulated second, from the start
of the simulator on, as `python -m benchmarks.whole` measures it.
"""

import argparse
import tempfile
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np
import trimesh

from benchmarks.whole import FIRST_SEED, timed
from drake_starnav import Scenario, Trial, load_scenario, parse_scenario, run_trial
from drake_starnav.evaluation.summary import format_markdown_table
from drake_starnav.simulation.robots import run_robots

WORLDS = ("forest", "maze", "room")
RECTANGLE = "[[0.254, 0.215], [-0.254, 0.215], [-0.254, -0.215], [0.254, -0.215]]"
BAR = "[[0.12, 0.215], [-0.25, 0.215], [-0.25, -0.215], [0.12, -0.215]]"
L = f"[{BAR}, [[0.35, 0.215], [0.12, 0.215], [0.12, 0.05], [0.35, 0.05]]]"
VARIED = {
    "lidar": {
        "360 beams": "",
        "720 beams": "lidar.beams=720",
        "1,440 beams": "lidar.beams=1440",
        "rolling": "lidar.rolling=true",
        "1 % outliers": "lidar.outliers=0.01",
        "drift of 2 %, scans matched": "localization.drift=0.02",
    },
    "robot": {
        "disc": "",
        "rectangle": f"robot.footprint={RECTANGLE}",
        "L": f"robot.footprint={L}",
        "car": "robot.base=car",
    },
    "corridor": {f"{length} m": f"world.length={length}" for length in (30, 100, 300)},
    "crowd_room": {f"{count} movers": f"world.moving_obstacles=[{count}, {count}]" for count in (1, 5, 10, 20)},
}
"""Tables of scenarios that each row sets something in: in the one of the table's name, or else in `WORLDS`."""
TABLES = (*VARIED, "six_robots", "triangles")
LIDAR = 0.13
"""Height of the lidar's plane, m."""


@dataclass
class Costs:
    """What the trials of a row cost.

    Attributes:
        scenarios: one for each kind of world.
        spent: of each trial, simulated time, s, and CPU time per simulated second, ms.
        trials: all of them.
    """

    scenarios: list[Scenario]
    spent: list[tuple[float, float]] = field(default_factory=list)
    trials: list[Trial] = field(default_factory=list)

    @property
    def ms(self) -> float:
        """CPU time per simulated second, ms."""
        times, costs = np.transpose(self.spent)
        return float(np.average(costs, weights=times))

    def figures(self, first: float) -> tuple[str, ...]:
        """The cells of its row; `first` is what the first row costs, ms."""
        scan = 1e6 * np.median([each.scan["p50_s"] for each in self.trials])
        nodes, reached = max(each.nodes for each in self.trials), sum(each.outcome == "reached" for each in self.trials)
        ended = f"{reached} of {len(self.trials)}"
        return f"{self.ms:.1f}", f"{self.ms / first:.2f}", f"{scan:.0f}", f"{nodes}", ended

    def drive(self, kind: int, seed: int) -> None:
        """Drive one more trial of a scenario, or one of each of its robots."""
        scenario = self.scenarios[kind]
        if scenario.robots:
            found, ms, _ = timed(partial(run_robots, scenario, seed=seed))
            trials = [each.trial for each in found]
        else:
            trial, ms, _ = timed(partial(run_trial, scenario, seed=seed))
            trials = [trial]
        self.spent.append((max(each.time_s for each in trials), ms))
        self.trials += trials


def balls(folder: Path, subdivisions: int) -> Scenario:
    """A field of 20 balls at the height of the lidar, each a mesh of 20 * 4^`subdivisions` triangles of equal size."""
    ball = trimesh.creation.icosphere(subdivisions, 0.4)
    places = [(2.0 + 2.0 * i, 2.2 * j - 4.0 + 1.1 * (i % 2), LIDAR) for i in range(5) for j in range(4)]
    mesh = trimesh.util.concatenate([ball.copy().apply_translation(place) for place in places])
    name = f"{len(mesh.faces):,} triangles"
    mesh.export(folder / f"{name}.stl")
    shape = f'<collision><geometry><mesh filename="{name}.stl"/></geometry></collision>'
    (folder / f"{name}.urdf").write_text(f'<robot name="field"><link name="field">{shape}</link></robot>')
    return parse_scenario(f"world: !Model {{directives: '{name}.urdf', goal: [12, 0.5]}}", name=name, folder=folder)


def scenarios(table: str, folder: Path) -> dict[str, list[Scenario]]:
    """The scenarios of each row of a table; files go into the folder."""
    if table == "triangles":
        return {each.name: [each] for each in (balls(folder, k) for k in range(1, 5))}
    if table == "six_robots":
        six = load_scenario(table, overrides=["simulation.timeout=12"])
        return {f"the first {k}": [replace(six, robots=six.robots[:k])] for k in range(1, len(six.robots) + 1)}
    names = WORLDS if table in ("lidar", "robot") else (table,)
    return {
        row: [load_scenario(name, overrides=[override] * bool(override)) for name in names]
        for row, override in VARIED[table].items()
    }


def measure(name: str, rows: dict[str, list[Scenario]], trials: int) -> str:
    """Drive the trials of a table, after a round that compiles what they take, and return it."""
    costs: dict[str, Costs] = {}
    for k in range(-1, trials):
        costs = {row: costs[row] if k > 0 else Costs(scenarios) for row, scenarios in rows.items()}
        for kind in range(len(next(iter(rows.values())))):
            for cost in list(costs.values())[:: 1 - 2 * (k % 2)]:
                cost.drive(kind, FIRST_SEED + max(k, 0))
    first = next(iter(costs.values())).ms
    head = (name, "ms per simulated second", "of the first", "scan, us", "nodes", "reached")
    return format_markdown_table(head, [(row, *cost.figures(first)) for row, cost in costs.items()])


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=TABLES, default=TABLES, help="these tables")
    parser.add_argument("--trials", type=int, default=3, help="of each kind of world (default: 3)")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for name in options.only:
            print(measure(name, scenarios(name, Path(folder)), options.trials), end="\n\n", flush=True)


if __name__ == "__main__":
    main()
