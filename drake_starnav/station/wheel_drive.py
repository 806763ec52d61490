"""Bases with driven wheels on one axle: the speeds of the wheels, their slip, and their servo."""

import math
import warnings
from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, EventStatus, LeafSystem
from pydrake.systems.primitives import MatrixGain, Multiplexer

from drake_starnav.lidar.sensor_model import Stream, draw_random_numbers
from drake_starnav.robot import RobotParameters
from drake_starnav.station.robot_geometry import Drive, RobotModel, compute_wheel_rates
from drake_starnav.systems.release import declare_vector

SLIP_PERIOD = 1.0
"""Period with which the slip of the wheels is drawn, s."""


class WheelSpeedCommand(LeafSystem):
    """Turns a twist into the desired state of the wheel actuators, and no twist beyond the robot's limits.

    ```
                      ┌───────────────────┐
    twist_command ───>│ WheelSpeedCommand ├──> desired_state
                      └───────────────────┘
    ```

    Ports:
        twist_command: vector (v, omega), m/s and rad/s, left and forward positive, or of a car (v, curvature), m/s and
            1/m; cut off at the limits.
        desired_state: vector of n wheel angles (zero and unused, as is their gain) and n speeds, rad/s, in the order of
            the actuators, as `MultibodyPlant.get_desired_state_input_port` takes it.
    """

    def __init__(self, *, robot: RobotParameters, drive: Drive) -> None:
        """Command n wheels by a robot's base and limits."""
        super().__init__()
        self._base, self._limits, self._drive = robot.drive, robot.limits, drive
        self._twist = self.DeclareVectorInputPort("twist_command", 2)
        self._angles = [0.0] * len(drive.radii)
        size, compute = 2 * len(drive.radii), WheelSpeedCommand._compute_desired_state
        declare_vector(self, "desired_state", size, compute, {self._twist.ticket()})

    def _compute_desired_state(self, context: Context) -> list:
        twist = self._base.saturate(self._twist.Eval(context), self._limits).tolist()
        return self._angles + self._drive.rates(*self._base.body_rates(twist))


class WheelSlip(LeafSystem):
    """Reduces the desired speed of the wheels of each side by a seeded random share.

    ```
                      ┌───────────┐
    desired_state ───>│ WheelSlip ├──> slipping_state
                      └───────────┘
    ```

    Ports:
        desired_state: vector of 2 n values as in `WheelSpeedCommand`, rad/s.
        slipping_state: vector, the same with less speed.
    """

    def __init__(self, *, sides: Sequence[int], slip: float, seed: int) -> None:
        """Let n wheels on `sides`, 0 left and 1 right, lose up to the share `slip` of their speed."""
        super().__init__()
        self._sides, self._slip, self._seed = list(sides), slip, seed
        self._desired = self.DeclareVectorInputPort("desired_state", 2 * len(sides))
        declare_vector(self, "slipping_state", 2 * len(sides), WheelSlip._apply_slip)

    def _apply_slip(self, context: Context) -> np.ndarray:
        desired_twist = self._desired.Eval(context).copy()
        kept_shares = draw_wheel_shares(self._slip, self._seed, math.floor(context.get_time() / SLIP_PERIOD + 1e-9))
        desired_twist[len(self._sides) :] *= kept_shares[self._sides]
        return desired_twist


class WheelServo(Diagram):
    """Drives each wheel by a torque proportional to the error of its speed, by the gain of its actuator.

    ```
                        ┌────────────┐
    desired_state ─────>│            │
                        │ WheelServo ├──> actuation
    multibody_state ───>│            │
                        └────────────┘
    ```

    Ports:
        desired_state: vector as in `WheelSpeedCommand`, rad/s.
        multibody_state: vector of the robot's model, from the plant.
        actuation: vector, N m, for the plant's port of that name, which limits it to the actuators' efforts.

    A discrete plant holds the same servo in its joint actuators (see `add_robot`); a continuous one ignores gains
    there. CENIC linearizes it, so that it is integrated implicitly, as stiff as it is.
    """

    def __init__(self, robot: RobotModel) -> None:
        """Drive the wheels of a robot, as from `add_robot`, in a finalized plant."""
        super().__init__()
        wheel_rates = compute_wheel_rates(robot)
        n, size = wheel_rates.shape
        actuators = [robot.plant.GetJointActuatorByName(joint.name(), robot.index) for joint in robot.wheels]
        gain_of_each = np.array([[actuator.get_controller_gains().d] for actuator in actuators])
        gain_matrix = gain_of_each * np.hstack((np.zeros((n, n)), np.eye(n), -wheel_rates))
        builder = DiagramBuilder()
        state_multiplexer = builder.AddNamedSystem("both", Multiplexer([2 * n, size]))
        gain_system = builder.AddNamedSystem("gain", MatrixGain(gain_matrix))
        builder.Connect(state_multiplexer.get_output_port(), gain_system.get_input_port())
        builder.ExportInput(state_multiplexer.get_input_port(0), "desired_state")
        builder.ExportInput(state_multiplexer.get_input_port(1), "multibody_state")
        builder.ExportOutput(gain_system.get_output_port(), "actuation")
        builder.BuildInto(self)


class StepsCheck(LeafSystem):
    """Warns where a continuous plant is simulated by steps that `make_simulator` has not chosen, when that begins."""

    def __init__(self) -> None:
        """`chosen` is set by `make_simulator`."""
        super().__init__()
        self.chosen = False
        self.DeclareInitializationPublishEvent(self._check)

    def _check(self, context: Context) -> EventStatus:
        if not self.chosen:
            warnings.warn(
                "the plant is continuous, and a Simulator by itself takes hundreds of times as long as it needs; "
                "allowed: make_simulator(diagram), or a discrete plant, as by plant_config()",
                stacklevel=2,
            )
        return EventStatus.Succeeded()


def draw_wheel_shares(slip: float, seed: int, index: int) -> np.ndarray:
    """The share of its speed that each wheel, left and right, keeps in a second of that index; it may lose up to
    `slip`."""
    return 1.0 - slip * draw_random_numbers(seed, Stream.SLIP, index).random(2)
