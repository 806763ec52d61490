"""Random actions in forests: how often the robot touches anything, with and without the shield, and at what speed.

Run: python scripts/experiments/random_steps.py [--steps N] [--scenario NAME] [--no-shield] [--plant]
"""

import argparse
import time

import gymnasium
import numpy as np
from tqdm import tqdm

HOLD = 20
"""An action is held for up to so many steps, as otherwise the robot would hardly leave its place."""


def random_steps(environment: gymnasium.Env, steps: int, seed: int) -> dict[str, float]:
    """Counts of contacts, goals and episodes, metres driven and steps a second in so many steps of random actions.

    Args:
        environment: of `drake_starnav.gym`.
        steps: of the environment.
        seed: of worlds and actions.
    """
    rng = np.random.default_rng(seed)
    space = environment.action_space
    assert isinstance(space, gymnasium.spaces.Box)
    counts = {"contacts": 0.0, "goals": 0.0, "episodes": 1.0, "driven_m": 0.0}
    _, info = environment.reset(seed=seed)
    start, hold = time.perf_counter(), 0
    for _ in tqdm(range(steps), unit="step", disable=None, leave=False):
        if hold == 0:
            hold, action = int(rng.integers(1, HOLD)), rng.uniform(space.low, space.high).astype(np.float32)
        hold -= 1
        before = info["pose"]
        _, _, terminated, truncated, info = environment.step(action)
        counts["driven_m"] += float(np.hypot(*(info["pose"] - before)[:2]))
        counts["contacts"] += info["outcome"] == "collision"
        counts["goals"] += info["outcome"] == "reached"
        if terminated or truncated:
            counts["episodes"] += 1
            _, info = environment.reset()
    return {**counts, "steps_per_s": steps / (time.perf_counter() - start)}


def main(options: argparse.Namespace) -> None:
    """Take the steps, and print what happened."""
    kind = "Plant" if options.plant else "Kinematic"
    environment = gymnasium.make(
        f"drake_starnav.gym:starnav/{kind}-v0",
        scenario=options.scenario,
        shield=options.shield,
        disable_env_checker=True,
    )
    found = random_steps(environment, options.steps, options.seed)
    environment.close()
    print(
        f"{options.steps} steps, shield {'on' if options.shield else 'off'}: {found['contacts']:.0f} contacts", end=", "
    )
    print(f"{found['episodes']:.0f} episodes, {found['driven_m']:.0f} m; {found['steps_per_s']:.0f} steps/s")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=100_000, metavar="N", help="default: 100000")
    parser.add_argument("--scenario", default="forest", metavar="NAME", help="default: forest")
    parser.add_argument("--seed", type=int, default=0, help="of worlds and actions; default: 0")
    parser.add_argument("--no-shield", dest="shield", action="store_false", help="drive the actions as they are")
    parser.add_argument("--plant", action="store_true", help="in Drake's plant instead of the kinematics")
    main(parser.parse_args())
