"""Whether the certificate is sound for robots of any shape and base, how much it refuses, and what it costs.

Random commands beside random walls, corners, bars and poles, seen by noisy or exact scans around or of 270 degrees, are
asked about as the shield does; the footprint is then swept along the motion in steps of 4 ms, independently of the
certificate's samples.

Run: python scripts/experiments/footprint_soundness.py [--cases N] [--robots ROBOT ...] [--seed S]
"""

import argparse
import dataclasses
import math
import time
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import shapely
from tqdm import tqdm

from drake_starnav.geometry.compiled import kernel
from drake_starnav.geometry.footprint import Footprint, covered
from drake_starnav.geometry.polyline import point_to_segment_squared
from drake_starnav.robot import Limits
from drake_starnav.robot.motion import Actuation, roll_out
from drake_starnav.safety.certificates import accepted, standard_certificates
from drake_starnav.scenario.margins import derive_margins
from drake_starnav.scenario.scenario_file import parse_scenario
from drake_starnav.scenario.schema import Scenario
from drake_starnav.surroundings.perception import Perceived, PerceptionSettings, perceive
from drake_starnav.surroundings.safe_region import CertifiedRegion
from drake_starnav.worlds.outlines import rectangle
from drake_starnav.worlds.world import World
from tests.helpers.scans import cast, noisy

STEP = 4e-3
"""Of the sweep, s."""
NOISE = 0.01
HALF = 3.0
"""Half the side of the walled square, m."""
COMMANDS = 250
"""Commands for each scene."""
SLACK = 0.012
"""A command counts as safe if its sweep keeps the margin and this, and is seen from the lidar with this to spare, m."""
TIMED = 20
"""Of how many commands of each scene the time is taken."""
SHAPES: Mapping[str, str] = {
    "disc": "radius: 0.25",
    "jackal": f"footprint: {np.asarray(rectangle(-0.254, -0.215, 0.254, 0.215)).tolist()}",
    "carrier": f"footprint: {np.asarray(rectangle(-0.4, -0.25, 0.4, 0.25)).tolist()}",
    "ell": "footprint: [[[-0.3, -0.125], [0.3, -0.125], [0.3, 0.125], [-0.3, 0.125]], "
    "[[-0.3, -0.1], [-0.05, -0.1], [-0.05, 0.4], [-0.3, 0.4]]]",
    "omnidirectional square": "base: omnidirectional, "
    f"footprint: {np.asarray(rectangle(-0.225, -0.225, 0.225, 0.225)).tolist()}",
    "car": f"base: car, footprint: {np.asarray(rectangle(-0.1, -0.15, 0.5, 0.15)).tolist()}",
}
"""The section `robot` of each robot."""


class Outcome(NamedTuple):
    """Of one command: whether it was accepted, the least distance of its sweep, m, and the times in s, or NaN."""

    accepts: bool
    least: float
    safe: bool
    exact: bool
    seconds: float


def scenario_of(robot: str) -> Scenario:
    """The default scenario with one of SHAPES."""
    return parse_scenario(f"world: !Forest {{}}\nrobot: {{{SHAPES[robot]}}}", name="soundness")


def scene(rng: np.random.Generator, clear: float) -> World:
    """A walled square with poles, bars and triangles with corners of 60 to 90 degrees, not within `clear` of (0, 0)."""
    poles: list[tuple[float, float, float]] = []
    polygons: list[np.ndarray] = []
    while len(poles) < 10:
        x, y, radius = *rng.uniform(-2.0, 2.0, 2), rng.choice((0.03, 0.1, 0.3))
        if math.hypot(x, y) > radius + clear:
            poles.append((x, y, radius))
    while len(polygons) < 8:
        long, wide = rng.uniform(0.2, 1.0), rng.uniform(0.06, 0.4)
        bar = np.asarray(rectangle(-0.5 * long, -0.5 * wide, 0.5 * long, 0.5 * wide))
        corners = bar if rng.random() < 0.5 else long * np.array(((0.0, 0.0), (0.6, 0.0), (0.3, 0.3 * math.sqrt(3.0))))
        turn = rng.uniform(-math.pi, math.pi)
        cosine, sine = math.cos(turn), math.sin(turn)
        placed = corners @ np.array(((cosine, sine), (-sine, cosine))) + rng.uniform(-2.0, 2.0, 2)
        if shapely.distance(shapely.Polygon(placed), shapely.Point(0.0, 0.0)) > clear:
            polygons.append(placed)
    return World(
        "soundness",
        (0, 0, 0),
        (0, 0),
        cylinders=np.array(poles),
        polygons=tuple(polygons),
        bounds=(-HALF, -HALF, HALF, HALF),
    )


def looked(
    world: World, pose: np.ndarray, scenario: Scenario, views: tuple[bool, bool], rng: np.random.Generator
) -> CertifiedRegion:
    """What scans certify that were taken on a way of a few centimetres to a pose, exact and to the front alone or not.

    A robot that looks to the front, over 270 degrees, has looked around before.
    """
    exact, front = views
    view: dict[str, Any] = {}
    if front:
        view = {"beams": 271, "angle_min": -0.75 * math.pi, "angle_increment": 1.5 * math.pi / 270}
    settings = PerceptionSettings(derive_margins(scenario), scenario.robot.shape)
    state, turns = Perceived.nothing(), (2.1, -2.1) if front else ()
    back = np.array((math.cos(pose[2]), math.sin(pose[2]), 0.0))
    places = *(pose + (0.0, 0.0, turn) for turn in turns), *(pose - step * back for step in (0.04, 0.02, 0.0))
    for k, place in enumerate(places):
        scan = dataclasses.replace(cast(world, place, **view), time=0.1 * k)
        state = perceive(state, [scan if exact else noisy(scan, NOISE, rng)], place, settings)
    return state.safety


@kernel
def swept(pose, velocity, target, phases, limits):
    """Poses (n, 3) every STEP of a robot that keeps its velocity, ramps to the target, and then brakes.

    Args:
        pose: (x, y, yaw), W.
        velocity, target: speeds along x and y and turning rate, or curvature, shape (3,).
        phases: delay and hold, s.
        limits: `Limits`.
    """
    braking = 1.0 + int(max(abs(velocity[2]), abs(target[2])) / max(limits.max_yaw_acceleration, 1e-9))
    braking += int(
        max(math.hypot(velocity[0], velocity[1]), math.hypot(target[0], target[1])) / limits.max_acceleration
    )
    out = np.empty((int((phases[0] + phases[1] + braking) / STEP) + 4, 3))
    out[0], moving, n = pose, velocity.copy(), 1
    for phase in range(3):
        duration = phases[phase] if phase < 2 else braking
        for _ in range(int(round(duration / STEP))):
            aim = velocity.copy() if phase == 0 else target.copy() if phase == 1 else np.zeros(3)
            if phase == 2 and limits.steers > 0.0:
                aim[2] = moving[2]
            dx, dy = aim[0] - moving[0], aim[1] - moving[1]
            share = min(limits.max_acceleration * STEP / max(math.hypot(dx, dy), 1e-12), 1.0)
            most = limits.max_yaw_acceleration * STEP
            after = np.array(
                (moving[0] + share * dx, moving[1] + share * dy, moving[2] + min(max(aim[2] - moving[2], -most), most))
            )
            x, y, turning = 0.5 * (moving + after)
            moving = after
            omega = turning * x if limits.steers > 0.0 else turning
            yaw = out[n - 1, 2] + 0.5 * omega * STEP
            out[n, 0] = out[n - 1, 0] + STEP * (math.cos(yaw) * x - math.sin(yaw) * y)
            out[n, 1] = out[n - 1, 1] + STEP * (math.sin(yaw) * x + math.cos(yaw) * y)
            out[n, 2] = out[n - 1, 2] + omega * STEP
            n += 1
            if phase == 2 and abs(moving[0]) + abs(moving[1]) < 1e-12 and (limits.steers > 0.0 or moving[2] == 0.0):
                break
    return out[:n]


@kernel
def least_distance(poses, parts, radius, segments, discs):
    """Least distance, m, of a footprint on its poses (n, 3) from segments (k, 4) and discs (m, 3); 0 in contact.

    `parts` are its convex polygons, none for a disc of that radius.
    """
    least = np.inf
    for n in range(len(poses)):
        x, y, cosine, sine = poses[n, 0], poses[n, 1], math.cos(poses[n, 2]), math.sin(poses[n, 2])
        for k in range(len(discs)):
            dx, dy = discs[k, 0] - x, discs[k, 1] - y
            if math.hypot(dx, dy) - discs[k, 2] - radius < least:
                u, v = cosine * dx + sine * dy, cosine * dy - sine * dx
                least = min(least, max(_apart(parts, radius, (u, v, u, v)) - discs[k, 2], 0.0))
        for k in range(len(segments)):
            ax, ay, bx, by = segments[k]
            if math.sqrt(point_to_segment_squared(x, y, ax, ay, bx, by)) - radius < least:
                ax, ay, bx, by = ax - x, ay - y, bx - x, by - y
                line = (
                    cosine * ax + sine * ay,
                    cosine * ay - sine * ax,
                    cosine * bx + sine * by,
                    cosine * by - sine * bx,
                )
                least = min(least, _apart(parts, radius, line))
    return least


@kernel
def _apart(parts, radius, line):
    """Distance of a footprint from a segment in its frame, which may be a point, m; 0 in contact."""
    ax, ay, bx, by = line
    if len(parts) == 0:
        return max(math.sqrt(point_to_segment_squared(0.0, 0.0, ax, ay, bx, by)) - radius, 0.0)
    least = np.inf
    for part in parts:
        low, high = 0.0, 1.0  # what of the segment lies within the part
        for k in range(len(part)):
            cx, cy = part[k]
            dx, dy = part[(k + 1) % len(part)]
            least = min(
                least,
                point_to_segment_squared(cx, cy, ax, ay, bx, by),
                point_to_segment_squared(ax, ay, cx, cy, dx, dy),
                point_to_segment_squared(bx, by, cx, cy, dx, dy),
            )
            begin = (dx - cx) * (ay - cy) - (dy - cy) * (ax - cx)
            slope = (dx - cx) * (by - ay) - (dy - cy) * (bx - ax)
            if slope > 0.0:
                low = max(low, -begin / slope)
            elif slope < 0.0:
                high = min(high, -begin / slope)
            elif begin < 0.0:
                low = 2.0
        if low <= high:
            return 0.0
    return math.sqrt(least)


def velocity_of(twist: np.ndarray) -> np.ndarray:
    """A twist of two or three components as speeds along x and y and a turning."""
    return np.array((twist[0], 0.0, twist[1]) if len(twist) == 2 else twist, dtype=float)


def solid(world: World) -> tuple[np.ndarray, np.ndarray]:
    """The obstacles of a world for `least_distance`: segments and discs."""
    return np.asarray(world.segments, dtype=float).reshape(-1, 4), np.asarray(world.discs, dtype=float).reshape(-1, 3)


def sweep(
    pose: np.ndarray, twists: tuple[np.ndarray, np.ndarray], phases: tuple[float, float], limits: Limits
) -> np.ndarray:
    """`swept` of a robot that is commanded the first twist, and now the second one."""
    return swept(pose, velocity_of(twists[0]), velocity_of(twists[1]), phases, limits)


def is_seen(poses: np.ndarray, shape: Footprint, world: World, place: np.ndarray) -> bool:
    """Whether all corners of the footprint, on its way, are seen from a place (2,) past all obstacles with SLACK."""
    obstacles = shapely.union_all(
        [*(shapely.Polygon(p) for p in world.polygons), *(shapely.Point(x, y).buffer(r) for x, y, r in world.cylinders)]
    )
    corners = np.vstack([shapely.get_coordinates(covered(shape, pose)) for pose in poses[:: max(len(poses) // 8, 1)]])
    rays = shapely.linestrings(np.stack((np.broadcast_to(place, corners.shape), corners), axis=1))
    return bool((shapely.distance(rays, obstacles) > SLACK).all())


def tried(scenario: Scenario, seed: int, commands: int) -> list[Outcome]:
    """What became of random commands in one scene."""
    rng, robot = np.random.default_rng(seed), scenario.robot
    shape, limits, margin = robot.shape, robot.limits, derive_margins(scenario).safety
    world, exact = scene(rng, shape.narrow + 0.03), rng.random() < 0.5
    front = rng.random() < 0.3 and not robot.drive.holonomic
    obstacles, parts = solid(world), tuple(np.asarray(part) for part in shape.parts)
    where = np.zeros(3)
    while True:
        place = np.array((*rng.uniform(-0.6, 0.6, 2), rng.uniform(-math.pi, math.pi)))
        where = place - (*(0.04 * np.array((math.cos(place[2]), math.sin(place[2])))), 0.0)
        if least_distance(np.array((place, where)), parts, shape.radius, *obstacles) > margin + 0.005:
            break
    star, out = looked(world, place, scenario, (exact, front), rng), []
    most = np.full(len(robot.drive.components), robot.max_speed)
    most[-1] = limits.max_yaw_rate
    for k in range(commands):
        twists = tuple(robot.drive.saturated(rng.uniform(-most, most), limits) for _ in range(2))
        twists = twists[0] * (rng.random() < 0.7), twists[1]
        hold, delay = float(rng.choice((0.02, 0.1))), float(rng.choice((0.0, 0.02)))
        pose = place + rng.uniform(-1.0, 1.0, 3) * (0.02, 0.02, 0.05)
        if least_distance(pose[None], parts, shape.radius, *obstacles) < margin:
            continue
        actuation = Actuation(limits, shape, hold, delay, robot.drive)
        motion = roll_out(pose, *twists, actuation)
        if not motion.grips:
            continue
        certificates = standard_certificates(star, margin, actuation, pose[:2])
        seconds = math.nan
        begin = time.perf_counter()
        accepts = accepted(motion, certificates)
        if k < TIMED:
            seconds = time.perf_counter() - begin
        poses = sweep(pose, twists, (delay, hold), limits)
        least = float(least_distance(poses, parts, shape.radius, *obstacles))
        roomy = least > margin + SLACK and not front  # what it saw before is not known here
        safe = roomy and (accepts or is_seen(poses, shape, world, star.center))
        out.append(Outcome(accepts, least, safe, exact, seconds))
    return out


def line(robot: str, outcomes: list[Outcome]) -> str:
    """What was found of one robot."""
    passed = [o for o in outcomes if o.accepts]
    safe = [o.accepts for o in outcomes if o.safe and o.exact]
    seconds = np.nanmedian([o.seconds for o in outcomes]) if outcomes else math.nan
    least = [1e3 * min((o.least for o in passed if o.exact == exact), default=math.nan) for exact in (True, False)]
    margin = 1e3 * derive_margins(scenario_of(robot)).safety
    contacts, share = sum(o.least <= 0.0 for o in passed), np.mean(safe) if safe else math.nan
    return (
        f"{robot}, margin {margin:.1f} mm: {len(outcomes)} commands, {len(passed)} accepted, {contacts} contacts, "
        f"least clearance {least[0]:.1f} mm with exact scans, {least[1]:.1f} mm with noise; of {len(safe)} safe ones "
        f"{100.0 * share:.2f} % accepted; certificate {1e6 * seconds:.1f} us"
    )


def main(options: argparse.Namespace) -> int:
    """Ask about the commands; returns 1 if one that is accepted leads to a contact."""
    contacts = 0
    for robot in options.robots:
        scenario, outcomes = scenario_of(robot), []
        scenes = math.ceil(options.cases / len(options.robots) / COMMANDS)
        for number in tqdm(range(scenes), unit="scene", disable=None, leave=False):
            outcomes += tried(scenario, options.seed + number, COMMANDS)
        contacts += sum(o.accepts and o.least <= 0.0 for o in outcomes)
        print(line(robot, outcomes), flush=True)
    return int(contacts > 0)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=1_000_000, metavar="N", help="of all robots; default: 1000000")
    parser.add_argument("--robots", nargs="+", default=list(SHAPES), choices=SHAPES, metavar="ROBOT")
    parser.add_argument("--seed", type=int, default=0, help="of the first scene; default: 0")
    raise SystemExit(main(parser.parse_args()))
