"""Kinematics of a differential drive."""

import numpy as np
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import MatrixGain


class WheelSpeedCommand(Diagram):
    """Turns a twist into the desired state of the two wheel actuators.

    ```
                      ┌───────────────────┐
    twist_command ───>│ WheelSpeedCommand ├──> desired_state
                      └───────────────────┘
    ```

    Ports:
        twist_command: vector (v, omega), m/s and rad/s, left and forward positive.
        desired_state: vector (0, 0, left, right): wheel angles (unused, for their gain is zero) and speeds, rad/s, as
            `MultibodyPlant.get_desired_state_input_port` takes it; (0, 0, right, left) with `right_first`.
    """

    def __init__(self, *, wheel_radius: float, track: float, right_first: bool = False) -> None:
        """
        Args:
            wheel_radius: m.
            track: distance between the wheels' contact points, m.
            right_first: whether the right wheel's actuator comes before the left one's in the model.
        """
        super().__init__()
        turn = -0.5 * track if right_first else 0.5 * track
        speeds = np.array(((0.0, 0.0), (0.0, 0.0), (1.0, -turn), (1.0, turn))) / wheel_radius
        builder = DiagramBuilder()
        gain = builder.AddNamedSystem("gain", MatrixGain(speeds))
        builder.ExportInput(gain.get_input_port(), "twist_command")
        builder.ExportOutput(gain.get_output_port(), "desired_state")
        builder.BuildInto(self)
