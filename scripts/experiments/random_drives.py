"""Drives of robots, lidars, worlds and faults drawn at random within what may be declared: no contact is allowed.

A failure is repeated by its seed: --seed SEED --drives 1.

Run: python scripts/experiments/random_drives.py [--drives N] [--seed S] [--workers N] [--out FILE]
"""

import argparse
import json
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from drake_starnav.errors import StarnavError
from drake_starnav.scenario import load_scenario
from drake_starnav.simulation import run_trial

SCENARIOS = ("forest", "maze", "room", "rooms", "corridor", "paper_forest", "channel")
RANGES = {
    "robot.radius": (0.15, 0.35),
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


def drawn(seed: int) -> tuple[str, list[str]]:
    """The scenario of a drive and its overrides."""
    rng = np.random.default_rng(seed)
    scenario = str(rng.choice(SCENARIOS))
    overrides = [f"simulation.timeout={TIMEOUT}"]
    for key, (low, high) in RANGES.items():
        value = low * (high / low) ** rng.uniform()
        overrides.append(f"{key}={round(value) if isinstance(low, int) else round(value, 4)}")
    if rng.uniform() < FAULTY:  # a limited view, symmetric about straight ahead
        half = float(rng.uniform(2.0, 3.1))
        overrides += [f"lidar.angle_min={-half:.4f}", f"lidar.angle_max={half:.4f}"]
    overrides += [f"{key}={rng.uniform(0.0, most):.4f}" for key, most in FAULTS.items() if rng.uniform() < FAULTY]
    return scenario, overrides


def driven(seed: int) -> dict[str, Any]:
    """The record of the drive of a seed; its outcome is `refused` where the parameters are not allowed together."""
    name, overrides = drawn(seed)
    record: dict[str, Any] = {"seed": seed, "scenario": name, "set": overrides}
    try:
        trial = run_trial(load_scenario(name, overrides=overrides), seed=seed)
    except StarnavError as error:
        return {**record, "outcome": "refused", "why": str(error)}
    figures = {"time_s": trial.time_s, "path_m": trial.path_length_m, "min_clearance_m": trial.min_clearance_m}
    return {**record, "outcome": trial.outcome, "contact": trial.contact, **figures}


def report(records: list[dict[str, Any]]) -> str:
    """How the drives ended, how far they led, and each that touched something."""
    counts = ", ".join(f"{n} {outcome}" for outcome, n in sorted(Counter(r["outcome"] for r in records).items()))
    kept = [r for r in records if r["outcome"] != "refused"]
    lines = [f"{len(records)} drives: {counts}"]
    if kept:
        least = min(r["min_clearance_m"] for r in kept)
        lines.append(f"{sum(r['path_m'] for r in kept):.0f} m driven; least clearance {1e3 * least:.1f} mm")
    contacts = [r for r in records if r["outcome"] == "collision"]
    lines += [f"seed {r['seed']}: {r['contact']}, {r['scenario']} {' '.join(r['set'])}" for r in contacts]
    return "\n".join(lines)


def main(options: argparse.Namespace) -> int:
    """Drive, write the records as they come, print the report; the exit code is 1 if anything was touched."""
    seeds = range(options.seed, options.seed + options.drives)
    records = []
    with ProcessPoolExecutor(options.workers) as pool:
        for record in tqdm(pool.map(driven, seeds), total=len(seeds), unit="drive", disable=None, leave=False):
            records.append(record)
            if options.out is not None:
                options.out.parent.mkdir(parents=True, exist_ok=True)
                with options.out.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(record) + "\n")
    print(report(records))
    return int(any(record["outcome"] == "collision" for record in records))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--drives", type=int, default=100, metavar="N", help="default: 100")
    parser.add_argument("--seed", type=int, default=0, help="of the first drive; default: 0")
    parser.add_argument("--workers", type=int, default=2, metavar="N", help="processes; default: 2")
    parser.add_argument("--out", type=Path, metavar="FILE", help="append the records, one JSON a line")
    raise SystemExit(main(parser.parse_args()))
