"""Kinematics of a differential drive."""

from pydrake.systems.framework import BasicVector, Context, LeafSystem


class WheelSpeedCommand(LeafSystem):
    """Turns a twist into the desired state of the two wheel actuators.

    ```
                      ┌───────────────────┐
    twist_command ───>│ WheelSpeedCommand ├──> desired_state
                      └───────────────────┘
    ```

    Ports:
        twist_command: vector (v, omega), m/s and rad/s, left and forward positive.
        desired_state: vector (0, 0, left, right): wheel angles (unused, for their gain is zero) and speeds, rad/s, as
            `MultibodyPlant.get_desired_state_input_port` takes it.
    """

    def __init__(self, *, wheel_radius: float, track: float) -> None:
        """
        Args:
            wheel_radius: m.
            track: distance between the wheels' contact points, m.
        """
        super().__init__()
        self._wheel_radius, self._track = wheel_radius, track
        self._twist_command = self.DeclareVectorInputPort("twist_command", 2)
        # without the prerequisite it would be evaluated at every step of the plant
        self.DeclareVectorOutputPort("desired_state", 4, self._calc, {self._twist_command.ticket()})

    def _calc(self, context: Context, output: BasicVector) -> None:
        v, omega = self._twist_command.Eval(context)
        turn = 0.5 * self._track * omega
        output.SetFromVector((0.0, 0.0, (v - turn) / self._wheel_radius, (v + turn) / self._wheel_radius))
