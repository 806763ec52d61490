"""Drives of robots, lidars, worlds and faults drawn at random within what may be declared: no contact is allowed.

Each is a drive of the navigation in Drake's plant or, with --commands, so many random commands through the shield to a
robot that follows them exactly, from place to place of the world. A failure is repeated by its seed: --seed SEED
--drives 1.

Run: python -m scripts.experiments.random_drives [--drives N] [--commands N] [--seed S]
"""

import argparse
import math
import tempfile
import time
import warnings
from collections import Counter
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.footprint import Footprint, disc
from drake_starnav.lidar.mounts import ON_AXIS, Mount
from drake_starnav.navigation.validation import QUICKEST_LOCK, check_and_derive_margins
from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.scenario.schema import Scenario
from drake_starnav.simulation.run import run_trial
from drake_starnav.station.model_world import make_world_with_footprints
from drake_starnav.surroundings.unseen import find_initial_disc_radius
from drake_starnav.utils.files import read_text, write_text
from drake_starnav.utils.resources import find_model_path
from drake_starnav.worlds.clearance import compute_body_clearance
from drake_starnav.worlds.world import World
from scripts.experiments.experiment import add_case_options, run_cases
from tests.helpers.kinematic_robot import KinematicRobot

SCENARIOS = ("forest", "maze", "room", "rooms", "corridor", "channel", "paper_forest")
"""The last is too narrow for all but starbot."""


class Body(NamedTuple):
    """A robot that may be drawn.

    Attributes:
        model: shipped one.
        base: how it moves.
        box: x and y of the rectangle that it covers, least and greatest, m; where `radii` are given, in shares of it.
        radii: least and greatest radius of a disc, m; None for polygons.
        notched: whether a second polygon sticks out of the rectangle's left side.
    """

    model: str
    base: str
    box: tuple[float, float, float, float]
    radii: tuple[float, float] | None = None
    notched: bool = False

    def corners(self) -> list:
        """Of its polygons, as `robot.footprint`."""
        left, right, bottom, top = self.box
        outline = [[left, bottom], [right, bottom], [right, top], [left, top]]
        if not self.notched:
            return outline
        return [outline, [[left, top - 0.05], [0.0, top - 0.05], [0.0, top + 0.15], [left, top + 0.15]]]


UNIT = (-0.6, 0.6, -0.6, 0.6)
BODIES = (
    Body("starbot", "differential", UNIT, (0.15, 0.35)),
    Body("starbot", "differential", UNIT, (0.15, 0.35)),
    Body("jackal", "differential", UNIT, (0.334, 0.4)),
    Body("jackal", "differential", (-0.254, 0.254, -0.22, 0.22)),
    Body("jackal", "differential", (-0.254, 0.254, -0.22, 0.22), notched=True),
    Body("carrier", "differential", (-0.4, 0.4, -0.25, 0.25)),
    Body("omnibot", "omnidirectional", (-0.225, 0.225, -0.225, 0.225)),
    Body("starbot", "omnidirectional", UNIT, (0.25, 0.35)),
    Body("carbot", "car", (-0.12, 0.48, -0.15, 0.15)),
)
"""Each as often as the others."""
WIDER = {"rooms": "world.door=1.25", "corridor": "world.fin=0.15"}
"""Of worlds whose passages do not grow with the robot, for polygons."""
PLACES = {"axis": 0.6, "one": 0.25, "two": 0.15}
"""Probabilities that the lidar is on the robot's axis, that it is elsewhere, and that two are at opposite corners."""
LEAST_VIEW = {"axis": 2.0, "one": 0.5 * math.pi}
"""Half of the least limited view of one lidar, rad; on the axis it looks straight ahead."""
RANGES = {
    "robot.max_speed": (0.2, 2.0),
    "robot.max_yaw_rate": (0.8, 4.0),
    "robot.max_acceleration": (0.4, 4.0),
    "robot.max_yaw_acceleration": (1.5, 10.0),
    "lidar.beams": (120, 1080),
    "lidar.range_max": (3.0, 12.0),
    "lidar.rate": (5.0, 40.0),
    "controller.rate": (20.0, 100.0),
}
"""Drawn for each drive, small values as often as large ones."""
LOCK_TO_LOCK = 1.99
"""A car's turning rate at full speed changes from lock to lock by twice the largest one; less what rounding may add."""
FAULTS = {
    "lidar.noise": 0.03,
    "lidar.dropout": 0.3,
    "lidar.outliers": 0.02,
    "lidar.delay": 0.1,
    "lidar.scan_loss": 0.3,
    "lidar.quantisation": 0.02,
    "localization.drift": 0.03,
    "localization.jump": 0.1,
    "drive.delay": 0.1,
    "drive.slip": 0.05,
    "robot.mass_error": 0.3,
}
"""Largest values of what is drawn evenly, each with the probability FAULTY; else there is no such fault."""
FAULTY = 0.25
TIMEOUT = 90.0
"""Of a drive, s: contacts are looked for, not arrivals."""
PLANT_ONLY = (
    "localization",
    "drive",
    "robot.mass",
    "lidar.delay",
    "lidar.scan_loss",
    "lidar.outliers",
    "lidar.dropout",
)
"""What begins so is no matter of random commands."""
PACE = {"controller.rate": 100.0, "lidar.rate": 4.0}
"""Of random commands, Hz: 25 to a scan."""
BRANCHES = 8
"""So often commands are drawn from each scan on, as scans cost more; the robot goes on where the last ones led it."""
EPISODE, HOLD = 20, 100
"""Scans from one free place on, and how many commands at most are alike, so that the robot leaves its place."""
EXTREME = 0.5
"""Probability that a component of a random command is as large as may be."""


class Case(NamedTuple):
    """What is drawn.

    Attributes:
        scenario: its name.
        overrides: of the scenario.
        mounts: of lidars elsewhere than where the model has its own, by the name of their frame.
    """

    scenario: str
    overrides: list[str]
    mounts: dict[str, Mount]


def drawn(seed: int) -> Case:
    """What is drawn by a seed."""
    rng = np.random.default_rng(seed)
    body = BODIES[rng.integers(len(BODIES))]
    scenario = str(rng.choice(SCENARIOS if body.model == "starbot" else SCENARIOS[:-1]))
    place = str(rng.choice(list(PLACES), p=list(PLACES.values())))
    overrides = [f"simulation.timeout={TIMEOUT}", f"robot.base={body.base}"]
    box = np.array(body.box)
    if body.radii:
        low, high = max(body.radii[0], 0.25 if place != "axis" else 0.0), body.radii[1]  # only shipped hulls shrink
        radius = round(low * (high / low) ** rng.uniform(), 4)
        overrides.append(f"robot.radius={radius}")
        box *= radius
    else:
        overrides.append(f"robot.footprint={body.corners()}")
        overrides += [WIDER[scenario]] if scenario in WIDER else []
    mounts = mounted(place, box, rng)
    overrides += {"one": ["lidar.frame=first"], "two": ["lidars=[{frame: first}, {frame: second}]"]}.get(place, [])
    least = float(rng.uniform(0.4, 0.8)) if body.base == "car" else 0.0
    values = {key: low * (high / low) ** rng.uniform() for key, (low, high) in RANGES.items()}
    if body.base == "car":
        overrides.append(f"robot.least_radius={least:.4f}")
        turning = min(values["robot.max_speed"] / least, values["robot.max_yaw_rate"])
        quickest = LOCK_TO_LOCK * turning / QUICKEST_LOCK
        values["robot.max_yaw_acceleration"] = min(values["robot.max_yaw_acceleration"], quickest)
    for key, value in values.items():
        overrides.append(f"{key}={round(value) if isinstance(RANGES[key][0], int) else round(value, 4)}")
    limited = rng.uniform() < FAULTY and place != "two"
    if limited or place == "two":
        half = 0.75 * math.pi if place == "two" else float(rng.uniform(LEAST_VIEW[place], 3.1))
        if place == "one":  # it sees what is ahead, to both sides
            most = half - LEAST_VIEW[place]
            mounts["first"] = mounts["first"]._replace(yaw=float(rng.uniform(-most, most)), upside_down=False)
        overrides += [f"lidar.angle_min={-half:.4f}", f"lidar.angle_max={half:.4f}"]
    faults = {key: rng.uniform(0.0, most) for key, most in FAULTS.items() if rng.uniform() < FAULTY}
    if body.base == "omnidirectional":  # it has no wheels
        faults.pop("drive.slip", None)
    overrides += [f"{key}={value:.4f}" for key, value in faults.items()]
    return Case(scenario, [f"robot.model={body.model}", *overrides], mounts)


def mounted(place: str, box: np.ndarray, rng: np.random.Generator) -> dict[str, Mount]:
    """Lidars over a rectangle (least and greatest x and y, m), one of PLACES."""
    left, right, bottom, top = box
    if place == "one":
        (x, y), turned = rng.uniform((left, bottom), (right, top)), rng.uniform() < 0.3
        return {"first": Mount(float(x), float(y), float(rng.uniform(-math.pi, math.pi)), bool(turned))}
    corners = {"first": (right, bottom, -0.25 * math.pi), "second": (left, top, 0.75 * math.pi)}
    return {name: Mount(*corner, False) for name, corner in corners.items()} if place == "two" else {}


def with_frames(model: str, mounts: dict[str, Mount], folder: Path) -> Path:
    """A copy of a shipped model with the frames of further lidars, as high as its own."""
    text = read_text(find_model_path("robots", f"{model}.urdf"))
    height = text.partition('<frame name="lidar"')[2].partition('xyz="')[2].partition('"')[0].split()[2]
    frames = [
        f'<frame name="{name}" link="base_link" xyz="{m.x} {m.y} {height}" rpy="{m.upside_down * math.pi} 0 {m.yaw}"/>'
        for name, m in mounts.items()
    ]
    path = folder / f"{model}.urdf"
    write_text(path, text.replace("</robot>", "\n".join((*frames, "</robot>"))))
    return path


def driven(seed: int, commands: int = 0) -> dict[str, Any]:
    """The record of the drive of a seed, or of so many random commands.

    Its outcome is `refused` where the parameters are not allowed together, or a warning says that it may hit what its
    lidars look over; and `crash` after any other exception.
    """
    case = drawn(seed)
    record = {"seed": seed, "scenario": case.scenario, "set": case.overrides, "mounts": case.mounts}
    try:
        return {**record, **(commanded(case, seed, commands) if commands else navigated(case, seed))}
    except (StarnavError, UserWarning) as error:
        return {**record, "outcome": "refused", "why": str(error)}
    except Exception as error:
        return {**record, "outcome": "crash", "why": f"{type(error).__name__}: {error}"}


def navigated(case: Case, seed: int) -> dict[str, Any]:
    """How a drive in Drake's plant ends."""
    with tempfile.TemporaryDirectory() as folder:
        model, own = case.overrides[0].partition("=")[2], []
        if case.mounts:
            own.append(f"robot.model={with_frames(model, case.mounts, Path(folder))}")
        with warnings.catch_warnings():
            warnings.filterwarnings("error", ".*may hit what its lidar")
            trial = run_trial(load_scenario(case.scenario, overrides=[*case.overrides, *own]), seed=seed)
    figures = {"time_s": trial.time_s, "path_m": trial.path_length_m, "min_clearance_m": trial.min_clearance_m}
    return {"outcome": trial.outcome, "contact": trial.contact, **figures}


def commanded(case: Case, seed: int, commands: int) -> dict[str, Any]:
    """What becomes of a robot that follows random commands exactly, as far as the shield lets them pass.

    Every EPISODE scans it stands at another free place, which it then sees for the first time. What a standing robot
    cannot follow is asked once. Faults of drives and localization, and scans and beams that are late, lost or
    astray are left out, and no lidar is upside down.
    """
    kept = [text for text in case.overrides if not text.startswith(PLANT_ONLY)]
    scenario = load_scenario(case.scenario, overrides=[*kept, *(f"{key}={value}" for key, value in PACE.items())])
    mounts = tuple(mount._replace(upside_down=False) for mount in case.mounts.values()) or (ON_AXIS,)
    margin, robot = check_and_derive_margins(scenario, mounts).safety, scenario.robot
    world = make_world_with_footprints(scenario.world, seed, robot.radius)
    sees_all = all(lidar.field_of_view.full_circle for lidar in scenario.all_lidars)
    free = find_initial_disc_radius(robot.shape, margin, max(0.0, *(mount.x for mount in mounts)))
    around = robot.shape if sees_all else disc(free)  # what it does not see there it takes for free; see SAFETY.md
    motion, rng = KinematicRobot(scenario, world, seed, mounts), np.random.default_rng((seed, 1))
    least, contact, path, scans, began = math.inf, None, 0.0, 0, time.process_time()
    while motion.asked < commands and contact is None:
        motion.put(free_pose(world, around, margin, rng))
        driven = wandered(motion, scenario, rng)
        poses, scans = np.vstack(driven), scans + EPISODE
        path += sum(float(np.hypot(*np.diff(part[:, :2], axis=0).T).sum()) for part in driven)
        clearances = compute_body_clearance(world, poses, robot.shape)
        nearest = int(clearances.argmin())
        least = min(least, float(clearances[nearest]))
        if least < 0.0:
            contact = f"within {motion.asked} commands at {poses[nearest].tolist()}"
    return {
        "outcome": "driven" if contact is None else "collision",
        "contact": contact,
        "commands": motion.asked,
        "changed": motion.changed,
        "braked": motion.braked,
        "scans": scans,
        "time_s": time.process_time() - began,
        "path_m": path,
        "min_clearance_m": least,
    }


def wandered(motion: KinematicRobot, scenario: Scenario, rng: np.random.Generator) -> list[np.ndarray]:
    """What a robot drives by random commands from where it stands, until EPISODE scans are taken: poses (n, 3) each."""
    robot, period, kept, parts = scenario.robot, round(PACE["controller.rate"] / PACE["lidar.rate"]), None, []
    most = np.array((*(robot.max_speed,) * (len(robot.drive.components) - 1), robot.limits.max_yaw_rate))
    for _ in range(EPISODE):
        start = motion.pose, motion.twist
        for branch in range(BRANCHES):
            (motion.pose, motion.twist), left = start, period
            wish, held = kept if kept and branch == BRANCHES - 1 else (most, 0)
            while left > 0:
                if held == 0:
                    share, held = rng.uniform(-1.0, 1.0, len(most)), int(rng.integers(1, HOLD))
                    wish = most * np.where(rng.uniform(size=len(most)) < EXTREME, np.sign(share), share)
                count = min(left, held)
                parts.append(motion.burst(wish, count))
                left, held = left - len(parts[-1]), held - count
            kept = wish, held
        motion.look()
    return parts


def free_pose(world: World, shape: Footprint, margin: float, rng: np.random.Generator) -> np.ndarray:
    """A random pose (x, y, yaw) in a world where a robot keeps more than its margin, m; its start if none is found.

    Every other time that of many which is nearest to something.
    """
    low, high = np.reshape(world.extent, (2, 2))
    poses = np.column_stack((rng.uniform(low, high, (64, 2)), rng.uniform(-math.pi, math.pi, 64)))
    clear, beside = compute_body_clearance(world, poses, shape), rng.uniform() < 0.5
    free = np.flatnonzero(clear > 1.2 * margin)
    if not len(free):
        start = np.array(world.start, dtype=float)
        if compute_body_clearance(world, start[None], shape)[0] < 0.0:
            raise StarnavError(f"world {world.name} has no place where nothing stands that the robot does not see")
        return start
    return poses[free[np.argmin(clear[free])] if beside else free[0]]


def report(records: list[dict[str, Any]]) -> str:
    """How the drives ended, how far they led, and each that touched something."""
    counts = ", ".join(f"{n} {outcome}" for outcome, n in sorted(Counter(r["outcome"] for r in records).items()))
    kept = [r for r in records if "min_clearance_m" in r]
    lines = [f"{len(records)} drives: {counts}"]
    if kept:
        commands, way = (sum(r.get(key, 0) for r in kept) for key in ("commands", "path_m"))
        least = min(r["min_clearance_m"] for r in kept)
        lines.append(f"{commands} commands, {way:.0f} m driven; least clearance {1e3 * least:.1f} mm")
    contacts = [r for r in records if r["outcome"] == "collision"]
    lines += [f"seed {r['seed']}: {r['contact']}, {r['scenario']} {' '.join(r['set'])}" for r in contacts]
    lines += [f"seed {r['seed']}: {r['why']}" for r in records if r["outcome"] == "crash"]
    return "\n".join(lines)


def main(options: argparse.Namespace) -> int:
    """Drive, write the records as they come, print the report; the exit code is 1 if anything was touched."""
    drive = partial(driven, commands=options.commands)
    records = run_cases(drive, range(options.seed, options.seed + options.drives), options)
    print(report(records))
    return int(any(record["outcome"] in ("collision", "crash") for record in records))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--drives", type=int, default=100, metavar="N", help="default: 100")
    parser.add_argument("--commands", type=int, default=0, metavar="N", help="so many random commands, not a drive")
    add_case_options(parser)
    raise SystemExit(main(parser.parse_args()))
