"""A control law with a braking certificate, as a Drake system."""

import math

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import Context, DiscreteValues, EventStatus, LeafSystem

from drake_starnav.control import Command, ControllerParameters, Law, control_step
from drake_starnav.control.braking_certificate import Certificate, braking_path
from drake_starnav.control.dynamic_step import dynamic_step
from drake_starnav.control.law import ControlInput, TrackedObstacles
from drake_starnav.errors import StarnavError
from drake_starnav.planning.guidance import Guidance
from drake_starnav.regions.safe_region import SafetyStar
from drake_starnav.robot import RobotParameters
from drake_starnav.systems.release import weakly
from drake_starnav.tracking import DynamicObstacleParameters, Tracks
from drake_starnav.utils.stopwatch import Stopwatch
from drake_starnav.utils.timing import checked_period

TWIST, VECTOR, ERRORS, CERTIFIED = range(4)
"""Groups of the discrete state."""


class CertifiedController(LeafSystem):
    """Follows guidance by a control law and sends only twists from which the robot can stop within observed free space.

    ```
                    ┌─────────────────────┐
    guidance ──────>│                     ├──> twist_command
    safety_star ───>│ CertifiedController ├──> guiding_vector
    state ─────────>│                     ├──> certificate
    tracks ────────>│                     │
                    └─────────────────────┘
    ```

    Ports:
        guidance: abstract, `Guidance` from any planner.
        safety_star: abstract, `SafetyStar`.
        state: vector (x, y, yaw, v, omega) of the robot in the world frame W; its pose is used.
        tracks: abstract, `Tracks` of the dynamic obstacles; only with `obstacles`.
        twist_command: vector (v, omega) within the robot's limits, m/s and rad/s.
        guiding_vector: unit vector (x, y) in W that a holonomic robot would follow; zero when there is none.
        certificate: abstract, `Certificate`.

    Periodic update at `controller.rate`; the last twist is discrete state, from which the next one is ramped. A pose
    that is not finite ends the simulation with a `StarnavError`.
    """

    def __init__(
        self,
        robot: RobotParameters,
        controller: ControllerParameters,
        *,
        law: Law = control_step,
        obstacles: DynamicObstacleParameters | None = None,
        lead: float = 0.0,
        stopwatch: Stopwatch | None = None,
    ) -> None:
        """
        Args:
            robot: its radius and limits.
            controller: parameters.
            law: one period as a pure function: `control_step`, dynamical system modulation, or another.
            obstacles: what is declared about dynamic obstacles; None: the world is static.
            lead: how far in the future the state of the port lies, s; see `StatePredictor`.
            stopwatch: records `command` times, if given.
        """
        super().__init__()
        self._robot, self._controller, self._law = robot, controller, law
        self._obstacles, self._lead = obstacles, lead
        self._stopwatch = stopwatch or Stopwatch()
        self._guidance = self.DeclareAbstractInputPort("guidance", Value(Guidance.none()))
        self._safety_star = self.DeclareAbstractInputPort("safety_star", Value(SafetyStar.none()))
        self._state = self.DeclareVectorInputPort("state", 5)
        if obstacles is not None:
            self._tracks = self.DeclareAbstractInputPort("tracks", Value(Tracks()))
        self.DeclareStateOutputPort("twist_command", self.DeclareDiscreteState(2))
        self.DeclareStateOutputPort("guiding_vector", self.DeclareDiscreteState(2))
        self.DeclareDiscreteState(2)
        self.DeclareDiscreteState(1)
        self.DeclareAbstractOutputPort("certificate", lambda: Value(Certificate.none()), weakly(self._calc_certificate))
        period = checked_period(self, rate=controller.rate)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, values: DiscreteValues) -> EventStatus:
        guidance = self._guidance.Eval(context)
        star = self._safety_star.Eval(context)
        pose = self._state.Eval(context)[:3].copy()
        if not all(map(math.isfinite, pose.tolist())):
            raise StarnavError(f"the controller's pose is {pose.tolist()}; allowed: finite x, y, m, and yaw, rad")
        held = context.get_discrete_state()
        twist, errors = held.value(TWIST).copy(), held.value(ERRORS).copy()
        with self._stopwatch.measure("command"):
            command = self._command(context, ControlInput(pose, twist, errors, guidance, star))
        values.set_value(TWIST, command.twist)
        values.set_value(VECTOR, command.guiding_vector)
        values.set_value(ERRORS, command.errors)
        values.set_value(CERTIFIED, np.array((float(command.certified),)))
        return EventStatus.Succeeded()

    def _command(self, context: Context, now: ControlInput) -> Command:
        if self._obstacles is None:
            return self._law(now, self._controller, self._robot)
        tracks = self._tracks.Eval(context)
        obstacles = TrackedObstacles(tracks, context.get_time() + self._lead - tracks.time, self._obstacles)
        return dynamic_step(self._law, now, self._controller, self._robot, obstacles)

    def _calc_certificate(self, context: Context, output: AbstractValue) -> None:
        held = context.get_discrete_state()
        twist, certified = held.value(TWIST), bool(held.value(CERTIFIED)[0])
        pose = self._state.Eval(context)[:3]
        period = 1.0 / self._controller.rate
        path = braking_path(pose, twist, np.zeros(2), period, self._robot.limits)
        output.set_value(Certificate(certified, path))
