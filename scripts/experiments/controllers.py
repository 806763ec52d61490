"""The predictive law against the modulation law, without a plant.

Run: python -m scripts.experiments.controllers [SCENARIO ...]

Both drive the same worlds with the same noise; twists are followed exactly.
"""

import argparse

import numpy as np

from benchmarks.kinematic_drive import CONTROLLER, ROBOT, Drive, drive
from drake_starnav.control import control_step
from drake_starnav.control.sampling_mpc import predictive_step
from drake_starnav.evaluation.summary import markdown_table
from drake_starnav.scenario import load_scenario
from drake_starnav.worlds import make_world
from drake_starnav.worlds.clearance import clearance
from drake_starnav.worlds.world import World

LAWS = {"modulation": control_step, "predictive": predictive_step}
HEAD = (
    "world", "law", "reached", "time s mean", "median", "length m", "jerk m/s^3 rms", "yaw acc. rad/s^2 rms",
    "clearance mm least", "mean", "command us median",
)  # fmt: skip


def figures(world: World, kept: Drive) -> tuple[float, ...]:
    """Reached, time, length, jerk, yaw acceleration, least and mean clearance (at most 0.5 m), time of a command."""
    motion, rate = np.array(kept.motion), CONTROLLER.rate
    clear = clearance(world, motion[:, :2].copy()) - ROBOT.radius
    jerk, turning = np.diff(motion[:, 3], 2) * rate**2, np.diff(motion[:, 4]) * rate
    return (
        kept.arrived and clear.min() >= 0.0,
        len(motion) / rate,
        float(np.hypot(*np.diff(motion[:, :2], axis=0).T).sum()),
        float(np.sqrt(np.mean(jerk**2))),
        float(np.sqrt(np.mean(turning**2))),
        float(clear.min()),
        float(np.minimum(clear, 0.5).mean()),
        float(np.median(kept.command_times)),
    )


def row(name: str, law: str, trials: np.ndarray) -> tuple[str, ...]:
    """Times and lengths over the trials that reached the goal, the rest over all."""
    reached = trials[:, 0] > 0.0
    good, mean = trials[reached], trials.mean(axis=0)
    return (
        name, law, f"{int(reached.sum())} / {len(trials)}", f"{good[:, 1].mean():.2f}", f"{np.median(good[:, 1]):.2f}",
        f"{good[:, 2].mean():.2f}", f"{mean[3]:.1f}", f"{mean[4]:.2f}", f"{trials[:, 5].min() * 1e3:.0f}",
        f"{mean[6] * 1e3:.0f}", f"{np.median(trials[:, 7]) * 1e6:.0f}",
    )  # fmt: skip


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenario", nargs="*", default=["forest", "maze", "room"])
    parser.add_argument("--trials", type=int, default=30)
    parser.add_argument("--seed", type=int, default=0, help="of the first world (default: 0)")
    options = parser.parse_args()
    rows = []
    for name in options.scenario:
        parameters = load_scenario(name).world
        for law, step in LAWS.items():
            trials = []
            for seed in range(options.seed, options.seed + options.trials):
                world = make_world(parameters, seed, ROBOT.radius)
                trials.append(figures(world, drive(world, seed, world.timeout, step=step)))
            rows.append(row(name, law, np.array(trials, dtype=float)))
    print(markdown_table(HEAD, rows))


if __name__ == "__main__":
    main()
