"""The braking certificate between any controller and the drive, as a Drake system."""

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import Context, DiscreteValues, EventStatus, LeafSystem

from drake_starnav.control import ControllerParameters
from drake_starnav.control.braking_certificate import Certificate, braking_path
from drake_starnav.control.dynamic_step import dynamic_step
from drake_starnav.control.law import ControlInput, TrackedObstacles
from drake_starnav.control.shield import shielded
from drake_starnav.errors import StarnavError
from drake_starnav.planning.guidance import Guidance
from drake_starnav.regions.safe_region import SafetyStar
from drake_starnav.robot import RobotParameters
from drake_starnav.systems.release import weakly
from drake_starnav.tracking import DynamicObstacleParameters, Tracks
from drake_starnav.utils.timing import checked_period


class TwistShield(LeafSystem):
    """Lets a twist pass if the robot can stop within observed free space after it, and else slows it down or brakes.

    ```
                     ┌─────────────┐
    desired_twist ──>│             │
    safety_star ────>│ TwistShield ├──> twist_command
    state ──────────>│             ├──> certificate
    tracks ─────────>│             │
                     └─────────────┘
    ```

    Ports:
        desired_twist: vector (v, omega) of any controller, m/s and rad/s.
        safety_star: abstract, `SafetyStar`.
        state: vector (x, y, yaw, v, omega) of the robot in the world frame W; its pose is used.
        tracks: abstract, `Tracks` of the dynamic obstacles; only with `obstacles`.
        twist_command: vector (v, omega) within the robot's limits, m/s and rad/s.
        certificate: abstract, `Certificate`.

    Periodic update at `controller.rate`; the last twist is discrete state, from which the next one is ramped. A twist
    or a pose that is not finite ends the simulation with a `StarnavError`.
    """

    def __init__(
        self,
        robot: RobotParameters,
        controller: ControllerParameters,
        *,
        obstacles: DynamicObstacleParameters | None = None,
        lead: float = 0.0,
    ) -> None:
        """
        Args:
            robot: its radius and limits.
            controller: rate, delay and the certificate's parameters.
            obstacles: what is declared about dynamic obstacles; None: the world is static.
            lead: how far in the future the state of the port lies, s; see `StatePredictor`.
        """
        super().__init__()
        self._robot, self._controller, self._obstacles, self._lead = robot, controller, obstacles, lead
        self._desired = self.DeclareVectorInputPort("desired_twist", 2)
        self._safety_star = self.DeclareAbstractInputPort("safety_star", Value(SafetyStar.none()))
        self._state = self.DeclareVectorInputPort("state", 5)
        if obstacles is not None:
            self._tracks = self.DeclareAbstractInputPort("tracks", Value(Tracks()))
        self._twist, self._certified = self.DeclareDiscreteState(2), self.DeclareDiscreteState(1)
        self.DeclareStateOutputPort("twist_command", self._twist)
        self.DeclareAbstractOutputPort("certificate", lambda: Value(Certificate.none()), weakly(self._calc_certificate))
        period = checked_period(self, rate=controller.rate)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, values: DiscreteValues) -> EventStatus:
        desired, pose = self._desired.Eval(context).copy(), self._state.Eval(context)[:3].copy()
        if not (np.isfinite(desired).all() and np.isfinite(pose).all()):
            raise StarnavError(
                f"the shield's desired_twist is {desired.tolist()} at the pose {pose.tolist()}; allowed: finite numbers"
            )
        twist, star = context.get_discrete_state(self._twist).value().copy(), self._safety_star.Eval(context)
        now, law = ControlInput(pose, twist, np.zeros(2), Guidance.none(), star), shielded(desired)
        if self._obstacles is None:
            command = law(now, self._controller, self._robot)
        else:
            tracks = self._tracks.Eval(context)
            tracked = TrackedObstacles(tracks, context.get_time() + self._lead - tracks.time, self._obstacles)
            command = dynamic_step(law, now, self._controller, self._robot, tracked)
        values.set_value(self._twist, command.twist)
        values.set_value(self._certified, np.array((float(command.certified),)))
        return EventStatus.Succeeded()

    def _calc_certificate(self, context: Context, output: AbstractValue) -> None:
        twist = context.get_discrete_state(self._twist).value()
        certified = bool(context.get_discrete_state(self._certified).value()[0])
        period = 1.0 / self._controller.rate
        path = braking_path(self._state.Eval(context)[:3], twist, np.zeros(2), period, self._robot.limits)
        output.set_value(Certificate(certified, path))
