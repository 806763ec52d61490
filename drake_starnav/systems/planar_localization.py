"""Where a floating robot is in the plane."""

import math
from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, EventStatus, LeafSystem


class PlanarLocalization(LeafSystem):
    """Reads the planar pose and twist of a robot from its multibody state: the truth, without error.

    ```
                        ┌────────────────────┐
    multibody_state ───>│ PlanarLocalization ├──> pose
                        │                    ├──> state
                        │                    ├──> scan_pose
                        └────────────────────┘
    ```

    Ports:
        multibody_state: vector of the model's positions (quaternion and position of its floating base first) and
            velocities (angular and translational, in W, first).
        pose: vector (x, y, yaw) of the base in the world frame W, m and rad.
        state: vector (x, y, yaw, v, omega); v is the speed along the base's x axis, m/s, omega about W's z, rad/s.
        scan_pose: vector (x, y, yaw), the pose held since the last scan was taken; discrete state.
    """

    def __init__(self, *, num_positions: int, num_velocities: int, scan_rate: float) -> None:
        """
        Args:
            num_positions, num_velocities: of the model instance.
            scan_rate: of the lidar, Hz.
        """
        super().__init__()
        self._num_positions = num_positions
        self._multibody_state = self.DeclareVectorInputPort("multibody_state", num_positions + num_velocities)
        depends = {self._multibody_state.ticket()}
        self.DeclareVectorOutputPort("pose", 3, self._calc_pose, depends)
        self.DeclareVectorOutputPort("state", 5, self._calc_state, depends)
        self.DeclareStateOutputPort("scan_pose", self.DeclareDiscreteState(3))
        self.DeclareInitializationDiscreteUpdateEvent(self._hold)
        self.DeclarePeriodicDiscreteUpdateEvent(1.0 / scan_rate, 0.0, self._hold)

    def _hold(self, context: Context, values: DiscreteValues) -> EventStatus:
        values.set_value(np.array(planar_pose(self._multibody_state.Eval(context).tolist())))
        return EventStatus.Succeeded()

    def _calc_pose(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(np.array(planar_pose(self._multibody_state.Eval(context).tolist())))

    def _calc_state(self, context: Context, output: BasicVector) -> None:
        x = self._multibody_state.Eval(context).tolist()
        px, py, yaw = planar_pose(x)
        omega_z, v_x, v_y = x[self._num_positions + 2 : self._num_positions + 5]
        speed = v_x * math.cos(yaw) + v_y * math.sin(yaw)
        output.SetFromVector(np.array((px, py, yaw, speed, omega_z)))


def planar_states(multibody_states: np.ndarray, num_positions: int) -> np.ndarray:
    """What port `state` shows, for many states at once.

    Args:
        multibody_states: shape (n, m), each as on port `multibody_state`.
        num_positions: of the model instance.

    Returns:
        Shape (n, 5): x, y, yaw, v, omega.
    """
    qw, qx, qy, qz, x, y = multibody_states[:, :6].T
    yaw = np.arctan2(2.0 * (qw * qz + qx * qy), qw * qw + qx * qx - qy * qy - qz * qz)
    omega, v_x, v_y = multibody_states[:, num_positions + 2 : num_positions + 5].T
    return np.column_stack((x, y, yaw, v_x * np.cos(yaw) + v_y * np.sin(yaw), omega))


def planar_pose(x: Sequence[float]) -> tuple[float, float, float]:
    """(x, y, yaw) in W, m and rad, from a state that begins with quaternion and position of a floating base."""
    # the plant lets the quaternion's length drift: only ratios of its elements count
    qw, qx, qy, qz, px, py = x[:6]
    return px, py, math.atan2(2.0 * (qw * qz + qx * qy), qw * qw + qx * qx - qy * qy - qz * qz)
