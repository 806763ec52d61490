"""Controllers to compare with, as Drake systems."""

import dataclasses

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import Context

from drake_starnav.baselines.baseline_step import Baseline, BaselineInput, step_baseline
from drake_starnav.baselines.known_obstacles import KnownObstacles
from drake_starnav.control import Proposal
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.robot import RobotParameters
from drake_starnav.systems.controller import Controller
from drake_starnav.utils.stopwatch import Stopwatch

NO_HITS, NO_POSE = np.zeros((0, 2)), np.zeros(3)


class BaselineController(Controller):
    """Proposes twists by a method to compare with: DSM with known circles, FOA or DWA.

    ```
                       ┌────────────────────┐
    goal ─────────────>│                    │
    short_term_goal ──>│                    │
    scan ─────────────>│                    ├──> desired_twist
    scan_pose ────────>│ BaselineController ├──> guiding_vector
    obstacles ────────>│                    │
    state ────────────>│                    │
    twist_command ────>│                    │
                       └────────────────────┘
    ```

    Ports:
        goal: vector (x, y) in W, m.
        short_term_goal: vector (x, y) in W, m, to head for instead; may be left unconnected.
        scan: abstract, `LaserScan` in the sensor frame S; DSM does not read it.
        scan_pose: vector (x, y, yaw) of S in W at the time of the scan, m and rad; DSM does not read it.
        obstacles: abstract, `KnownObstacles`; only DSM reads it.
        state: vector (x, y, yaw, v, omega) of the robot in the world frame W; its pose is used.
        twist_command: vector (v, omega) that is commanded now, m/s and rad/s.
        desired_twist: vector (v, omega), m/s and rad/s.
        guiding_vector: unit vector (x, y) in W that the robot turns towards; zero when there is none.
    """

    def __init__(self, robot: RobotParameters, baseline: Baseline, *, stopwatch: Stopwatch | None = None) -> None:
        """Drive a robot by a method with its parameters; a stopwatch, if given, notes `command` times."""
        super().__init__(stopwatch)
        self._robot, self._baseline = robot, baseline
        self._goal = self.DeclareVectorInputPort("goal", 2)
        self._short_term_goal = self.DeclareVectorInputPort("short_term_goal", 2)
        self._scan = self.DeclareAbstractInputPort("scan", Value(LaserScan.nothing()))
        self._scan_pose = self.DeclareVectorInputPort("scan_pose", 3)
        self._obstacles = self.DeclareAbstractInputPort("obstacles", Value(KnownObstacles.none()))
        self._state = self.DeclareVectorInputPort("state", 5)
        self._twist = self.DeclareVectorInputPort("twist_command", 2)
        self._declare_outputs()

    def _read(self, context: Context) -> tuple[LaserScan | None, np.ndarray, BaselineInput]:
        goal = self._goal.Eval(context)
        target = self._short_term_goal.Eval(context) if self._short_term_goal.HasValue(context) else goal
        scan, scan_pose, obstacles = None, NO_POSE, KnownObstacles.none()
        if self._baseline.knows_obstacles:
            obstacles = self._obstacles.Eval(context)
        else:
            scan, scan_pose = self._scan.Eval(context), self._scan_pose.Eval(context)
        pose, twist = self._state.Eval(context)[:3], self._twist.Eval(context)
        return scan, scan_pose, BaselineInput(pose, twist, target, goal, NO_HITS, obstacles, self._robot)

    def _propose(self, read: tuple[LaserScan | None, np.ndarray, BaselineInput]) -> Proposal:
        scan, scan_pose, inputs = read
        if scan is not None:
            inputs = dataclasses.replace(inputs, points=scan.points(scan_pose))
        return step_baseline(inputs, self._baseline)
