"""A policy of your own in Drake's `DrakeGymEnv`, a batch of episodes with the certificate as its shield.

The policy here turns towards the goal and away from what is near; one that has been learned would see and answer the
same. It needs `pip install gymnasium`.

Run: python scripts/examples/09_batch_over_seeds.py [--png FILE]
"""

import argparse
from pathlib import Path

import gymnasium
import numpy as np
from matplotlib.figure import Figure
from pydrake.common import RandomGenerator
from pydrake.common.value import Value
from pydrake.gym import DrakeGymEnv
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import BasicVector, Context, DiagramBuilder, LeafSystem, System
from pydrake.systems.primitives import ConstantVectorSource, PassThrough

from drake_starnav import (
    ArrivalMonitor,
    CollisionMonitor,
    LaserScan,
    Parts,
    World,
    add_navigation,
    make_world,
    parse_scenario,
)
from drake_starnav.plotting import draw_goal, draw_robot, draw_world, save_figure
from drake_starnav.station import simulated

BLUE = "#0072B2"
SEEDS = range(6)
SCENARIO = parse_scenario(
    """
    world: !Forest {width: 10, height: 6, gap: [1.0, 1.4]}
    robot: {max_speed: 0.6}
    lidar: {beams: 180}
    """,
    name="small forest",
)
BEAMS = SCENARIO.lidar.beams
BEARINGS = SCENARIO.lidar.angle_min + SCENARIO.lidar.angle_increment * np.arange(BEAMS)
PERIOD, TIMEOUT = 0.1, 60.0  # s


class Observation(LeafSystem):
    """Scan, state and goal -> the ranges, m, the goal in the robot's frame, m, and what the goal is away, m."""

    def __init__(self) -> None:
        super().__init__()
        self.scan = self.DeclareAbstractInputPort("scan", Value[object]())
        self.state, self.goal = self.DeclareVectorInputPort("state", 5), self.DeclareVectorInputPort("goal", 2)
        self.DeclareVectorOutputPort("observation", BEAMS + 2, self.calc_observation)
        self.DeclareVectorOutputPort("distance", 1, self.calc_distance)

    def calc_observation(self, context: Context, output: BasicVector) -> None:
        scan: LaserScan = self.scan.Eval(context)
        x, y, yaw, *_ = self.state.Eval(context)
        to_goal = np.exp(-1j * yaw) * complex(*self.goal.Eval(context) - (x, y))
        ranges = np.clip(scan.ranges, 0.0, scan.range_max) if len(scan.ranges) else np.zeros(BEAMS)
        output.SetFromVector((*ranges, to_goal.real, to_goal.imag))

    def calc_distance(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector([np.hypot(*(self.goal.Eval(context) - self.state.Eval(context)[:2]))])


def make_simulator(world: World, seed: int) -> Simulator:
    """The navigation in a world; what is driven is the input `action`, as far as the certificate accepts it."""
    builder = DiagramBuilder()
    action, nobody = PassThrough(2), ConstantVectorSource([0.0, 0.0])
    navigation = add_navigation(builder, SCENARIO, Parts(world, planner=nobody, controller=action), seed)
    station = simulated(navigation.station)
    seen = builder.AddNamedSystem("observation", Observation())
    ArrivalMonitor.AddToBuilder(builder, navigation, tolerance=0.3, period=PERIOD)
    CollisionMonitor.AddToBuilder(builder, station)
    for source, system, port in (
        (station.GetOutputPort("lidar.scan"), seen, "scan"),
        (navigation.localization("state"), seen, "state"),
        (navigation.goal_position, seen, "goal"),
    ):
        builder.Connect(source, system.GetInputPort(port))
    builder.ExportInput(action.get_input_port(), "action")
    builder.ExportOutput(seen.GetOutputPort("observation"), "observation")
    builder.ExportOutput(seen.GetOutputPort("distance"), "distance")
    builder.ExportOutput(navigation.localization("pose"), "pose")
    return Simulator(builder.Build())


class Episodes:
    """The environment, with a new world in each episode."""

    def __init__(self) -> None:
        limits = np.array((SCENARIO.robot.max_speed, SCENARIO.robot.max_yaw_rate))
        self.env = gymnasium.wrappers.TimeLimit(
            DrakeGymEnv(
                self.make,
                time_step=PERIOD,
                action_space=gymnasium.spaces.Box(-limits, limits, dtype=np.float64),
                observation_space=gymnasium.spaces.Box(-np.inf, np.inf, (BEAMS + 2,), np.float64),
                reward=self.progress,
                action_port_id="action",
                observation_port_id="observation",
                hardware=True,  # its reset would take back the first scan
            ),
            round(TIMEOUT / PERIOD),
        )

    def make(self, generator: RandomGenerator) -> Simulator:
        """A simulator of the next episode."""
        seed = generator()
        self.world = make_world(SCENARIO.world, seed, SCENARIO.robot.radius)
        self.before: float | None = None
        return make_simulator(self.world, seed)

    def progress(self, system: System, context: Context) -> float:
        """What the distance to the goal shrank by since the last step, m."""
        (distance,) = system.GetOutputPort("distance").Eval(context)
        before, self.before = self.before, distance
        return 0.0 if before is None else before - distance

    @property
    def pose(self) -> np.ndarray:
        """(x, y, yaw) of the robot, W, m and rad."""
        simulator = self.env.unwrapped.simulator
        return simulator.get_system().GetOutputPort("pose").Eval(simulator.get_context()).copy()


def policy(seen: np.ndarray) -> np.ndarray:
    """A twist (v, omega) towards the goal, pushed away from near hits."""
    ranges, goal = seen[:BEAMS], seen[BEAMS:]
    push = np.maximum(1.0 / np.maximum(ranges - 0.25, 0.05) - 1.0, 0.0) / BEAMS
    x, y = goal / np.hypot(*goal) - 1.5 * np.array((push @ np.cos(BEARINGS), push @ np.sin(BEARINGS)))
    heading = np.arctan2(y, x)
    return np.array((0.6 * max(np.cos(heading), 0.0), 2.0 * heading))


def main(png: Path | None) -> None:
    """Run one episode for each seed, and say how they went."""
    episodes, trails = Episodes(), []
    env = episodes.env
    for seed in SEEDS:
        seen, _ = env.reset(seed=seed)
        poses, total, over = [episodes.pose], 0.0, False
        while not over:
            action = np.clip(policy(seen), env.action_space.low, env.action_space.high)
            seen, reward, terminated, truncated, _ = env.step(action)
            total, over = total + float(reward), terminated or truncated
            poses.append(episodes.pose)
        outcome = "timeout" if truncated else "reached" if np.hypot(*seen[BEAMS:]) < 0.3 else "collision"
        trails.append((episodes.world, np.array(poses), outcome))
        print(f"seed {seed}: {outcome} after {len(poses) - 1} steps, return {total:.2f}")
    outcomes = [outcome for *_, outcome in trails]
    print(f"reached {outcomes.count('reached')} of {len(outcomes)}, {outcomes.count('collision')} collisions")
    if png is not None:
        figure = Figure(figsize=(9.0, 4.6), layout="constrained")
        for axis, (world, trail, outcome) in zip(figure.subplots(2, 3).flat, trails, strict=True):
            draw_world(axis, world)
            axis.plot(*trail[:, :2].T, color=BLUE)
            draw_robot(axis, trail[0], SCENARIO.robot.radius, BLUE)
            draw_goal(axis, world.goal, "")
            axis.set(aspect="equal", title=outcome)
            axis.set_axis_off()
        save_figure(figure, png, legend=False)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--png", type=Path, metavar="FILE", help="also draw what happened")
    main(parser.parse_args().png)
