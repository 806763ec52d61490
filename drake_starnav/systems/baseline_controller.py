"""Controllers to compare with, as a Drake system."""

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import Context, DiscreteValues, EventStatus, LeafSystem

from drake_starnav.baselines import BaselineParameters, DsmParameters, KnownObstacles, Situation, baseline_step
from drake_starnav.control import ControllerParameters
from drake_starnav.control.braking_certificate import Certificate, braking_path
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.robot import RobotParameters
from drake_starnav.systems.release import weakly
from drake_starnav.utils.stopwatch import Stopwatch
from drake_starnav.utils.timing import checked_period

NO_HITS = np.zeros((0, 2))


class BaselineController(LeafSystem):
    """Drives by a method to compare with: DSM with known circles, FOA, DWA or a potential field.

    ```
                       ┌────────────────────┐
    goal ─────────────>│                    │
    short_term_goal ──>│                    ├──> twist_command
    scan ─────────────>│ BaselineController ├──> guiding_vector
    scan_pose ────────>│                    ├──> certificate
    obstacles ────────>│                    │
    state ────────────>│                    │
                       └────────────────────┘
    ```

    A replacement for `CertifiedController`.

    Ports:
        goal: vector (x, y) in W, m.
        short_term_goal: vector (x, y) in W, m, to head for instead; may be left unconnected.
        scan: abstract, `LaserScan` in the sensor frame S; DSM does not read it.
        scan_pose: vector (x, y, yaw) of S in W at the time of the scan, m and rad; DSM does not read it.
        obstacles: abstract, `KnownObstacles`; only DSM reads it.
        state: vector (x, y, yaw, v, omega) of the robot in the world frame W; its pose is used.
        twist_command: vector (v, omega) within the robot's limits, m/s and rad/s.
        guiding_vector: unit vector (x, y) in W that the robot turns towards; zero when there is none.
        certificate: abstract, `Certificate`; a baseline certifies nothing, but its braking path is drawn.

    Periodic update at `controller.rate`; the last twist is discrete state, from which the next one is ramped.
    """

    def __init__(
        self,
        robot: RobotParameters,
        controller: ControllerParameters,
        settings: BaselineParameters,
        *,
        stopwatch: Stopwatch | None = None,
    ) -> None:
        """
        Args:
            robot: its radius and limits.
            controller: rate, turning and slowing down, as of `CertifiedController`.
            settings: of the baseline; their type selects it.
            stopwatch: records `command` times, if given.
        """
        super().__init__()
        self._robot, self._controller, self._settings = robot, controller, settings
        self._stopwatch = stopwatch or Stopwatch()
        self._goal = self.DeclareVectorInputPort("goal", 2)
        self._short_term_goal = self.DeclareVectorInputPort("short_term_goal", 2)
        self._scan = self.DeclareAbstractInputPort("scan", Value(LaserScan.nothing()))
        self._scan_pose = self.DeclareVectorInputPort("scan_pose", 3)
        self._obstacles = self.DeclareAbstractInputPort("obstacles", Value(KnownObstacles.none()))
        self._state = self.DeclareVectorInputPort("state", 5)
        self._twist, self._vector = self.DeclareDiscreteState(2), self.DeclareDiscreteState(2)
        self.DeclareStateOutputPort("twist_command", self._twist)
        self.DeclareStateOutputPort("guiding_vector", self._vector)
        self.DeclareAbstractOutputPort("certificate", lambda: Value(Certificate.none()), weakly(self._calc_certificate))
        period = checked_period(self, rate=controller.rate)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, values: DiscreteValues) -> EventStatus:
        goal = self._goal.Eval(context).copy()
        target = self._short_term_goal.Eval(context).copy() if self._short_term_goal.HasValue(context) else goal
        pose = self._state.Eval(context)[:3].copy()
        before = context.get_discrete_state(self._twist).value().copy()
        knows = isinstance(self._settings, DsmParameters)
        obstacles = self._obstacles.Eval(context) if knows else KnownObstacles.none()
        scan = None if knows else self._scan.Eval(context)
        scan_pose = None if knows else self._scan_pose.Eval(context).copy()
        with self._stopwatch.measure("command"):
            points = NO_HITS if scan is None else scan.points(scan_pose)
            situation = Situation(pose, before, target, goal, points, obstacles)
            twist, direction = baseline_step(situation, self._settings, self._controller, self._robot)
        values.set_value(self._twist, twist)
        values.set_value(self._vector, direction)
        return EventStatus.Succeeded()

    def _calc_certificate(self, context: Context, output: AbstractValue) -> None:
        pose, held = self._state.Eval(context)[:3], context.get_discrete_state(self._twist).value()
        path = braking_path(pose, held, np.zeros(2), 1.0 / self._controller.rate, self._robot.limits)
        output.set_value(Certificate(False, path))
