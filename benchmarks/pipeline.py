"""Time each step of the pipeline, and its command beside that of the FOA baseline.

Run in the checkout: python -m benchmarks.pipeline [--seconds 10] [--rounds 3]

A robot without dynamics drives through a forest, a maze and a room. The inputs of its steps are kept and processed
again. Plans are timed during the drive, since a roadmap grows cheaply only at its end.
"""

import argparse
import math
import time
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from benchmarks.kinematic_drive import (
    COMMANDS,
    LIDAR,
    MARGINS,
    ROBOT,
    CommandMoment,
    Drive,
    command,
    drive,
    safety,
    scan_processing,
)
from drake_starnav.baselines.foa import foa_velocity
from drake_starnav.planning import StarRoadmap
from drake_starnav.planning.cost_field import CostField, Terrain, cost_to_go
from drake_starnav.robot import BASES
from drake_starnav.robot.limits import HEADING_GAIN
from drake_starnav.safety.shield import ramped_twist
from drake_starnav.surroundings.erosion import free_range, smoothed_distances
from drake_starnav.surroundings.piecewise_cubic import fit_piecewise_cubic
from drake_starnav.worlds import Forest, Maze, Room, make_world


def foa_command(moment: CommandMoment) -> np.ndarray:
    """The FOA baseline's twist: hit points, modulation towards the short-term goal, heading law."""
    points = moment.scan.points(moment.scan_pose)
    to_goal = moment.guidance.path[0] - moment.pose[:2]
    nominal = ROBOT.max_speed * to_goal / max(math.hypot(*to_goal), 1e-9)
    velocity = foa_velocity(moment.pose[:2], nominal, points, control_radius=ROBOT.radius)
    turn = math.atan2(velocity[1], velocity[0]) - moment.pose[2]
    heading = (turn + math.pi) % (2.0 * math.pi) - math.pi
    desired = np.array((math.hypot(*velocity) * max(math.cos(heading), 0.0) ** 3, HEADING_GAIN * heading))
    return np.array(ramped_twist(moment.twist, BASES["differential"].saturated(desired, ROBOT.limits), COMMANDS))


def cost_arguments(roadmap: StarRoadmap, goal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners of the box that a plan's cost-to-go searches."""
    border = LIDAR.range_max + 0.5
    corners = np.vstack((roadmap.union.center, goal[None, :]))
    return corners.min(axis=0) - border, corners.max(axis=0) + border


def whole_cost(roadmap: StarRoadmap, goal: np.ndarray) -> CostField:
    """The cost-to-go of all cells, without the early end that a plan allows itself."""
    return cost_to_go(roadmap.hits, goal, *cost_arguments(roadmap, goal), Terrain(ROBOT.radius))


def steps(kept: Drive) -> dict[str, list[Callable[[], object]]]:
    """The steps at the moments of a drive."""
    erosion: list[Callable[[], object]] = []
    fit, safe = list(erosion), list(erosion)
    for moment in kept.scans:
        distance = smoothed_distances(moment.scan)
        erode = partial(free_range, moment.scan, distance, ROBOT.radius, MARGINS)
        erosion.append(erode)
        fit.append(partial(fit_piecewise_cubic, erode().values, ROBOT.radius))
        safe.append(partial(safety, moment, distance))
    return {
        "erosion": erosion,
        "fit": fit,
        "certified region": safe,
        "whole scan": [partial(scan_processing, moment) for moment in kept.scans],
        "command": [partial(command, moment) for moment in kept.commands],
        "cost-to-go": [partial(whole_cost, *known) for known in kept.roadmaps],
    }


def interleaved(calls: Sequence[tuple[Callable[[], object], ...]], rounds: int) -> np.ndarray:
    """Times of alternatives in turn, shape (alternatives, rounds * moments), s."""
    seconds = []
    for _ in range(rounds):
        for alternatives in calls:
            row = []
            for call in alternatives:
                begin = time.perf_counter()
                call()
                row.append(time.perf_counter() - begin)
            seconds.append(row)
    return np.array(seconds).T


def percentiles(seconds: np.ndarray) -> tuple[float, float]:
    """p50 and p99, us."""
    p50, p99 = 1e6 * np.percentile(seconds, (50, 99))
    return float(p50), float(p99)


def report_world(name: str, kept: Drive, rounds: int) -> None:
    """Print the rows of one kind of world."""
    for step, calls in steps(kept).items():
        alone = [(call,) for call in calls]
        interleaved(alone[:1], 1)  # compiles
        p50, p99 = percentiles(interleaved(alone, rounds)[0]) if calls else (math.nan, math.nan)
        print(f"| {name} | {step} | {p50:.0f} | {p99:.0f} |")
    p50, p99 = percentiles(np.array([seconds for _, seconds in kept.plans]))
    print(f"| {name} | plan ({len(kept.plans)} searches) | {p50:.0f} | {p99:.0f} |")


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=10.0, help="simulated time of a drive, s (default: 10)")
    parser.add_argument("--rounds", type=int, default=3, help="how often each moment is timed (default: 3)")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    drive(make_world(Room(), options.seed, ROBOT.radius), options.seed, 3.0)  # compiles
    print("| world | step | p50, us | p99, us |")
    print("|---|---|--:|--:|")
    commands = []
    for kind in (Forest(), Maze(), Room()):
        kept = drive(make_world(kind, options.seed, ROBOT.radius), options.seed, options.seconds)
        report_world(type(kind).__name__, kept, options.rounds)
        commands += kept.commands
    calls = [(partial(command, moment), partial(foa_command, moment)) for moment in commands]
    interleaved(calls[:1], 1)  # compiles
    ours, foa = interleaved(calls, options.rounds)
    (p50, p99), (foa_p50, foa_p99) = percentiles(ours), percentiles(foa)
    print(f"\ncommand: p50 {p50:.0f} us, p99 {p99:.0f} us ({p99 / p50:.2f} x p50)")
    print(f"FOA's command: p50 {foa_p50:.0f} us, p99 {foa_p99:.0f} us; command / FOA at p50: {p50 / foa_p50:.2f}")


if __name__ == "__main__":
    main()
