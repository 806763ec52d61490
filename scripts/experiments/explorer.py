"""Compare the ways of recorded trials with those of an optimistic explorer: a reference beside the shortest path.

The explorer follows the shortest path through all that it has not seen to be blocked. It turns and stops at once and
sees every surface in range exactly. What separates the package from it is perception, roadmap and motion.

Run: python scripts/experiments/explorer.py trials.jsonl --scenario maze
"""

import argparse
import math
import statistics
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from tqdm import tqdm

from drake_starnav.cli.options import run_command
from drake_starnav.errors import StarnavError
from drake_starnav.evaluation.summary import markdown_table
from drake_starnav.evaluation.trial_file import read_trials
from drake_starnav.geometry.compiled import kernel
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.planning.bucket_search import bucket_dijkstra
from drake_starnav.planning.cost_field import CostField
from drake_starnav.planning.distance_grid import DistanceGrid
from drake_starnav.scenario.scenario_file import parse_scenario
from drake_starnav.worlds import World, make_world
from drake_starnav.worlds.view import scan_from, visible_shapes

CELL = 0.05
"""Cell size of the explorer's grid, m."""
SLACK = 0.02
"""A cell counts as free up to this much nearer to a hit than the robot's radius, m: cells lie beside a tight way."""
FREE = 10
"""Weight of a free cell, as `bucket_dijkstra` takes it."""
BEAMS = 720
"""Beams of the explorer's scans."""
STEP = 0.1
"""The explorer looks around after each step of this length, m."""
BORDER = 1.0
"""The grid reaches this far beyond the world, m."""
LONGEST_WAY = 1000.0
"""An explorer that has driven so far is lost, m."""
NOTABLE = 1.15
"""Trials are listed whose way is longer than the explorer's by more than this factor."""


def explored_way(world: World, robot_radius: float, goal_tolerance: float, range_max: float) -> np.ndarray:
    """The explorer's way to within `goal_tolerance` of the goal, shape (k, 2), W, m.

    Hits only ever close cells. A shortest path thus remains the shortest until hits close it, and only then the
    explorer searches again. It drives towards the farthest cell of the path in straight reach.

    Args:
        world: unknown to the explorer except for its extent, start and goal.
        robot_radius: m.
        goal_tolerance: m.
        range_max: of the explorer's sensor, m.

    Raises:
        StarnavError: the explorer does not arrive.
    """
    shapes, lidar = visible_shapes(world), LidarParameters(beams=BEAMS, range_max=range_max, noise=0.0)
    position, goal = np.array([world.start[:2], world.goal], dtype=float)
    x0, y0, x1, y1 = world.extent
    origin = np.minimum((x0, y0), np.minimum(position, goal)) - BORDER
    size = np.maximum((x1, y1), np.maximum(position, goal)) + BORDER - origin
    weight = np.zeros(np.ceil(size / CELL).astype(int) + 1, np.int32)
    weight[1:-1, 1:-1] = FREE
    way, path, driven = [position], np.zeros((0, 2)), 0.0
    while np.hypot(*(goal - position)) > goal_tolerance:
        pose = np.array((*position, 0.0))
        _close_cells(weight, (scan_from(shapes, pose, lidar).points(pose) - origin) / CELL, robot_radius - SLACK)
        last = _last_in_reach(weight, (position - origin) / CELL, (path - origin) / CELL)
        if last < 0:
            path = _shortest_path(weight, origin, position, goal)
            if not len(path) or driven > LONGEST_WAY:
                raise StarnavError(
                    f"explorer: no way to the goal of {world.name} after {driven:.1f} m; allowed: a world that a robot "
                    f"of radius {robot_radius:g} m can cross"
                )
            last = _last_in_reach(weight, (position - origin) / CELL, (path - origin) / CELL)
            last = last if last >= 0 else 1  # from beside a closed cell
        path = path[last:]
        length = float(np.hypot(*(path[0] - position)))
        position = position + (path[0] - position) * min(STEP / max(length, 1e-9), 1.0)
        way.append(position)
        driven += min(STEP, length)
    return np.array(way)


def _shortest_path(weight: np.ndarray, origin: np.ndarray, position: np.ndarray, goal: np.ndarray) -> np.ndarray:
    """Cells of a shortest path from near the position, then the goal, shape (k, 2), W, m; none if there is no way."""
    start, end = np.rint((position - origin) / CELL).astype(int), np.rint((goal - origin) / CELL).astype(int)
    cost = np.zeros(weight.shape, np.int32)
    bucket_dijkstra(weight, cost, tuple(end.tolist()), tuple(start.tolist()))
    no_hits = DistanceGrid.empty(0.5 * CELL, 0.0)
    path = CostField(cost, weight, origin + CELL, CELL, no_hits).path(position)
    return np.vstack((path, goal)) if len(path) else path


@kernel
def _close_cells(weight, hits, radius):
    """Close all cells whose centre is nearer than `radius` (m) to a hit; hits of shape (n, 2) in cells."""
    reach = radius / CELL
    for n in range(len(hits)):
        x, y = hits[n]
        for i in range(max(math.ceil(x - reach), 0), min(math.floor(x + reach) + 1, weight.shape[0])):
            for j in range(max(math.ceil(y - reach), 0), min(math.floor(y + reach) + 1, weight.shape[1])):
                if (i - x) ** 2 + (j - y) ** 2 < reach * reach:
                    weight[i, j] = 0


@kernel
def _last_in_reach(weight, position, path):
    """Index of the last place of a path to which a straight line leads through free cells.

    -1 if there is none, or if a cell of the path is closed; position of shape (2,) and path of shape (n, 2) in cells.
    """
    for k in range(len(path)):
        if weight[round(path[k, 0]), round(path[k, 1])] == 0:
            return -1
    for k in range(len(path) - 1, -1, -1):
        dx, dy = path[k, 0] - position[0], path[k, 1] - position[1]
        count = int(2.0 * math.hypot(dx, dy)) + 1
        clear = True
        for m in range(1, count + 1):
            if weight[round(position[0] + dx * m / count), round(position[1] + dy * m / count)] == 0:
                clear = False
                break
        if clear and (k > 0 or math.hypot(dx, dy) > 1e-6):
            return k
    return -1


def main(arguments: Sequence[str] | None = None) -> int:
    """Compare recorded trials with the explorer in their worlds; see `--help`. Returns the exit code."""
    parser = argparse.ArgumentParser(prog="explorer.py", description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("trials", type=Path, metavar="FILE", help="written by benchmark.py --json")
    parser.add_argument("--scenario", default="maze", help="of the trials that are compared (default: %(default)s)")
    return run_command(parser, arguments, report)


def report(options: argparse.Namespace) -> int:
    """Print the comparison."""
    print(comparison(options.trials, options.scenario))
    return 0


def comparison(file: Path, scenario: str) -> str:
    """The trials that reached the goal beside the explorer in the same worlds, as Markdown.

    Raises:
        StarnavError: the file holds no such trial of this scenario, or the explorer does not arrive.
    """
    header, records = read_trials(file)
    cases = [case for case in header["cases"] if case["scenario"] == scenario]
    trials = [r for r in records if r["scenario"] == scenario and r["outcome"] == "reached" and r["shortest_path_m"]]
    if not cases or not trials:
        known = sorted({case["scenario"] for case in header["cases"]})
        raise StarnavError(f"{file}: no trial of {scenario} that reached the goal; allowed: one of {', '.join(known)}")
    declared = parse_scenario(cases[0]["text"], name=scenario)
    radius, range_max = declared.robot.radius, declared.lidar.range_max
    package, explorer, notable = [], [], []
    for trial in tqdm(trials, unit="trial", disable=None, leave=False):
        world = make_world(declared.world, trial["seed"], radius)
        way = explored_way(world, radius, declared.simulation.goal_tolerance, range_max)
        package.append(trial["path_length_m"] / trial["shortest_path_m"])
        explorer.append(float(np.hypot(*np.diff(way, axis=0).T).sum()) / trial["shortest_path_m"])
        if package[-1] > NOTABLE * explorer[-1]:
            notable.append((str(trial["trial"]), str(trial["seed"]), f"{package[-1]:.2f}", f"{explorer[-1]:.2f}"))
    table = markdown_table(
        ("length / shortest path", "trials", "mean", "SPL", "median", "worst"),
        [_row("package", package), _row("explorer", explorer)],
    )
    if not notable:
        return f"{table}\n\nNo way is longer than {NOTABLE:g} times the explorer's."
    return f"{table}\n\nLonger than {NOTABLE:g} times the explorer's:\n\n" + markdown_table(
        ("trial", "seed", "package", "explorer"), notable
    )


def _row(name: str, ratios: list[float]) -> tuple[str, ...]:
    spl = statistics.fmean(min(1.0, 1.0 / ratio) for ratio in ratios)
    figures = (statistics.fmean(ratios), spl, statistics.median(ratios), max(ratios))
    return name, str(len(ratios)), *(f"{figure:.3f}" for figure in figures)


if __name__ == "__main__":
    sys.exit(main())
