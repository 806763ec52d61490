"""A batch of episodes with a policy of your own, in an environment of Gymnasium with the certificate as its shield.

The policy here turns towards the goal and away from what is near; one that has been learned would see and answer the
same. It needs `pip install drake-starnav[gym]`.

Run: python scripts/examples/09_batch_over_seeds.py [--png FILE]
"""

import argparse
from pathlib import Path

import gymnasium
import numpy as np
from matplotlib.figure import Figure

from drake_starnav import parse_scenario
from drake_starnav.plotting import draw_goal, draw_robot, draw_world

BLUE = "#0072B2"
SEEDS = range(6)
SCENARIO = parse_scenario(
    """
    world: !Forest {width: 10, height: 6, gap: [1.0, 1.4]}
    simulation: {timeout: 60}
    robot: {max_speed: 0.6}
    lidar: {beams: 180}
    """,
    name="small forest",
)
BEARINGS = SCENARIO.lidar.angle_min + SCENARIO.lidar.angle_increment * np.arange(SCENARIO.lidar.beams)


def policy(seen: dict[str, np.ndarray]) -> np.ndarray:
    """A twist (v, omega) towards the goal, pushed away from near hits."""
    ranges, goal = seen["scan"], seen["goal"]
    push = np.maximum(1.0 / np.maximum(ranges - 0.25, 0.05) - 1.0, 0.0) / len(ranges)
    x, y = goal / np.hypot(*goal) - 1.5 * np.array((push @ np.cos(BEARINGS), push @ np.sin(BEARINGS)))
    heading = np.arctan2(y, x)
    return np.array((0.6 * max(np.cos(heading), 0.0), 2.0 * heading), dtype=np.float32)


def main(png: Path | None) -> None:
    """Run one episode for each seed, and say how they went."""
    environment = gymnasium.make("drake_starnav.gym:starnav/Kinematic-v0", scenario=SCENARIO, disable_env_checker=True)
    outcomes, trails = [], []
    for seed in SEEDS:
        seen, info = environment.reset(seed=seed)
        world, poses, total, over = environment.unwrapped.world, [info["pose"]], 0.0, False
        while not over:
            seen, reward, terminated, truncated, info = environment.step(policy(seen))
            total, over = total + float(reward), terminated or truncated
            poses.append(info["pose"])
        outcomes.append(info["outcome"])
        trails.append((world, np.array(poses)))
        print(f"seed {seed}: {outcomes[-1]} after {len(poses) - 1} steps, return {total:.2f}")
    print(f"reached {outcomes.count('reached')} of {len(outcomes)}, {outcomes.count('collision')} collisions")
    if png is not None:
        figure = Figure(figsize=(9.0, 4.6), layout="constrained")
        for axis, (world, trail), outcome in zip(figure.subplots(2, 3).flat, trails, outcomes, strict=True):
            draw_world(axis, world)
            axis.plot(*trail[:, :2].T, color=BLUE)
            draw_robot(axis, trail[0], SCENARIO.robot.radius, BLUE)
            draw_goal(axis, world.goal, "")
            axis.set(aspect="equal", title=outcome)
            axis.set_axis_off()
        png.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(png, dpi=80)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--png", type=Path, metavar="FILE", help="also draw what happened")
    main(parser.parse_args().png)
