"""Methods to compare with, as a user's own are written: each is a function from a scenario to the parts that drive."""

from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import Context, ValueProducer

from drake_starnav.baselines.baseline_step import Baseline, BaselineInput, step_baseline
from drake_starnav.baselines.dsm_circles import DsmBaseline
from drake_starnav.baselines.dwa import DwaBaseline
from drake_starnav.baselines.foa import FoaBaseline
from drake_starnav.baselines.known_obstacles import KnownObstacles, find_known_obstacles
from drake_starnav.control import Proposal
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.schema import check_plain_robot
from drake_starnav.systems.controller import Controller
from drake_starnav.systems.release import weakly
from drake_starnav.utils.stopwatch import Stopwatch
from drake_starnav.worlds.world import World

NO_HITS, NOWHERE = np.zeros((0, 2)), World("nowhere", (0.0, 0.0, 0.0), (0.0, 0.0))


class BaselineController(Controller):
    """Proposes twists by a method to compare with: DSM with known circles, FOA or DWA.

    ```
                       ┌────────────────────┐
    goal ─────────────>│                    │
    short_term_goal ──>│                    │
    scan ─────────────>│                    ├──> desired_twist
    scan_pose ────────>│ BaselineController ├──> guiding_vector
    world ────────────>│                    │
    state ────────────>│                    │
    twist_command ────>│                    │
                       └────────────────────┘
    ```

    Ports:
        goal: vector (x, y) in W, m.
        short_term_goal: vector (x, y) in W, m, to head for instead; only of a method that follows the roadmap.
        scan: abstract, `LaserScan` in the sensor frame S; DSM does not read it.
        scan_pose: vector (x, y, yaw) of the robot, on whose axis the lidar is, in W at the time of the scan, m and rad;
            DSM does not read it.
        world: abstract, `World`; only of DSM, which knows all obstacles, as circles.
        state: vector (x, y, yaw, v, omega) of the robot in the world frame W; its pose is used.
        twist_command: vector (v, omega) that is commanded now, m/s and rad/s.
        desired_twist: vector (v, omega), m/s and rad/s.
        guiding_vector: unit vector (x, y) in W that the robot turns towards; zero when there is none.
    """

    def __init__(self, robot: RobotParameters, baseline: Baseline, *, stopwatch: Stopwatch | None = None) -> None:
        """Drive a robot by a method with its parameters; a stopwatch, if given, notes `command` times."""
        super().__init__(stopwatch)
        self._robot, self._baseline = robot, baseline
        self.needs_lidar_on_axis = not baseline.knows_obstacles
        self._goal = self.DeclareVectorInputPort("goal", 2)
        self._target = self.DeclareVectorInputPort("short_term_goal", 2) if baseline.follows_roadmap else self._goal
        if baseline.knows_obstacles:
            world = self._world = self.DeclareAbstractInputPort("world", Value(NOWHERE))
            producer = ValueProducer(lambda: Value(KnownObstacles.none()), weakly(self._find_obstacles))
            self._obstacles = self.DeclareCacheEntry("known obstacles", producer, {world.ticket()})
        self._scan = self.DeclareAbstractInputPort("scan", Value(LaserScan.nothing()))
        self._scan_pose = self.DeclareVectorInputPort("scan_pose", 3)
        self._state = self.DeclareVectorInputPort("state", 5)
        self._twist = self.DeclareVectorInputPort("twist_command", 2)
        self._declare_outputs()

    def _find_obstacles(self, context: Context, known: AbstractValue) -> None:
        inflation = self._robot.radius + self._baseline.margin
        known.set_value(find_known_obstacles(self._world.Eval(context), inflation))

    def _read(self, context: Context) -> BaselineInput:
        obstacles, points = KnownObstacles.none(), NO_HITS
        if self._baseline.knows_obstacles:
            obstacles = self._obstacles.Eval(context)
        else:
            points = self._scan.Eval(context).points(self._scan_pose.Eval(context))
        return BaselineInput(
            pose=self._state.Eval(context)[:3],
            twist=self._twist.Eval(context),
            target=self._target.Eval(context),
            goal=self._goal.Eval(context),
            points=points,
            obstacles=obstacles,
            robot=self._robot,
        )

    def _propose(self, read: BaselineInput) -> Proposal:
        return step_baseline(read, self._baseline)


def dsm(scenario: Any) -> dict[str, Any]:
    """Return what drives by DSM around known circles."""
    return make_parts(scenario, DsmBaseline())


def foa(scenario: Any) -> dict[str, Any]:
    """Return what drives by FOA."""
    return make_parts(scenario, FoaBaseline())


def foa_cluster(scenario: Any) -> dict[str, Any]:
    """Return what drives by FOA around clusters of hits."""
    return make_parts(scenario, FoaBaseline(clusters=True))


def foa_roadmap(scenario: Any) -> dict[str, Any]:
    """Return what drives by FOA to the short-term goals of our planner."""
    return make_parts(scenario, FoaBaseline(follows_roadmap=True))


def dwa(scenario: Any) -> dict[str, Any]:
    """Return what drives by the dynamic window."""
    return make_parts(scenario, DwaBaseline())


def make_parts(scenario: Any, baseline: Baseline) -> dict[str, Any]:
    """Return what drives in the place of our parts, by the fields of `Parts`. Nothing is certified.

    Raises:
        StarnavError: the scenario's robot is no differential drive, or a goal has a heading.
    """
    check_plain_robot(scenario)
    return {"controller": BaselineController(scenario.robot, baseline), "certified": False}
