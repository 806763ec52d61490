"""A batch of episodes with a policy of the user's own, by `reset(seed)` and `step(action)` as in Gymnasium.

The environment is a `NavigationStation` in a new forest for each seed; a step is a tenth of a second at one twist. The
policy here is a potential field; one that has been learned would see and answer the same.

Run: python scripts/examples/09_batch_over_seeds.py [--png FILE]
"""

import argparse
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from pydrake.systems.analysis import Simulator, SimulatorStatus
from pydrake.systems.framework import Diagram, DiagramBuilder

from drake_starnav import LaserScan, LidarParameters, NavigationStation, RobotParameters, World, make_world
from drake_starnav.baselines.potential_field import PotentialFieldParameters, potential_field_velocity
from drake_starnav.station.collision_monitor import CollisionMonitor
from drake_starnav.systems.release import release
from drake_starnav.visualization.world_figure import PATH, draw_goal, draw_robot, draw_world
from drake_starnav.worlds import Forest

SEEDS = range(6)
FOREST = Forest(width=10.0, height=6.0, gap=(1.0, 1.4))
ROBOT, LIDAR = RobotParameters(max_speed=0.6), LidarParameters(beams=180)
FIELD = PotentialFieldParameters(max_speed=0.6)
PERIOD = 0.1  # of a step, s
TOLERANCE = 0.3  # of the goal, m
TIMEOUT = 40.0  # of an episode, s


@dataclass(frozen=True)
class Observation:
    """What the robot knows: the scan, and the goal (x, y) in its own frame, m."""

    scan: LaserScan
    goal: np.ndarray


class ForestEnvironment:
    """One robot in a forest of its own."""

    _diagram: Diagram | None = None

    def reset(self, seed: int) -> Observation:
        """Begin an episode; its world and noise depend on the seed alone."""
        if self._diagram is not None:
            release(self._diagram)  # or those of all episodes would stay in memory
        self.world: World = make_world(FOREST, seed, ROBOT.radius)
        builder = DiagramBuilder()
        self._station = builder.AddSystem(NavigationStation(self.world, ROBOT, LIDAR, seed=seed))
        monitor = CollisionMonitor(robot=self._station.robot_geometries, ground=self._station.floor)
        builder.AddSystem(monitor)
        builder.Connect(self._station.GetOutputPort("cheat.geometry_query"), monitor.GetInputPort("geometry_query"))
        builder.ExportInput(self._station.GetInputPort("drive.twist_command"), "action")
        self._diagram = diagram = builder.Build()
        self._simulator = Simulator(diagram)
        self._action = diagram.GetInputPort("action")
        self._action.FixValue(self._simulator.get_mutable_context(), np.zeros(2))
        self._simulator.Initialize()
        return self._observed()

    def step(self, action: np.ndarray) -> tuple[Observation, float, bool, bool, dict[str, str]]:
        """Drive at a twist (v, omega) for a period: observation, reward, terminated, truncated, info."""
        before = self.pose
        limits = np.array((ROBOT.max_speed, ROBOT.max_yaw_rate))
        self._action.FixValue(self._simulator.get_mutable_context(), np.clip(action, -limits, limits))
        time = self._simulator.get_context().get_time() + PERIOD
        status = self._simulator.AdvanceTo(time)
        far, near = (math.dist(pose[:2], self.world.goal) for pose in (before, self.pose))
        collided = status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition
        outcome = "collision" if collided else "reached" if near < TOLERANCE else ""
        truncated = not outcome and time >= TIMEOUT
        return self._observed(), far - near, bool(outcome), truncated, {"outcome": outcome or "timeout"}

    @property
    def pose(self) -> np.ndarray:
        """(x, y, yaw) of the robot, m and rad, W."""
        return self._out("localization.pose").copy()

    def _observed(self) -> Observation:
        x, y, yaw = self.pose
        offset = np.array(self.world.goal) - (x, y)
        R_WB = np.array(((math.cos(yaw), -math.sin(yaw)), (math.sin(yaw), math.cos(yaw))))
        return Observation(self._out("lidar.scan"), offset @ R_WB)

    def _out(self, name: str):
        context = self._station.GetMyContextFromRoot(self._simulator.get_context())
        return self._station.GetOutputPort(name).Eval(context)


def policy(seen: Observation) -> np.ndarray:
    """A twist (v, omega) down a potential field in the robot's own frame."""
    x, y = potential_field_velocity(
        np.zeros(2), seen.goal, seen.scan.points(), robot_radius=ROBOT.radius, parameters=FIELD
    )
    heading = math.atan2(y, x)
    return np.array((math.hypot(x, y) * max(math.cos(heading), 0.0), 2.0 * heading))


def main(png: Path | None) -> None:
    """Run one episode for each seed, and say how they went."""
    environment = ForestEnvironment()
    outcomes, trails = [], []
    for seed in SEEDS:
        seen, total, over = environment.reset(seed), 0.0, False
        poses = [environment.pose]
        while not over:
            seen, reward, terminated, truncated, info = environment.step(policy(seen))
            total, over = total + reward, terminated or truncated
            poses.append(environment.pose)
        outcomes.append(info["outcome"])
        trails.append((environment.world, np.array(poses)))
        print(f"seed {seed}: {outcomes[-1]} after {len(poses) - 1} steps, return {total:.2f}")
    print(f"reached {outcomes.count('reached')} of {len(outcomes)}, {outcomes.count('collision')} collisions")
    if png is not None:
        figure = Figure(figsize=(9.0, 4.6), layout="constrained")
        for axis, (world, trail), outcome in zip(figure.subplots(2, 3).flat, trails, outcomes, strict=True):
            draw_world(axis, world)
            axis.plot(*trail[:, :2].T, color=PATH)
            draw_robot(axis, trail[0], ROBOT.radius, PATH)
            draw_goal(axis, world.goal, "")
            axis.set(aspect="equal", title=outcome)
            axis.set_axis_off()
        png.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(png, dpi=80)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--png", type=Path, metavar="FILE", help="also draw what happened")
    main(parser.parse_args().png)
