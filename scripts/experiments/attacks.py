"""Attack a robot with `obstacles.caution: 1` where its guarantee is hardest to keep, and count what it runs into.

Rows: persons stand side by side beside its way, with nothing else in view; one walks off into the way at the declared
speed. Ranges: a disc comes at the declared speed, and the lidar sees no farther than the least range that is admitted
with late scans, late commands or slow scans.

Run: python scripts/experiments/attacks.py --cases 60 --out out/attacks.jsonl
"""

import argparse
import dataclasses
import json
import math
import multiprocessing
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from drake_starnav import Parts, Scenario, World, load_scenario, run_trial
from drake_starnav.scenario.error_budget import error_budget
from drake_starnav.scenario.margins import derive_margins
from drake_starnav.utils.files import write_text
from drake_starnav.worlds.moving_obstacles import MovingObstacles

BOUNDS = (-30.0, -30.0, 50.0, 30.0)
GOAL = (12.0, 0.0)
TIMEOUT = 20.0
END = 100.0
"""When paths end, s."""


def row_of_persons(rng: np.random.Generator) -> tuple[Scenario, World]:
    """Three to six persons in a row, of which an end one walks to where the robot will be."""
    scenario = _declared(["lidar.range_max=10"], rng.uniform(0.5, 1.5))
    radius, gap, count = rng.uniform(0.15, 0.35), rng.uniform(0.0, 0.15), int(rng.integers(3, 7))
    angle = rng.uniform(-math.pi, math.pi)
    along = (2.0 * radius + gap) * np.array((math.cos(angle), math.sin(angle)))
    side, off = rng.choice((-1.0, 1.0)), 0.25 + radius + rng.uniform(0.1, 1.0)
    outwards = along * (side if along[1] >= 0.0 else -side)
    places = np.array((rng.uniform(3.0, 8.0), side * off)) + np.arange(count)[:, None] * outwards
    start, way = _attack(scenario, places[0], rng)
    paths = [_standing(place) for place in places[1:]]
    return scenario, _world([_walk(start, places[0], way, scenario), *paths], np.full(count, radius))


def shortest_range(rng: np.random.Generator) -> tuple[Scenario, World]:
    """A disc comes from out of range, as the lidar sees just far enough."""
    speed = rng.uniform(0.2, 1.5)
    changes = [
        f"robot.max_speed={rng.uniform(0.5, 1.5)}",
        f"robot.max_acceleration={rng.uniform(1.0, 3.0)}",
        f"lidar.rate={rng.choice((5.0, 10.0, 20.0))}",
        f"lidar.delay={rng.choice((0.0, 0.1, 0.3))}",
        f"drive.delay={rng.choice((0.0, 0.05, 0.2))}",
        f"controller.rate={rng.choice((20.0, 50.0))}",
        "lidar.beams=720",
    ]
    scenario = _declared(changes, speed)
    least = scenario.robot.radius + derive_margins(scenario).preferred + error_budget(scenario).symbols["F"]
    scenario = dataclasses.replace(scenario, lidar=dataclasses.replace(scenario.lidar, range_max=least + 1e-6))
    angle, distance = rng.uniform(-1.2, 1.2), rng.uniform(6.0, 12.0)
    place = np.array((6.0, 0.0)) + distance * np.array((math.cos(angle), math.sin(angle)))
    start, way = _attack(scenario, place, rng)
    return scenario, _world([_walk(start, place, way, scenario)], rng.uniform(0.15, 0.5, 1))


KINDS = {"rows": row_of_persons, "ranges": shortest_range}


def _declared(changes: list[str], speed: float) -> Scenario:
    return load_scenario("room", overrides=[*changes, f"obstacles.max_speed={speed}", "obstacles.caution=1"])


def _attack(scenario: Scenario, place: np.ndarray, rng: np.random.Generator) -> tuple[float, np.ndarray]:
    """When to start from a place, s, and in which direction, to meet a robot that drives straight to its goal."""
    robot, speed = scenario.robot, scenario.obstacles.max_speed
    gaining = robot.max_speed / robot.max_acceleration
    when = max(rng.uniform(2.0, 8.0), gaining)
    there = np.array((robot.max_speed * (when - 0.5 * gaining), 0.0)) - place
    away = math.hypot(*there)
    return max(when - away / speed + rng.uniform(-0.3, 0.1), 0.0), there / max(away, 1e-9)


def _walk(start: float, place: np.ndarray, way: np.ndarray, scenario: Scenario) -> np.ndarray:
    """Way points of a disc that stands until it walks straight on."""
    speed = scenario.obstacles.max_speed * (1.0 - 1e-6)
    rows = [(0.0, *place)] if start > 0.0 else []
    return np.array([*rows, (start, *place), (END, *(place + speed * (END - start) * way))])


def _standing(place: np.ndarray) -> np.ndarray:
    return np.array([(0.0, *place), (END, *place)])


def _world(paths: list[np.ndarray], radii: np.ndarray) -> World:
    moving = MovingObstacles(radii, tuple(paths))
    return World("attack", (0.0, 0.0, 0.0), GOAL, bounds=BOUNDS, timeout=TIMEOUT, moving_obstacles=moving)


def tried(case: tuple[str, int]) -> dict:
    """The record of one case: its kind and seed, and how the drive ended."""
    kind, seed = case
    scenario, world = KINDS[kind](np.random.default_rng((list(KINDS).index(kind), seed)))
    trial = run_trial(scenario, Parts(world), seed=seed)
    figures = {"outcome": trial.outcome, "time_s": trial.time_s, "min_clearance_m": round(trial.min_clearance_m, 4)}
    return {"kind": kind, "seed": seed, **figures}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the attacks; see `--help`. Returns 1 if the robot has run into anything."""
    parser = argparse.ArgumentParser(prog="attacks.py", description="Attack a robot that is as cautious as can be.")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS), help="default: all")
    parser.add_argument("--cases", type=int, default=60, help="of each kind (default: 60)")
    parser.add_argument("--seed", type=int, default=0, help="of the first case (default: 0)")
    parser.add_argument("--jobs", type=int, default=2, help="processes (default: 2)")
    parser.add_argument("--out", type=Path, default=Path("out/attacks.jsonl"), help="a line for each case")
    options = parser.parse_args(arguments)
    cases = [(kind, options.seed + k) for kind in options.kinds for k in range(options.cases)]
    with multiprocessing.get_context("spawn").Pool(options.jobs) as pool:
        records = pool.map(tried, cases, chunksize=1)
    write_text(options.out, "".join(json.dumps(record) + "\n" for record in records))
    for kind in options.kinds:
        outcomes = [record["outcome"] for record in records if record["kind"] == kind]
        counts = ", ".join(f"{name} {outcomes.count(name)}" for name in sorted(set(outcomes)))
        print(f"{kind}: {len(outcomes)} cases: {counts}")
    return int(any(record["outcome"] == "collision" for record in records))


if __name__ == "__main__":
    sys.exit(main())
