"""Where a floating robot is in the plane, and where it believes to be."""

import functools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from pydrake.systems.framework import Context, DiscreteStateIndex, DiscreteValues, EventStatus, LeafSystem, State

from drake_starnav.geometry.se2 import compose_poses, find_pose_in_frame
from drake_starnav.lidar.sensor_model import (
    LidarParameters,
    Stream,
    arrives,
    draw_random_numbers,
    find_released,
    find_scan_index,
)
from drake_starnav.scenario.schema import LocalizationParameters
from drake_starnav.systems.release import declare_vector
from drake_starnav.utils.timing import is_new_run

PLANAR = 3
"""Positions of a planar base, see `planar_drive`; a floating one has more."""
LIDAR_SEEDS = 0x9E3779B97F4A7C15
"""Added to the seed of a robot for each further lidar: no two have the same noise, whatever seeds trials have."""
DRIFT_PERIOD = 0.025
"""The believed pose takes up its error this often, s."""


def add_drift(estimate: np.ndarray, old_pose: np.ndarray, pose: np.ndarray, drift: float, seed: int) -> np.ndarray:
    """The believed pose after the robot went from one true pose to another, near it; (x, y, yaw) in W, m and rad.

    During a trial the error keeps one direction relative to the robot and one sign of the heading, so that it
    accumulates like that of a badly calibrated odometry.

    It believed to be at `estimate` at the true pose `old_pose`. The error is a share of the distance travelled and of
    the angle turned.
    """
    drift_along, drift_across, turn = find_pose_in_frame(old_pose, pose)
    direction, sign = _draw_drift_direction(seed)
    position_error = drift * complex(drift_along, drift_across) * direction
    drift_along, drift_across = drift_along + position_error.real, drift_across + position_error.imag
    return compose_poses(estimate, (drift_along, drift_across, turn * (1.0 + drift * sign)))


@functools.lru_cache(maxsize=16)
def _draw_drift_direction(seed: int) -> tuple[complex, float]:
    """The direction of a trial's drift relative to the robot's motion, a unit vector, and the sign of the heading's."""
    generator = draw_random_numbers(seed, Stream.DRIFT)
    angle = generator.uniform(-math.pi, math.pi)
    return complex(math.cos(angle), math.sin(angle)), 1.0 if generator.random() < 0.5 else -1.0


def draw_jump(jump: float, seed: int, index: int) -> np.ndarray:
    """The jump of that index of the believed position, shape (2,), m: its size is given, its direction drawn."""
    angle = draw_random_numbers(seed, Stream.JUMP, index).uniform(-math.pi, math.pi)
    return jump * np.array((math.cos(angle), math.sin(angle)))


class _Stream(NamedTuple):
    """The scans of a lidar, its seed, and the discrete state of poses at which scans were taken that did not arrive."""

    lidar: LidarParameters
    seed: int
    waiting_poses: list[DiscreteStateIndex]


def derive_lidar_seed(seed: int, k: int) -> int:
    """Seed of the k-th lidar of a robot, from 0 on."""
    return (seed + k * LIDAR_SEEDS) % 2**64


class PlanarLocalization(LeafSystem):
    """Reads the planar pose and twist of a robot from its multibody state: the truth, or with a declared error.

    ```
                        ┌────────────────────┐
    multibody_state ───>│ PlanarLocalization ├──> pose
                        │                    ├──> state
                        │                    ├──> scan_pose
                        └────────────────────┘
    ```

    Ports:
        multibody_state: vector of the model's positions (quaternion and position of its floating base first; or x, y,
            yaw of a planar base alone) and velocities (angular and translational, in W, first; or those of x, y, yaw).
        pose: vector (x, y, yaw) of the base in the world frame W, m and rad.
        state: vector (x, y, yaw, v, omega); v is the speed along the base's x axis, of a planar base its speed with the
            sign of that, m/s; omega about W's z, rad/s.
        scan_pose: vector (x, y, yaw), the pose at which the scan was taken that arrived last, of whichever lidar;
            discrete state.

    With an error, W is where the robot believes the world frame to be, and the error accumulates in discrete state;
    v and omega stay true. A run begins with the truth; the time of the last update, in discrete state, tells a context
    of which one is under way.
    """

    def __init__(
        self,
        *,
        num_positions: int,
        num_velocities: int,
        lidars: Sequence[LidarParameters],
        error: LocalizationParameters | None = None,
        seed: int = 0,
    ) -> None:
        """
        Args:
            num_positions, num_velocities: of the model instance.
            lidars: whose scans they are, and which of them do not arrive.
            error: of the believed pose; none by default.
            seed: of the error, and by `derive_lidar_seed` of the lidars; a non-negative whole number below 2**64.
        """
        super().__init__()
        self._error, self._seed = error or LocalizationParameters(), seed
        self._num_positions = num_positions
        self._multibody_state = self.DeclareVectorInputPort("multibody_state", num_positions + num_velocities)
        pose_tickets = {self._multibody_state.ticket()}
        if not self._error.exact:
            self._anchor = self.DeclareDiscreteState(6)  # a true pose, and where the robot believed to be there
            pose_tickets.add(self.discrete_state_ticket(self._anchor))
        declare_vector(self, "pose", 3, PlanarLocalization._compute_believed_pose, pose_tickets)
        declare_vector(self, "state", 5, PlanarLocalization._compute_believed_state, pose_tickets)
        self._scan_pose = self.DeclareDiscreteState(3)
        self._streams = []
        for k, lidar in enumerate(lidars):
            waiting_poses = [self.DeclareDiscreteState(3) for _ in range(lidar.waiting_scans)]
            self._streams.append(_Stream(lidar, derive_lidar_seed(seed, k), waiting_poses))
        self.DeclareStateOutputPort("scan_pose", self._scan_pose)
        self._updated = self.DeclareDiscreteState([math.nan])
        self.DeclareInitializationUnrestrictedUpdateEvent(self._begin)
        for stream in self._streams:
            lidar, period = stream.lidar, 1.0 / stream.lidar.rate
            self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, functools.partial(self._hold, stream))
            if lidar.delay > 0.0:
                release = functools.partial(self._release, stream)
                self.DeclarePeriodicUnrestrictedUpdateEvent(period, lidar.release_offset, release)
        if not self._error.exact:
            self.DeclarePeriodicDiscreteUpdateEvent(DRIFT_PERIOD, 0.0, self._drift)

    def _begin(self, context: Context, state: State) -> EventStatus:
        if not is_new_run(context.get_time(), context.get_discrete_state(self._updated)[0]):
            return EventStatus.DidNothing()
        values = state.get_mutable_discrete_state()
        values.set_value(self._updated, [context.get_time()])
        pose = self._read_true_pose(context)
        if not self._error.exact:
            values.set_value(self._anchor, np.concatenate((pose, pose)))
        for pose_state in (self._scan_pose, *(each for stream in self._streams for each in stream.waiting_poses)):
            values.set_value(pose_state, pose)
        return EventStatus.Succeeded()

    def _hold(self, stream: "_Stream", context: Context, state: State) -> EventStatus:
        values = state.get_mutable_discrete_state()
        values.set_value(self._updated, [context.get_time()])
        scan_index = find_scan_index(context.get_time(), stream.lidar.rate)
        if not arrives(stream.lidar, stream.seed, scan_index):
            return EventStatus.Succeeded()
        waiting_poses = stream.waiting_poses
        pose_state = waiting_poses[scan_index % len(waiting_poses)] if waiting_poses else self._scan_pose
        values.set_value(pose_state, self._compute_believed_pose(context))
        return EventStatus.Succeeded()

    def _release(self, stream: "_Stream", context: Context, state: State) -> EventStatus:
        scan_index = find_released(stream.lidar, stream.seed, context.get_time())
        if scan_index is None:
            return EventStatus.DidNothing()
        pose_state = stream.waiting_poses[scan_index % len(stream.waiting_poses)]
        values = state.get_mutable_discrete_state()
        values.set_value(self._scan_pose, context.get_discrete_state(pose_state).value().copy())
        return EventStatus.Succeeded()

    def _drift(self, context: Context, values: DiscreteValues) -> EventStatus:
        anchor, true_pose = context.get_discrete_state(self._anchor).value(), self._read_true_pose(context)
        believed_pose = add_drift(anchor[3:], anchor[:3], true_pose, self._error.drift, self._seed)
        time, interval = context.get_time(), self._error.jump_interval
        jump_index = math.floor(time / interval + 1e-9)
        if jump_index > 0 and jump_index > math.floor((time - DRIFT_PERIOD) / interval + 1e-9):
            believed_pose[:2] += draw_jump(self._error.jump, self._seed, jump_index)
        values.set_value(self._anchor, np.concatenate((true_pose, believed_pose)))
        return EventStatus.Succeeded()

    def _read_true_pose(self, context: Context) -> np.ndarray:
        return np.array(read_planar_state(self._multibody_state.Eval(context).tolist(), self._num_positions)[:3])

    def _compute_believed_pose(self, context: Context) -> np.ndarray:
        pose = self._read_true_pose(context)
        if self._error.exact:
            return pose
        anchor = context.get_discrete_state(self._anchor).value()
        return compose_poses(anchor[3:], find_pose_in_frame(anchor[:3], pose))

    def _compute_believed_state(self, context: Context) -> tuple[float, ...]:
        state = read_planar_state(self._multibody_state.Eval(context).tolist(), self._num_positions)
        return state if self._error.exact else (*self._compute_believed_pose(context), *state[3:])


def read_planar_states(multibody_states: np.ndarray, num_positions: int) -> np.ndarray:
    """The values of port `state`, shape (n, 5), for many states (n, m) at once, each as on port `multibody_state`."""
    return np.array([read_planar_state(x, num_positions) for x in multibody_states.tolist()]).reshape(-1, 5)


def read_planar_state(x: Sequence[float], num_positions: int) -> tuple[float, float, float, float, float]:
    """The true value of port `state` for one of port `multibody_state`."""
    if num_positions == PLANAR:
        (px, py, yaw), (v_x, v_y, omega) = x[:3], x[3:]
        return px, py, yaw, math.copysign(math.hypot(v_x, v_y), v_x * math.cos(yaw) + v_y * math.sin(yaw)), omega
    # the plant lets the quaternion's length drift: only ratios of its elements count
    qw, qx, qy, qz, px, py = x[:6]
    yaw = math.atan2(2.0 * (qw * qz + qx * qy), qw * qw + qx * qx - qy * qy - qz * qz)
    omega, v_x, v_y = x[num_positions + 2 : num_positions + 5]
    return px, py, yaw, v_x * math.cos(yaw) + v_y * math.sin(yaw), omega
