"""Kinematics of bases with driven wheels on one axle."""

from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_starnav.robot import RobotParameters
from drake_starnav.station.robot_geometry import Drive
from drake_starnav.systems.release import weakly


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
        """Of a robot's base and limits, and its n wheels."""
        super().__init__()
        self._base, self._limits, self._drive, n = robot.drive, robot.limits, drive, len(drive.radii)
        self._twist = self.DeclareVectorInputPort("twist_command", 2)
        standing = BasicVector([0.0] * (2 * n))
        self.DeclareVectorOutputPort("desired_state", standing, weakly(self._calc_state), {self._twist.ticket()})

    def _calc_state(self, context: Context, output: BasicVector) -> None:
        rates = self._drive.rates(*self._base.body_rates(self._base.saturated(self._twist.Eval(context), self._limits)))
        output.get_mutable_value()[len(rates) :] = rates
