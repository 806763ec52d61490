"""Mecanum or omni wheels, as an ideal planar base."""

import math
from collections.abc import Iterator

import numpy as np

from drake_starnav.robot.base import MOVE
from drake_starnav.robot.differential import TURN, TURN_COST
from drake_starnav.robot.limits import Limits, compute_stopping_speed, limit_value

OFF_COURSE = (0.0, 0.35, -0.35, 0.7, -0.7, 1.2, -1.2)
"""Directions that are tried beside the desired one, rad."""
SHARES = (1.0, 0.6, 0.3, 0.12)
"""Shares of the desired speed that are tried in each direction."""


class Omnidirectional:
    """Commanded speeds along both axes and a turning rate; methods as of `Base`."""

    components = ("v_x m/s", "v_y m/s", "omega rad/s")
    turns_on_the_spot, steers, holonomic = True, False, True

    def motion_primitives(self, radius: float, limits: Limits) -> np.ndarray:
        straight_moves = [(math.cos(a), math.sin(a), 0.0, 1.0, 1.0) for a in np.arange(8) * math.pi / 4.0]
        turning_moves = [(0.0, 0.0, side * TURN, TURN_COST * radius, 0.0) for side in (1.0, -1.0)]
        length = MOVE * radius
        return np.array([*np.multiply(straight_moves, (length, length, 1.0, length, 1.0)), *turning_moves])

    def saturate(self, twist: np.ndarray, limits: Limits) -> np.ndarray:
        """A velocity keeps its direction."""
        x, y, omega = (float(value) for value in twist)
        share = limits.max_speed / max(math.hypot(x, y), limits.max_speed)
        return np.array((share * x, share * y, limit_value(omega, limits.max_yaw_rate)))

    def body_rates(self, twist: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.copysign(np.hypot(twist[0], twist[1]), twist[0]), twist[2]

    def proposals(self, desired_twist: np.ndarray, limits: Limits) -> Iterator[np.ndarray]:
        """Slower, past what is in the way, and without turning; last only turning."""
        x, y, omega = desired_twist.tolist()
        for a in OFF_COURSE:
            turned_x, turned_y = math.cos(a) * x - math.sin(a) * y, math.sin(a) * x + math.cos(a) * y
            for share in SHARES:
                yield np.array((share * turned_x, share * turned_y, omega))
                yield np.array((share * turned_x, share * turned_y, 0.0 * omega))
        yield np.array((0.0, 0.0, omega))

    def twist_towards(
        self, ahead: float, aside: float, turn: float, gear: float, speed: float, limits: Limits
    ) -> np.ndarray:
        omega = math.copysign(compute_stopping_speed(abs(turn), limits.max_yaw_acceleration), turn)
        if gear == 0.0:
            return np.array((2.0 * ahead, 2.0 * aside, omega))
        way_length = max(math.hypot(ahead, aside), 1e-6)
        return np.array((speed * ahead / way_length, speed * aside / way_length, omega))
