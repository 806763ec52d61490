"""Time each step of the pipeline, beside plain NumPy and the FOA baseline in the same process.

Run in the checkout: python -m benchmarks.pipeline [--seconds 10] [--rounds 3] [--corridor 300]

A robot without dynamics drives through a forest, a maze and a room. The inputs of its steps are kept and processed
again by the package and by `numpy_pipeline.py` in turn, so that both see the same load of the machine. Every result
is compared. Plans are timed during the drive, since a roadmap grows cheaply only at its end.
"""

import argparse
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from benchmarks import numpy_pipeline
from benchmarks.kinematic_drive import (
    COMMANDS,
    CONTROLLER,
    LIDAR,
    MARGINS,
    ROBOT,
    SAFE_RADIUS,
    CommandMoment,
    Drive,
    ScanMoment,
    command,
    drive,
    safety,
    scan_processing,
)
from drake_starnav.baselines.foa import foa_velocity
from drake_starnav.planning import StarRoadmap
from drake_starnav.planning.bucket_search import UNREACHED
from drake_starnav.planning.cost_field import Terrain, cost_to_go
from drake_starnav.robot import BASES
from drake_starnav.robot.limits import HEADING_GAIN
from drake_starnav.safety.shield import ramped_twist
from drake_starnav.surroundings.erosion import free_range, smoothed_distances
from drake_starnav.surroundings.piecewise_cubic import fit_piecewise_cubic
from drake_starnav.surroundings.safe_region import NEAR_HITS
from drake_starnav.worlds import Corridor, Forest, Maze, Room, make_world

TOLERANCE = 1e-9
"""Largest allowed difference between the package and NumPy, in SI units."""
FEW, MANY, AROUND = 50, 400, 0.1
"""Numbers of nodes at which plans are compared, and the relative tolerance for them."""


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


def numpy_scan(moment: ScanMoment) -> tuple[np.ndarray, ...]:
    """`scan_processing` in NumPy: the values of region and certified region, and the near hits."""
    distance = numpy_pipeline.smoothed_distances(moment.scan)
    samples = numpy_pipeline.free_range(moment.scan, distance, ROBOT.radius, MARGINS)
    return numpy_pipeline.adaptive_fit(samples, ROBOT.radius)[1], *numpy_safety(moment, distance)


def numpy_safety(moment: ScanMoment, distance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """`safety` in NumPy: the values of the certified region, and the near hits."""
    values = numpy_pipeline.safety_values(
        moment.before.memory, moment.scan, moment.pose, SAFE_RADIUS, MARGINS.safety_range
    )
    return values, moment.scan.points_at(distance, distance < NEAR_HITS * SAFE_RADIUS, moment.pose)


def package_scan(moment: ScanMoment) -> tuple[np.ndarray, ...]:
    """`scan_processing` with the results that `numpy_scan` has."""
    known = scan_processing(moment)
    assert known.observation.region is not None
    return known.observation.region.boundary.values, known.safety.values, known.safety.near_hits


def package_safety(moment: ScanMoment, distance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """`safety` with the results that `numpy_safety` has."""
    star, _ = safety(moment, distance)
    return star.values, star.near_hits


def package_fit(samples: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The fit with the results that `numpy_pipeline.adaptive_fit` has."""
    fit = fit_piecewise_cubic(samples, ROBOT.radius)
    return fit.starts, fit.values, fit.slopes


def numpy_command(moment: CommandMoment) -> np.ndarray:
    """`command` in NumPy."""
    return numpy_pipeline.command(moment.pose, moment.twist, moment.guidance, moment.star, CONTROLLER, ROBOT)


def cost_arguments(roadmap: StarRoadmap, goal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners of the box that a plan's cost-to-go searches."""
    border = LIDAR.range_max + 0.5
    corners = np.vstack((roadmap.union.center, goal[None, :]))
    return corners.min(axis=0) - border, corners.max(axis=0) + border


def package_cost(roadmap: StarRoadmap, goal: np.ndarray) -> np.ndarray:
    """The cost-to-go of all cells, m, without the early end that a plan allows itself."""
    field = cost_to_go(roadmap.hits, goal, *cost_arguments(roadmap, goal), Terrain(ROBOT.radius))
    return np.where(field.cost < 0, (field.cost + float(UNREACHED)) * (field.cell / 100.0), np.inf)


def numpy_cost(roadmap: StarRoadmap, goal: np.ndarray) -> np.ndarray:
    """`package_cost` by SciPy."""
    box = cost_arguments(roadmap, goal)
    return numpy_pipeline.cost_to_go(roadmap, goal, *box, ROBOT.radius)


@dataclass(frozen=True)
class Step:
    """One step of the pipeline at many moments: pairs of calls with the same result."""

    name: str
    calls: Sequence[tuple[Callable[[], object], Callable[[], object]]]


def steps(kept: Drive) -> list[Step]:
    """All steps that have a reference."""
    erosion, fit, safe, whole = [], [], [], []
    decided = [moment for moment in kept.commands if np.isfinite(numpy_command(moment)).all()]
    for moment in kept.scans:
        scan = moment.scan
        distance = smoothed_distances(scan)
        samples = free_range(scan, distance, ROBOT.radius, MARGINS).values
        erosion.append(
            (
                lambda scan=scan, distance=distance: free_range(scan, distance, ROBOT.radius, MARGINS).values,
                partial(numpy_pipeline.free_range, scan, distance, ROBOT.radius, MARGINS),
            )
        )
        fit.append((partial(package_fit, samples), partial(numpy_pipeline.adaptive_fit, samples, ROBOT.radius)))
        safe.append((partial(package_safety, moment, distance), partial(numpy_safety, moment, distance)))
        whole.append((partial(package_scan, moment), partial(numpy_scan, moment)))
    return [
        Step("erosion", erosion),
        Step("fit", fit),
        Step("certified region", safe),
        Step("whole scan", whole),
        Step("command", [(partial(command, moment), partial(numpy_command, moment)) for moment in decided]),
        Step("cost-to-go", [(partial(package_cost, *known), partial(numpy_cost, *known)) for known in kept.roadmaps]),
    ]


def difference(step: Step) -> float:
    """Largest difference between the two results over all moments; infinity where shapes or infinities differ."""
    worst = 0.0
    for ours, theirs in step.calls:
        pair = (ours(), theirs())
        first, second = (result if isinstance(result, tuple) else (result,) for result in pair)
        for a, b in zip(first, second, strict=True):
            if a.shape != b.shape or not np.array_equal(np.isfinite(a), np.isfinite(b)):
                return math.inf
            finite = np.isfinite(a)
            worst = max(worst, float(np.abs(a[finite] - b[finite]).max(initial=0.0)))
    return worst


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


def plan_seconds(plans: list[tuple[int, float]], nodes: int) -> np.ndarray:
    """Times of the plans of roadmaps with about `nodes` nodes, s."""
    return np.array([seconds for count, seconds in plans if abs(count - nodes) <= AROUND * nodes])


def report_world(name: str, kept: Drive, rounds: int) -> None:
    """Print the rows of one kind of world."""
    for step in steps(kept):
        if not step.calls:
            continue
        apart = difference(step)  # also compiles
        seconds = interleaved(step.calls, rounds)
        (p50, p99), (other, _) = percentiles(seconds[0]), percentiles(seconds[1])
        agrees = f"{apart:.0e}" if apart <= TOLERANCE else f"{apart:.0e} DIFFERS"
        print(f"| {name} | {step.name} | {p50:.0f} | {p99:.0f} | {other:.0f} | {other / p50:.1f} | {agrees} |")
    p50, p99 = percentiles(np.array([seconds for _, seconds in kept.plans]))
    print(f"| {name} | plan ({len(kept.plans)} searches) | {p50:.0f} | {p99:.0f} | | | |")


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=10.0, help="simulated time of a drive, s (default: 10)")
    parser.add_argument("--rounds", type=int, default=3, help="how often each moment is timed (default: 3)")
    parser.add_argument(
        "--corridor", type=float, default=300.0, help="length of the corridor, m; 0 for none (default: 300)"
    )
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    drive(make_world(Room(), options.seed, ROBOT.radius), options.seed, 3.0)  # compiles
    print("| world | step | p50, us | p99, us | NumPy p50, us | NumPy / package | largest difference |")
    print("|---|---|--:|--:|--:|--:|--:|")
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
    if options.corridor <= 0.0:
        return
    world = make_world(Corridor(length=options.corridor), options.seed, ROBOT.radius)
    plans = drive(world, options.seed, world.timeout, MANY * (1.0 + AROUND)).plans
    few, many = plan_seconds(plans, FEW), plan_seconds(plans, MANY)
    if not len(few) or not len(many):
        print(f"corridor of {options.corridor:g} m: only {plans[-1][0]} nodes at the end, too few to compare")
        return
    (few_p50, few_p99), (many_p50, many_p99) = percentiles(few), percentiles(many)
    print(f"plan in the corridor at {FEW} nodes: p50 {few_p50:.0f} us, p99 {few_p99:.0f} us ({len(few)} plans)")
    print(f"plan in the corridor at {MANY} nodes: p50 {many_p50:.0f} us, p99 {many_p99:.0f} us ({len(many)} plans)")
    print(f"plan at {MANY} nodes / at {FEW} nodes, p50: {many_p50 / few_p50:.2f}")


if __name__ == "__main__":
    main()
