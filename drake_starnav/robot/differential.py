"""Two wheels, or two rows of wheels, on one axle."""

import math
from collections.abc import Iterable

import numpy as np

from drake_starnav.robot.base import MOVE, SHARES, list_straight_and_curved
from drake_starnav.robot.limits import Limits, compute_stopping_speed, limit_value

TURN, TURN_COST = math.radians(15.0), 0.19
"""Turn of a move on the spot or along a curve, rad, and the cost of one on the spot, in radii."""
FOLLOWING = 2.5
"""Turning rate per heading error of a manoeuvre, 1/s; errors aside are left without swinging at half the full speed."""
QUICKEST = 4.0 * FOLLOWING
"""Turning rate per heading error close to a pose, 1/s: without a bound the arc to it would ask for any."""


class Differential:
    """Commanded a speed and a turning rate; methods as of `Base`."""

    components = ("v m/s", "omega rad/s")
    turns_on_the_spot, steers, holonomic = True, False, False

    def motion_primitives(self, radius: float, limits: Limits) -> np.ndarray:
        turning_moves = [(0.0, 0.0, side * TURN, TURN_COST * radius, 0.0) for side in (1.0, -1.0)]
        return np.array([*list_straight_and_curved(MOVE * radius, TURN), *turning_moves])

    def saturate(self, twist: np.ndarray, limits: Limits) -> np.ndarray:
        """Each component for itself."""
        v, omega = twist.tolist()
        return np.array((limit_value(v, limits.max_speed), limit_value(omega, limits.max_yaw_rate)))

    def body_rates(self, twist: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return twist[0], twist[1]

    def proposals(self, desired_twist: np.ndarray, limits: Limits) -> Iterable[np.ndarray]:
        """Slower, and turning less or the other way; made one by one, as the first is mostly accepted."""
        yield desired_twist
        yield from SHARES[1:] * desired_twist

    def twist_towards(
        self, ahead: float, aside: float, turn: float, gear: float, speed: float, limits: Limits
    ) -> np.ndarray:
        if gear == 0.0:
            return np.array((0.0, math.copysign(compute_stopping_speed(abs(turn), limits.max_yaw_acceleration), turn)))
        way_ahead = max(abs(ahead), speed / QUICKEST)
        lateral_offset = aside - 0.5 * ahead * turn
        return np.array(
            (gear * speed, speed * turn / way_ahead + gear * 0.5 * FOLLOWING**2 / limits.max_speed * lateral_offset)
        )
