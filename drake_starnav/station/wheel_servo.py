"""Velocity servo of the wheels, for a plant that cannot have it in its own joint actuators."""

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import MatrixGain, Multiplexer

from drake_starnav.station.robot_geometry import actuated_joints, wheel_rates


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
        desired_state: vector as of `WheelSpeedCommand`, rad/s.
        multibody_state: vector of the robot's model, from the plant.
        actuation: vector, N m, for the plant's port of that name, which limits it to the actuators' efforts.

    A discrete plant holds the same servo in its joint actuators (see `add_robot`); a continuous one ignores gains
    there. CENIC linearizes it, so that it is integrated implicitly, as stiff as it is.
    """

    def __init__(self, plant: MultibodyPlant, model: ModelInstanceIndex) -> None:
        """Of a robot as from `add_robot` in a finalized plant."""
        super().__init__()
        rates = wheel_rates(plant, model)
        n, size = rates.shape
        actuators = [plant.GetJointActuatorByName(joint.name(), model) for joint in actuated_joints(plant, model)]
        gain_of_each = np.array([[actuator.get_controller_gains().d] for actuator in actuators])
        gains = gain_of_each * np.hstack((np.zeros((n, n)), np.eye(n), -rates))
        builder = DiagramBuilder()
        both = builder.AddNamedSystem("both", Multiplexer([2 * n, size]))
        gain = builder.AddNamedSystem("gain", MatrixGain(gains))
        builder.Connect(both.get_output_port(), gain.get_input_port())
        builder.ExportInput(both.get_input_port(0), "desired_state")
        builder.ExportInput(both.get_input_port(1), "multibody_state")
        builder.ExportOutput(gain.get_output_port(), "actuation")
        builder.BuildInto(self)
