"""Whether the planner gives up in time behind gaps that are too narrow, and never where there is a way.

Closed worlds: a goal behind poles, walls or both, with gaps narrower than the robot. Solvable worlds of the tightest
kind: channels, and doors among false ones, for which a grid search finds a way at radius and least margin.

Run: python scripts/experiments/giving_up.py [--closed N] [--solvable N] [--seed S] [--out FILE]
"""

import argparse
import math
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from scipy.ndimage import label

from drake_starnav.geometry.footprint import disc
from drake_starnav.lidar.raycast import Fan, cast_groups
from drake_starnav.navigation import Parts
from drake_starnav.scenario.margins import derive_margins
from drake_starnav.scenario.scenario_file import parse_scenario
from drake_starnav.scenario.schema import Scenario
from drake_starnav.simulation.run import run_trial
from drake_starnav.worlds.clearance import compute_clearance
from drake_starnav.worlds.generators.channel import Channel
from drake_starnav.worlds.outlines import make_rectangle, place
from drake_starnav.worlds.view import visible_shapes
from drake_starnav.worlds.world import World
from scripts.experiments.experiment import add_case_options, run_cases

SCENARIO = parse_scenario("world: !Forest {}", name="giving up")
RADIUS = SCENARIO.robot.radius
LEAST = RADIUS + derive_margins(SCENARIO).least
"""Radius and least margin, m."""
SEARCHED = 0.02
"""Cell size of the grid search, m."""
SEEN_CELL, SEEN_PERIOD, SEEN_SHARE = 0.1, 0.25, 0.99
"""The room counts as seen once this share of the cells of this size, m, that are ever seen has been; looked at so
often, s."""
TIMES_SEEN = 3.0
"""The planner shall give up within so many times the time it takes to see the room."""
CLOSED_TIMEOUT, SOLVABLE_TIMEOUT = 300.0, 120.0
CLOSED, SOLVABLE = ("poles", "walls", "mixture"), ("channel", "false_doors")


def closed_world(kind: str, seed: int) -> World:
    """A goal in an enclosure of poles, of walls with doors, or of both, whose gaps are narrower than the robot."""
    rng = np.random.default_rng([seed, CLOSED.index(kind)])
    while True:
        width, height = rng.uniform(8.0, 12.0), rng.uniform(5.0, 8.0)
        inner = rng.uniform(0.9, min(1.7, 0.5 * height - 1.0))
        center = np.array(
            (rng.uniform(0.55 * width, width - inner - 0.9), rng.uniform(inner + 0.9, height - inner - 0.9))
        )
        sides = 40 if kind == "poles" else int(rng.integers(4, 7))
        corners = center + inner * turned(sides, rng.uniform(0.0, 2.0 * math.pi))
        gap, radius = 2.0 * RADIUS * rng.uniform(0.6, 0.97), rng.uniform(0.02, 0.1)
        poles, walls = [], []
        if kind == "poles":
            count = math.ceil(math.pi / math.asin(min(0.5 * (gap + 2.0 * radius) / inner, 1.0)))
            poles = [(*p, radius) for p in center + inner * turned(count, rng.uniform(0.0, 2.0 * math.pi))]
        else:
            for k, (a, b) in enumerate(zip(corners, np.roll(corners, -1, axis=0), strict=True)):
                poled = kind == "mixture" and k % 2 == 0
                walls += wall_with_door(a, b, gap, 0.1)
                poles += [(*p, radius) for p in (a, b)] if poled else []
        for _ in range(int(rng.integers(0, 5))):
            poles.append((rng.uniform(1.8, width), rng.uniform(0.0, height), rng.uniform(0.05, 0.3)))
        world = World(
            f"closed_{kind}",
            (0.8, 0.5 * height, float(rng.uniform(-math.pi, math.pi))),
            tuple(center),
            cylinders=np.array(poles).reshape(-1, 3),
            polygons=tuple(walls),
            bounds=(0.0, 0.0, width, height),
        )
        ends = np.array((world.start[:2], world.goal))
        if (compute_clearance(world, ends) > RADIUS + 0.1).all() and not has_way(world, RADIUS - SEARCHED):
            return world


def solvable_world(kind: str, seed: int) -> World:
    """A channel, or a room cut in two by a wall with false doors and one that is hardly wider than the robot."""
    rng = np.random.default_rng([seed, len(CLOSED) + SOLVABLE.index(kind)])
    while True:
        spare = rng.uniform(LEAST - RADIUS, 0.035)
        if kind == "channel":
            world = Channel(clearance=spare).make(rng, disc(RADIUS))
        else:
            width, height, thick = rng.uniform(6.0, 9.0), rng.uniform(4.0, 6.0), rng.uniform(0.05, 0.3)
            doors = 2.0 * RADIUS * rng.uniform(0.6, 0.97, int(rng.integers(2, 5)))
            doors[rng.integers(len(doors))] = 2.0 * (RADIUS + spare)
            ends = np.array([(0.5 * width, 0.0), (0.5 * width, height)])
            cuts = np.linspace(0.0, 1.0, len(doors) + 1)
            walls = []
            for low, high, door in zip(cuts[:-1], cuts[1:], doors, strict=True):
                a, b = (ends[0] + share * (ends[1] - ends[0]) for share in (low, high))
                walls += wall_with_door(a, b, door, thick)
            y = rng.uniform(0.8, height - 0.8, 2)
            start = (0.8, y[0], float(rng.uniform(-math.pi, math.pi)))
            world = World(
                "false_doors", start, (width - 0.8, y[1]), polygons=tuple(walls), bounds=(0, 0, width, height)
            )
        if has_way(world, LEAST):
            return world


def turned(count: int, angle: float) -> np.ndarray:
    """So many unit vectors at equal angles from `angle` (rad) on, shape (count, 2)."""
    bearing = angle + 2.0 * math.pi / count * np.arange(count)
    return np.column_stack((np.cos(bearing), np.sin(bearing)))


def wall_with_door(a: np.ndarray, b: np.ndarray, door: float, thick: float) -> list[np.ndarray]:
    """The two parts of a wall from a to b that is `thick`, beside a door in its middle, m."""
    length, angle = float(np.hypot(*(b - a))), math.atan2(*(b - a)[::-1])
    half = 0.5 * (length - door)
    spans = ((-0.5 * thick, half), (length - half, length + 0.5 * thick))
    return [place(make_rectangle(low, -0.5 * thick, high, 0.5 * thick), a, angle) for low, high in spans]


def has_way(world: World, size: float) -> bool:
    """Whether a search of a grid finds a way from start to goal for a disc of radius `size`, m."""
    x0, y0, x1, y1 = world.extent
    x, y = np.arange(x0, x1, SEARCHED), np.arange(y0, y1, SEARCHED)
    points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
    free = (compute_clearance(world, points.reshape(-1, 2)) >= size).reshape(points.shape[:2])
    parts = label(free, np.ones((3, 3)))[0]
    cells = [tuple(np.rint((np.array(end) - (x0, y0)) / SEARCHED).astype(int)) for end in (world.start[:2], world.goal)]
    return bool(parts[cells[0]] and parts[cells[0]] == parts[cells[1]])


def time_to_see(world: World, scenario: Scenario, states: np.ndarray) -> float:
    """When the share SEEN_SHARE of all that is ever seen had been seen; states of shape (n, k): t, x, y, yaw, ..."""
    x0, y0, x1, y1 = world.extent
    cells = np.stack(np.meshgrid(np.arange(x0, x1, SEEN_CELL), np.arange(y0, y1, SEEN_CELL)), axis=-1).reshape(-1, 2)
    when, shapes, lidar = np.full(len(cells), np.inf), visible_shapes(world), scenario.lidar
    step, fan = lidar.angle_increment, Fan.regular(lidar.angle_min, lidar.angle_increment, lidar.beams)
    for time in np.arange(0.0, states[-1, 0] + SEEN_PERIOD, SEEN_PERIOD):
        pose = states[min(np.searchsorted(states[:, 0], time), len(states) - 1), 1:4]
        ranges = np.full(lidar.beams, lidar.range_max)
        cast_groups(tuple(shapes), pose[None], tuple(fan), ranges, lidar.range_max)
        offset = cells - pose[:2]
        beam = np.rint((np.arctan2(offset[:, 1], offset[:, 0]) - pose[2] - lidar.angle_min) / step).astype(int)
        seen = np.hypot(*offset.T) < ranges[beam % lidar.beams]
        when[seen] = np.minimum(when[seen], time)
    seen_at = np.sort(when[np.isfinite(when)])
    return max(float(seen_at[math.ceil(SEEN_SHARE * len(seen_at)) - 1]), SEEN_PERIOD)


def measured(case: tuple[str, int]) -> dict[str, Any]:
    """The record of one trial in the world of a kind and a seed."""
    kind, seed = case
    is_closed = kind in CLOSED
    world = closed_world(kind, seed) if is_closed else solvable_world(kind, seed)
    timeout = CLOSED_TIMEOUT if is_closed else SOLVABLE_TIMEOUT
    scenario = parse_scenario(f"world: !Forest {{}}\nsimulation: {{timeout: {timeout}}}", name=kind)
    with TemporaryDirectory() as folder:
        states = Path(folder, "states.csv")
        trial = run_trial(scenario, Parts(world), seed=seed, csv=states)
        driven = np.loadtxt(states, delimiter=",", skiprows=1)
    return {
        "kind": kind,
        "seed": seed,
        "closed": is_closed,
        "outcome": trial.outcome,
        "time_s": trial.time_s,
        "seen_s": time_to_see(world, scenario, driven),
        "path_m": trial.path_length_m,
        "min_clearance_m": trial.min_clearance_m,
    }


def report(records: list[dict[str, Any]]) -> str:
    """What was found, in a few lines."""
    lines = []
    closed = [r for r in records if r["closed"]]
    given_up = [r for r in closed if r["outcome"] == "unreachable"]
    late = [r for r in given_up if r["time_s"] > TIMES_SEEN * r["seen_s"]]
    if closed:
        lines.append(f"closed: {len(given_up)} of {len(closed)} given up, {len(late)} of them late")
    if given_up:
        times, ratios = [r["time_s"] for r in given_up], [r["time_s"] / r["seen_s"] for r in given_up]
        lines.append(f"  time: median {np.median(times):.1f} s, most {max(times):.1f} s")
        lines.append(f"  time / time to see the room: median {np.median(ratios):.2f}, most {max(ratios):.2f}")
    solvable = [r for r in records if not r["closed"]]
    if solvable:
        counts = Counter(r["outcome"] for r in solvable)
        lines.append(f"solvable: {len(solvable)}, " + ", ".join(f"{n} {name}" for name, n in sorted(counts.items())))
    wrong = [r for r in records if r["outcome"] != ("unreachable" if r["closed"] else "reached")]
    lines += [f"  {r['kind']} {r['seed']}: {r['outcome']} after {r['time_s']:.1f} s" for r in wrong]
    lines += [f"  {r['kind']} {r['seed']}: late, {r['time_s']:.1f} s of {r['seen_s']:.1f} s" for r in late]
    return "\n".join(lines)


def main(options: argparse.Namespace) -> None:
    """Run the trials, write their records, print the report."""
    cases = [(CLOSED[k % len(CLOSED)], options.seed + k) for k in range(options.closed)]
    cases += [(SOLVABLE[k % len(SOLVABLE)], options.seed + k) for k in range(options.solvable)]
    print(report(run_cases(measured, cases, options)))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--closed", type=int, default=60, metavar="N", help="closed worlds; default: 60")
    parser.add_argument("--solvable", type=int, default=200, metavar="N", help="solvable worlds; default: 200")
    add_case_options(parser)
    main(parser.parse_args())
