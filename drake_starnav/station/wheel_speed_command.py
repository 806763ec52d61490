"""Kinematics of a differential drive."""

from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_starnav.robot import Limits, saturated
from drake_starnav.systems.release import weakly


class WheelSpeedCommand(LeafSystem):
    """Turns a twist into the desired state of the two wheel actuators, and no twist beyond the robot's limits.

    ```
                      ┌───────────────────┐
    twist_command ───>│ WheelSpeedCommand ├──> desired_state
                      └───────────────────┘
    ```

    Ports:
        twist_command: vector (v, omega), m/s and rad/s, left and forward positive; cut off at the limits.
        desired_state: vector (0, 0, left, right): wheel angles (unused, for their gain is zero) and speeds, rad/s, as
            `MultibodyPlant.get_desired_state_input_port` takes it; (0, 0, right, left) with `right_first`.
    """

    def __init__(self, *, limits: Limits, wheel_radius: float, track: float, right_first: bool = False) -> None:
        """
        Args:
            limits: of the robot.
            wheel_radius: m.
            track: distance between the wheels' contact points, m.
            right_first: whether the right wheel's actuator comes before the left one's in the model.
        """
        super().__init__()
        self._limits, self._radius = limits, wheel_radius
        self._turn = -0.5 * track if right_first else 0.5 * track
        self._twist = self.DeclareVectorInputPort("twist_command", 2)
        self.DeclareVectorOutputPort("desired_state", 4, weakly(self._calc_state), {self._twist.ticket()})

    def _calc_state(self, context: Context, output: BasicVector) -> None:
        v, omega = saturated(self._twist.Eval(context), self._limits)
        turn = self._turn * omega
        output.SetFromVector([0.0, 0.0, (v - turn) / self._radius, (v + turn) / self._radius])
