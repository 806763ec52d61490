"""Between any controller and the drive: limits, certificates and ramp, as Drake systems."""

import math
from dataclasses import replace
from time import perf_counter

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from drake_starnav.control import ControllerParameters
from drake_starnav.errors import StarnavError, shown
from drake_starnav.moving.certificate import make_certificates
from drake_starnav.moving.kalman_tracks import Tracks
from drake_starnav.moving.parameters import DynamicObstacleParameters
from drake_starnav.moving.tracker import TrackedObstacles
from drake_starnav.robot import RobotParameters
from drake_starnav.robot.motion import Actuation, BrakingMotion, roll_out
from drake_starnav.safety.certificates import Certificate
from drake_starnav.safety.clear import ClearanceCertificate
from drake_starnav.safety.shield import make_braking_twist, ramp_twist, shield_twist
from drake_starnav.surroundings.margins import Margins
from drake_starnav.surroundings.surroundings import Surroundings
from drake_starnav.systems.release import declare_value
from drake_starnav.utils.stopwatch import Stopwatch
from drake_starnav.utils.timing import check_period


class Unshielded(LeafSystem):
    """Drives what a controller desires within the robot's limits, whatever is in the way.

    ```
                     ┌────────────┐
    desired_twist ──>│ Unshielded ├──> twist_command
    state ──────────>│            ├──> certificate
                     └────────────┘
    ```

    For methods to compare with, as published; `TwistShield` is for everything else.

    Ports:
        desired_twist: vector of any controller, as the base's twists are; see `robot.base`.
        state: vector (x, y, yaw, v, omega) of the robot in the world frame W; its pose is used.
        twist_command: vector of the same size, within the robot's limits.
        certificate: abstract, `BrakingMotion`, to be drawn; it is never certified.

    Periodic update at `controller.rate`; the last twist is discrete state, from which the next one is ramped. A twist
    or a pose that is not finite ends the simulation with a `StarnavError`.
    """

    def __init__(
        self, robot: RobotParameters, controller: ControllerParameters, *, stopwatch: Stopwatch | None = None
    ) -> None:
        """Drive a robot at its controller's rate; a stopwatch, if given, notes `command` times of both systems."""
        super().__init__()
        self._actuation = Actuation(robot.limits, robot.shape, 1.0 / controller.rate, controller.delay, robot.drive)
        self._stopwatch = stopwatch or Stopwatch()
        size = len(robot.drive.components)
        self._desired = self.DeclareVectorInputPort("desired_twist", size)
        self._state = self.DeclareVectorInputPort("state", 5)
        self._twist, self._certified = self.DeclareDiscreteState(size), self.DeclareDiscreteState(1)
        self.DeclareStateOutputPort("twist_command", self._twist)
        declare_value(self, "certificate", BrakingMotion.none(), Unshielded._certificate)
        self.DeclarePeriodicDiscreteUpdateEvent(check_period(self, rate=controller.rate), 0.0, self._update)

    def _update(self, context: Context, values: DiscreteValues) -> None:
        pose = self._state.Eval(context)[:3]
        certified_by = self.certificates(context, pose[:2])
        count = self._stopwatch.count("command")
        desired_twist, begin = self._desired.Eval(context), perf_counter()
        if not math.isfinite(sum(desired_twist.tolist()) + sum(pose.tolist())):
            raise StarnavError(
                f"desired_twist is {desired_twist.tolist()} at the pose {pose.tolist()}; allowed: finite numbers"
            )
        twist = values.get_mutable_value(self._twist)  # as it was
        target = self._actuation.base.saturate(desired_twist, self._actuation.limits)
        if certified_by is None:
            driven_twist, is_certified = ramp_twist(twist, target, self._actuation), False
        else:
            driven_twist, is_certified = shield_twist(pose, twist, target, *certified_by)
        self._stopwatch.note("command", begin, since=count)
        twist[:] = driven_twist
        values.get_mutable_value(self._certified)[0] = is_certified

    def certificates(self, context: Context, position: np.ndarray) -> tuple[tuple[Certificate, ...], Actuation] | None:
        """The certificates that must accept what is driven, and the effect of commands; None: there are none."""
        return None

    def _certificate(self, context: Context) -> BrakingMotion:
        twist = context.get_discrete_state(self._twist).value()
        is_certified = bool(context.get_discrete_state(self._certified).value()[0])
        actuation = replace(self._actuation, delay=0.0)
        rest = make_braking_twist(twist, twist, actuation.limits, False)
        path = roll_out(self._state.Eval(context), twist, rest, actuation).pose
        return BrakingMotion(is_certified, path)


class TwistShield(Unshielded):
    """Drives what a controller desires as far as every certificate accepts it, and else slows down or brakes.

    ```
                        ┌─────────────┐
    desired_twist ─────>│             │
    state ─────────────>│ TwistShield ├──> twist_command
    surroundings ──────>│             ├──> certificate
    tracks ────────────>│             │
                        └─────────────┘
    ```

    Ports:
        desired_twist: vector of any controller, as the base's twists are; see `robot.base`.
        state: vector (x, y, yaw, v, omega) of the robot in the world frame W; its pose is used.
        surroundings: abstract, `Surroundings`.
        tracks: abstract, `Tracks` of the moving obstacles; only with `obstacles`.
        twist_command: vector of the same size, within the robot's limits.
        certificate: abstract, `BrakingMotion`.

    Periodic update at `controller.rate`; the last twist is discrete state, from which the next one is ramped. A twist
    or a pose that is not finite ends the simulation with a `StarnavError`.
    """

    def __init__(
        self,
        robot: RobotParameters,
        controller: ControllerParameters,
        margins: Margins,
        *,
        certificates: tuple[Certificate, ...] = (),
        obstacles: DynamicObstacleParameters | None = None,
        state_lead: float = 0.0,
        stopwatch: Stopwatch | None = None,
    ) -> None:
        """
        Args:
            certificates: of your own, each of which must accept a motion, too; as `KeepOut` and `SpeedZone`.
            obstacles: what is declared about moving obstacles; None: the world is static.
            state_lead: how far in the future the state of the port lies, s; see `StatePredictor`.
            stopwatch: notes `command` times, the controller's included, if given.
        """
        super().__init__(robot, controller, stopwatch=stopwatch)
        self.own_certificates, self._obstacles, self._state_lead = certificates, obstacles, state_lead
        _check_certificates(certificates, self._actuation)
        self._surroundings = self.DeclareAbstractInputPort("surroundings", Value(Surroundings.unknown()))
        self._margin = margins.safety
        if obstacles is not None:
            self._tracks = self.DeclareAbstractInputPort("tracks", Value(Tracks()))

    def certificates(self, context: Context, position: np.ndarray) -> tuple[tuple[Certificate, ...], Actuation] | None:
        surroundings, actuation = self._surroundings.Eval(context), self._actuation
        standard: tuple[Certificate, ...]
        if self._obstacles is None:
            standard = (ClearanceCertificate(surroundings, self._margin, actuation.footprint),)
        else:
            tracks = self._tracks.Eval(context)
            tracked_obstacles = TrackedObstacles(
                tracks, context.get_time() + self._state_lead - tracks.time, self._obstacles
            )
            standard = make_certificates(surroundings, self._margin, actuation, position, tracked_obstacles)
        return standard + self.own_certificates, actuation


def _check_certificates(certificates: tuple[Certificate, ...], actuation: Actuation) -> None:
    """Raise a `StarnavError` unless each certificate decides about the motion of a robot that stands."""
    standing_twist = np.zeros(len(actuation.base.components))
    for k, each in enumerate(certificates):
        name = f"certificates[{k}] is a {type(each).__name__}"
        if not callable(getattr(each, "accepts", None)):
            raise StarnavError(f"{name} without a method accepts; allowed: one with accepts(motion) -> bool")
        is_accepted = each.accepts(roll_out(np.zeros(3), standing_twist, standing_twist, actuation))
        if not isinstance(is_accepted, (bool, np.bool_)):
            raise StarnavError(f"{name} whose accepts(motion) is {shown(is_accepted)}; allowed: True or False")
