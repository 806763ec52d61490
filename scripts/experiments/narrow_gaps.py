"""Whether robots that are no discs get through gaps narrower than they turn, and back out of dead ends.

Gaps in walls and between trees, approached from anywhere on one side; and pockets little wider than the robot, which
stands in them head first, with its goal behind it.

Run: python scripts/experiments/narrow_gaps.py [--gaps N] [--dead-ends N] [--seed S] [--out FILE]
"""

import argparse
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from drake_starnav.geometry.se2 import transform_points
from drake_starnav.navigation import Parts
from drake_starnav.scenario.scenario_file import parse_scenario
from drake_starnav.simulation.run import run_trial
from drake_starnav.worlds.clearance import compute_body_clearance
from drake_starnav.worlds.outlines import make_rectangle
from drake_starnav.worlds.world import World
from scripts.experiments.experiment import add_case_options, run_cases

SIZES: Mapping[str, tuple[float, float]] = {"jackal": (0.508, 0.43), "carrier": (0.8, 0.5)}
"""Length and width of the shipped robots that are driven, m."""
SPARE = (0.07, 0.23)
"""Gaps are wider than the robot by so much, m."""
POCKET_SPARE = 0.12
"""Pockets are wider than the robot by so much, m."""
FREE_START = 0.03
"""A robot starts no nearer to an obstacle, m."""
TIMEOUT = 120.0
WALLS, TREES, DEAD_ENDS = "wall", "trees", "dead end"


def robot(name: str) -> str:
    """The section `robot` of a scenario, in YAML."""
    length, width = SIZES[name]
    corners = make_rectangle(-0.5 * length, -0.5 * width, 0.5 * length, 0.5 * width)
    return f"{{model: {name}, footprint: {np.asarray(corners).tolist()}}}"


def gap_world(kind: str, name: str, seed: int) -> World:
    """A room cut in two, by a wall with a door or a row of trees, with the robot on one side and the goal on the other.

    The whole is turned, so that nothing lies along an axis.
    """
    rng = np.random.default_rng([seed, len(kind)])
    gap = SIZES[name][1] + rng.uniform(*SPARE)
    turn = np.array((0.0, 0.0, rng.uniform(-math.pi, math.pi)))
    thick, size = rng.uniform(0.05, 0.4), rng.uniform(0.1, 0.4)
    outer = [(-3.2, -2.7, -3.0, 2.7), (3.0, -2.7, 3.2, 2.7), (-3.2, -2.7, 3.2, -2.5), (-3.2, 2.5, 3.2, 2.7)]
    cylinders = []
    if kind == WALLS:
        outer += [(0.0, 0.5 * gap, thick, 2.6), (0.0, -2.6, thick, -0.5 * gap)]
    else:
        for k in range(math.ceil(2.5 / (2.0 * size + 0.15))):
            away = 0.5 * gap + size + k * (2.0 * size + 0.15)
            cylinders += [(*transform_points(turn, np.array(((0.0, side * away),)))[0], size) for side in (1.0, -1.0)]
    walls = tuple(transform_points(turn, np.asarray(make_rectangle(*box))) for box in outer)
    goal = transform_points(turn, np.array(((2.0, rng.uniform(-1.5, 1.5)),)))[0]
    while True:
        place = np.array((rng.uniform(-2.6, -0.3), rng.uniform(-2.0, 2.0), rng.uniform(-math.pi, math.pi)))
        start = (*transform_points(turn, place[None, :2])[0], place[2] + turn[2])
        world = World(kind, start, tuple(goal), cylinders=np.array(cylinders), polygons=walls)
        if starts_free(world, name):
            return world


def dead_end_world(name: str, seed: int) -> World:
    """A room with a pocket in which the robot stands head first."""
    rng = np.random.default_rng([seed, len(DEAD_ENDS)])
    (length, width), turn = SIZES[name], np.array((0.0, 0.0, rng.uniform(-math.pi, math.pi)))
    half, deep = 0.5 * (width + POCKET_SPARE), length + rng.uniform(0.3, 0.9)
    boxes = [(-4.2, -2.2, -4.0, 2.2), (-4.0, 2.0, deep + 0.1, 2.2), (-4.0, -2.2, deep + 0.1, -2.0)]
    boxes += [(0.0, half, deep + 0.1, 2.1), (0.0, -2.1, deep + 0.1, -half), (deep, -half, deep + 0.1, half)]
    walls = tuple(transform_points(turn, np.asarray(make_rectangle(*box))) for box in boxes)
    goal = transform_points(turn, np.array(((-3.2, rng.uniform(-1.4, 1.4)),)))[0]
    while True:
        x, y, yaw = deep - 0.5 * length - rng.uniform(0.05, 0.2), rng.uniform(-0.02, 0.02), rng.uniform(-0.04, 0.04)
        start = (*transform_points(turn, np.array(((x, y),)))[0], yaw + turn[2])
        world = World(DEAD_ENDS, start, tuple(goal), polygons=walls)
        if starts_free(world, name):
            return world


def starts_free(world: World, name: str) -> bool:
    """Whether the robot stands clear at the start."""
    shape = parse_scenario(f"world: !Forest {{}}\nrobot: {robot(name)}", name=name).robot.shape
    return bool(compute_body_clearance(world, np.array((world.start,)), shape)[0] > FREE_START)


def measured(case: tuple[str, str, int]) -> dict[str, Any]:
    """The record of one trial of a robot in the world of a kind and a seed."""
    kind, name, seed = case
    world = dead_end_world(name, seed) if kind == DEAD_ENDS else gap_world(kind, name, seed)
    scenario = parse_scenario(
        f"world: !Forest {{}}\nrobot: {robot(name)}\nsimulation: {{timeout: {TIMEOUT}}}", name=kind
    )
    trial = run_trial(scenario, Parts(world), seed=seed)
    return {
        "kind": kind,
        "robot": name,
        "seed": seed,
        "outcome": trial.outcome,
        "time_s": trial.time_s,
        "min_clearance_m": trial.min_clearance_m,
        "plan": trial.plan,
    }


def report(records: list[dict[str, Any]]) -> str:
    """What was found, a line for each kind and robot."""
    lines = []
    for kind, name in sorted({(r["kind"], r["robot"]) for r in records}):
        some = [r for r in records if (r["kind"], r["robot"]) == (kind, name)]
        times = [r["time_s"] for r in some if r["outcome"] == "reached"] or [math.nan]
        lines.append(
            f"{kind}, {name}: {sum(r['outcome'] == 'reached' for r in some)} of {len(some)} reached, "
            f"{sum(r['min_clearance_m'] <= 0.0 for r in some)} contacts, least clearance "
            f"{1e3 * min(r['min_clearance_m'] for r in some):.1f} mm, time median {np.median(times):.1f} s, "
            f"most {max(times):.1f} s"
        )
    return "\n".join(lines)


def main(options: argparse.Namespace) -> None:
    """Run the trials, write their records, print the report."""
    cases = [(kind, name, options.seed + k) for name in SIZES for kind in (WALLS, TREES) for k in range(options.gaps)]
    cases += [(DEAD_ENDS, name, options.seed + k) for name in SIZES for k in range(options.dead_ends)]
    print(report(run_cases(measured, cases, options)))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--gaps", type=int, default=50, metavar="N", help="of each kind and robot; default: 50")
    parser.add_argument("--dead-ends", type=int, default=30, metavar="N", help="of each robot; default: 30")
    add_case_options(parser)
    main(parser.parse_args())
