"""The state of the robot when a delayed command takes effect."""

import math

import numpy as np
from pydrake.systems.framework import Context, DiscreteValues, EventStatus, LeafSystem

from drake_starnav.robot import RobotParameters
from drake_starnav.robot.motion import convert_to_velocity, predict_pose
from drake_starnav.systems.release import declare_vector
from drake_starnav.utils.timing import check_period


class StatePredictor(LeafSystem):
    """Predicts the robot's state by the pending commands, for a controller whose commands take effect with a delay.

    ```
                      ┌────────────────┐
    state ───────────>│ StatePredictor ├──> predicted_state
    twist_command ───>│                │
                      └────────────────┘
    ```

    Ports:
        state: vector (x, y, yaw, v, omega) of the robot in the world frame W, now.
        twist_command: vector, as the base's twists are, the controller's last command; it must not depend on this
            system directly.
        predicted_state: vector (x, y, yaw, v, omega) when the controller's next command takes effect.

    The commands before the last are discrete state, updated together with the controller.
    """

    def __init__(self, robot: RobotParameters, *, delay: float, rate: float) -> None:
        """Predict over a delay of more than 0 s from a command to its effect, at the controller's rate, Hz."""
        super().__init__()
        self._robot, self._delay, self._period = robot, delay, check_period(self, rate=rate)
        self._size = len(robot.drive.components)
        self._state = self.DeclareVectorInputPort("state", 5)
        self._command = self.DeclareVectorInputPort("twist_command", self._size)
        self.DeclareDiscreteState(self._size * math.ceil(delay / self._period - 1e-9))
        declare_vector(self, "predicted_state", 5, StatePredictor._predicted)
        self.DeclarePeriodicDiscreteUpdateEvent(self._period, 0.0, self._update)

    def _twists(self, context: Context) -> np.ndarray:
        """The last commands, oldest first; the newest is still that of the period that ends now."""
        earlier = context.get_discrete_state(0).value().reshape(-1, self._size)
        return np.vstack((earlier[1:], self._command.Eval(context)))

    def _update(self, context: Context, values: DiscreteValues) -> EventStatus:
        values.set_value(0, self._twists(context).ravel())
        return EventStatus.Succeeded()

    def _predicted(self, context: Context) -> np.ndarray:
        twists = self._twists(context)
        pending = np.array([(*convert_to_velocity(twist), self._period) for twist in twists])
        pose = predict_pose(self._state.Eval(context)[:3], pending, self._delay, self._robot.limits)
        return np.concatenate((pose, self._robot.drive.body_rates(twists[-1])))
