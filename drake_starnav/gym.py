"""Navigation as environments of Gymnasium, with the braking certificate as a shield (extra `gym`).

`gymnasium.make("drake_starnav.gym:starnav/Kinematic-v0")` for training, `...:starnav/Plant-v0` with Drake's plant;
`gymnasium.make_vec` of the same names for several at once.
"""

import functools
import math
import operator
import os
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv, VectorEnv
from gymnasium.vector.utils import batch_space
from pydrake.systems.analysis import SimulatorStatus
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, PassThrough

from drake_starnav.errors import StarnavError, UnsupportedError
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.loading import load_scenario
from drake_starnav.navigation import Parts, add_navigation
from drake_starnav.navigation.robot import robot_world
from drake_starnav.navigation.validation import validated_margins
from drake_starnav.scenario.schema import Scenario
from drake_starnav.simulation.kinematics import KinematicMotion
from drake_starnav.simulation.monitors import add_collision_monitor
from drake_starnav.station.navigation_station import add_station
from drake_starnav.station.plant import advance, make_simulator, value_of
from drake_starnav.systems.release import release
from drake_starnav.systems.twist_shield import Unshielded
from drake_starnav.worlds.world import World

PERIOD = 0.1
"""Duration of a step of the environment, s."""
BONUS = 1.0
"""Reward for the goal, and penalty for a contact."""
UNSIMULATED = (
    *("obstacles.max_speed", "drive.delay", "drive.slip", "localization.drift", "localization.jump"),
    *(f"lidar.{name}" for name in ("delay", "scan_loss", "silence_duration", "rolling", "outliers")),
)
"""Faults and movers that the kinematics do not have."""


class NavigationEnv(gymnasium.Env):
    """A robot with a lidar in a new world of a scenario for each episode.

    Observation: `scan`, ranges in m with `range_max` where there is no return and 0 for a lost beam; `goal`, (x, y) in
    the robot's frame, m; `twist`, (v, omega) of the robot, m/s and rad/s. Action: (v, omega) to drive, m/s and rad/s.
    Reward: the progress towards the goal in m, 1 more at the goal and 1 less at a contact, with either of which an
    episode ends; after the world's timeout it is truncated. `info` has `outcome` and `pose`.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": round(1.0 / PERIOD)}

    def __init__(
        self,
        scenario: str | Scenario = "forest",
        *,
        shield: bool = True,
        plant: bool = False,
        render_mode: str | None = None,
    ) -> None:
        """
        Args:
            scenario: or its name.
            shield: whether an action is driven only as far as the certificate accepts it.
            plant: whether Drake's plant moves the robot, or, many times faster, its kinematics, exactly as commanded.
            render_mode: `rgb_array` for pictures by `render`, which take matplotlib; None for none.

        Raises:
            UnsupportedError: the scenario declares moving obstacles or faults that the kinematics do not have.
            StarnavError: the lidar sees too little for the shield, or there is no such mode.
        """
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise StarnavError(f"render_mode is {render_mode}; allowed: rgb_array, or None")
        self.render_mode = render_mode
        self._scenario = load_scenario(scenario) if isinstance(scenario, str) else scenario
        if self._scenario.lidars:
            raise UnsupportedError(f"lidars has {len(self._scenario.lidars)} entries; allowed: the one lidar")
        if self._scenario.robot.base != "differential":
            raise UnsupportedError(f"robot.base is {self._scenario.robot.base}; allowed: differential")
        self._shield = shield
        self._motion_kind: type[PlantMotion | KinematicMotion] = PlantMotion if plant else KinematicMotion
        if not plant:
            _check_kinematic(self._scenario)
        if shield:
            validated_margins(self._scenario)
        lidar, robot = self._scenario.lidar, self._scenario.robot
        limits = np.array((robot.max_speed, robot.max_yaw_rate), dtype=np.float32)
        self.action_space = gymnasium.spaces.Box(-limits, limits, dtype=np.float32)
        self.observation_space = gymnasium.spaces.Dict(
            {
                "scan": gymnasium.spaces.Box(0.0, np.float32(lidar.range_max), (lidar.beams,), np.float32),
                "goal": gymnasium.spaces.Box(-np.inf, np.inf, (2,), np.float32),
                "twist": gymnasium.spaces.Box(-np.inf, np.inf, (2,), np.float32),
            }
        )
        self._motion: PlantMotion | KinematicMotion | None = None

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[dict, dict]:
        """Begin an episode; its world and noise follow from the seed, or else from the last one given."""
        super().reset(seed=seed)
        self.close()
        number = int(self.np_random.integers(2**31))
        self.world = robot_world(self._scenario, number)
        self._motion = self._motion_kind(self._scenario, self.world, number, self._shield)
        self._time = 0.0
        return self._observed(), self._info("")

    def step(self, action: np.ndarray) -> tuple[dict, float, bool, bool, dict]:
        """Drive at a twist for a period: observation, reward, terminated, truncated, info."""
        if self._motion is None:
            raise StarnavError("the environment has no episode; allowed: reset() before step()")
        action = np.asarray(action, dtype=float)
        if action.shape != (2,) or not np.isfinite(action).all():
            raise StarnavError(f"action is {action.tolist()}; allowed: finite (v, omega), m/s and rad/s")
        before = self._distance()
        self._motion.drive(np.clip(action, self.action_space.low, self.action_space.high), PERIOD)
        self._time += PERIOD
        settings, distance = self._scenario.simulation, self._distance()
        reached = distance < settings.goal_tolerance
        outcome = "collision" if self._motion.touched else "reached" if reached else ""
        late = self._time >= (settings.timeout or self.world.timeout) - 1e-9
        reward = before - distance + {"collision": -BONUS, "reached": BONUS}.get(outcome, 0.0)
        info = self._info(outcome or ("timeout" if late else ""))
        return self._observed(), float(reward), bool(outcome), bool(late and not outcome), info

    def render(self) -> np.ndarray | None:
        """The world from above, the robot in it and what its last scan hit: shape (height, width, 3), bytes."""
        if self.render_mode is None or self._motion is None:
            return None
        from drake_starnav.visualization.world_figure import START, draw_goal, draw_robot, figure_pixels, world_axes

        figure, axis = world_axes(self.world, f"{self._scenario.name}, {self._time:.1f} s")
        pose = self._motion.pose
        axis.plot(*self._motion.scan.points(pose).T, ".", color=START, markersize=3.0)
        draw_robot(axis, pose, self._scenario.robot.radius, START)
        draw_goal(axis, self.world.goal)
        return figure_pixels(figure)

    def close(self) -> None:
        """Give back the memory of the episode."""
        if self._motion is not None:
            self._motion.close()
            self._motion = None

    def _distance(self) -> float:
        assert self._motion is not None
        return math.dist(self._motion.pose[:2], self.world.goal)

    def _observed(self) -> dict[str, np.ndarray]:
        assert self._motion is not None
        scan, (x, y, yaw) = self._motion.scan, self._motion.pose
        ranges = np.fmin(np.fmax(scan.ranges, 0.0), scan.range_max)  # of a lost beam 0
        dx, dy = self.world.goal[0] - x, self.world.goal[1] - y
        goal = (math.cos(yaw) * dx + math.sin(yaw) * dy, math.cos(yaw) * dy - math.sin(yaw) * dx)
        seen = {"scan": ranges, "goal": goal, "twist": self._motion.twist}
        return {name: np.array(value, dtype=np.float32) for name, value in seen.items()}

    def _info(self, outcome: str) -> dict[str, Any]:
        assert self._motion is not None
        return {"outcome": outcome, "pose": self._motion.pose.copy()}


class NavigationVectorEnv(VectorEnv):
    """Environments in several processes, this one among them, each of which steps its share one after the other.

    That is one message a step for a process, where gymnasium's `AsyncVectorEnv` alone needs one for each environment.
    What they return, and which seeds they get, is as of gymnasium's `SyncVectorEnv`. Processes are spawned, as a fork
    may hang with Drake's threads: a script makes them below `if __name__ == "__main__":`.
    """

    metadata: dict[str, Any] = {"autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(self, num_envs: int = 1, *, processes: int | None = None, **settings: Any) -> None:
        """In at most so many `processes`, else one for each core: as many as share the environments evenly.

        `settings` are those of `NavigationEnv`, whose errors are raised.
        """
        most = (os.cpu_count() or 1) if processes is None else processes
        if min(num_envs, most) < 1:
            raise StarnavError(f"num_envs is {num_envs}, processes {processes}; allowed: whole numbers > 0")
        count = max(count for count in range(1, most + 1) if num_envs % count == 0)
        self._size = num_envs // count
        envs = [functools.partial(NavigationEnv, **settings)] * self._size
        self._own, self._others = SyncVectorEnv(envs, copy=count == 1), None
        if count > 1:
            shares, mode = [functools.partial(_Share, envs, copy=False)] * (count - 1), AutoresetMode.DISABLED
            self._others = AsyncVectorEnv(shares, copy=False, autoreset_mode=mode, context="spawn")
        self.num_envs, self.processes = num_envs, [] if self._others is None else self._others.processes
        self.single_observation_space = self._own.single_observation_space
        self.single_action_space = self._own.single_action_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def reset(self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None) -> Any:
        """Begin episodes, with seeds that count on from one number or are those of a list: observations, info."""
        seeds = range(seed, seed + self.num_envs) if isinstance(seed, int) else seed or [None] * self.num_envs
        own, *shared = self._shared(list(seeds))
        if self._others is None:
            return self._own.reset(seed=own, options=options)
        self._others.reset_async(seed=shared, options=options)
        return self._all(self._own.reset(seed=own, options=options), self._others.reset_wait())

    def step(self, actions: np.ndarray) -> Any:
        """Drive all at their twists, shape (num_envs, 2): as of `NavigationEnv.step`, each with a row for each."""
        own, *shared = self._shared(actions)
        if self._others is None:
            return self._own.step(own)
        self._others.step_async(np.array(shared))
        return self._all(self._own.step(own), self._others.step_wait())

    def close_extras(self, **kwargs: Any) -> None:
        """End the processes."""
        self._own.close()
        if self._others is not None:
            self._others.close(**kwargs)

    def _shared(self, rows: Any) -> list:
        return [rows[k : k + self._size] for k in range(0, self.num_envs, self._size)]

    def _all(self, own: tuple, others: tuple) -> tuple:
        """What the shares returned, with a row for each environment."""
        rows = {name: np.concatenate((first, *others[0][name])) for name, first in own[0].items()}
        flags = [np.concatenate((first, *more)) for first, more in zip(own[1:-1], others[1:-1], strict=True)]
        infos = [own[-1], *(info for (info,) in others[-1]["share"])]
        return rows, *flags, {name: np.concatenate([each[name] for each in infos]) for name in infos[0]}


class _Share(SyncVectorEnv):
    """Environments of one process, which answer as one environment."""

    def reset(self, **settings: Any) -> tuple:
        seen, info = super().reset(**settings)
        return seen, {"share": (info,)}

    def step(self, actions: np.ndarray) -> tuple:
        *found, info = super().step(actions)
        return *found, {"share": (info,)}


class PlantMotion:
    """The station of Drake's plant, with the shield before its drive."""

    def __init__(self, scenario: Scenario, world: World, seed: int, shield: bool) -> None:
        builder = DiagramBuilder()
        action, nobody = PassThrough(2), ConstantVectorSource([0.0, 0.0])
        station = add_station(builder, world, scenario, continuous=True, seed=seed)
        unshielded = None if shield else Unshielded(scenario.robot, scenario.controller)
        parts = Parts(world, station, planner=nobody, controller=action, shield=unshielded)
        navigation = add_navigation(builder, scenario, parts, seed)
        add_collision_monitor(builder, navigation)
        builder.ExportInput(action.get_input_port(), "action")
        self._station, self._diagram = station, builder.Build()
        self._simulator = make_simulator(self._diagram, settings=scenario.simulator_config)
        self.touched, self._action = False, self._diagram.GetInputPort("action")
        self._action.FixValue(self._simulator.get_mutable_context(), np.zeros(2))
        self._simulator.Initialize()

    @property
    def pose(self) -> np.ndarray:
        """(x, y, yaw), W, m and rad."""
        return self._out("localization.pose").copy()

    @property
    def twist(self) -> np.ndarray:
        """(v, omega), m/s and rad/s."""
        return self._out("localization.state")[3:].copy()

    @property
    def scan(self) -> LaserScan:
        """The last scan."""
        return self._out("lidar.scan")

    def _out(self, name: str) -> Any:
        return value_of(self._station.GetOutputPort(name), self._simulator.get_context())

    def drive(self, twist: np.ndarray, duration: float) -> None:
        """Drive at a twist (v, omega), m/s and rad/s, for a time, s."""
        self._action.FixValue(self._simulator.get_mutable_context(), twist)
        status = advance(self._simulator, self._simulator.get_context().get_time() + duration)
        self.touched = status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition

    def close(self) -> None:
        """Let Drake free the diagram."""
        release(self._diagram)


def _check_kinematic(scenario: Scenario) -> None:
    for name in UNSIMULATED:
        if value := operator.attrgetter(name)(scenario):
            raise UnsupportedError(f"{name} is {value} with plant=False; allowed: 0, or plant=True")


for _name, _plant in (("Kinematic", False), ("Plant", True)):
    gymnasium.register(
        f"starnav/{_name}-v0",
        "drake_starnav.gym:NavigationEnv",
        vector_entry_point="drake_starnav.gym:NavigationVectorEnv",
        kwargs={"plant": _plant},
    )
