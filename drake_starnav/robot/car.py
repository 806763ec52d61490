"""Front wheels that steer: the base turns only while it drives, about a circle of at least the least radius."""

import numpy as np

from drake_starnav.robot.base import SHARES, list_straight_and_curved
from drake_starnav.robot.differential import Differential
from drake_starnav.robot.limits import Limits, limit_value

MOVE, TURN = 0.3, 0.3
"""Length of a move of a manoeuvre, in radii of the disc around the robot, and the largest turn on it, rad."""
CURVES = (0.2, 0.6)
"""Shares of the largest curvature of the manoeuvres' curves: the rest is left to follow them."""
NEAREST = 0.16
"""No pose of a manoeuvre counts as nearer than this, in least radii: the curve to it would be tighter than any."""
BENDS = (0.0, 0.4, -0.4)
"""Shares of the largest curvature that are tried on top of the desired one."""


class Car(Differential):
    """Commanded a speed and a curvature; methods as of `Base`."""

    components = ("v m/s", "curvature 1/m")
    turns_on_the_spot, steers, holonomic = False, True, False

    def motion_primitives(self, radius: float, limits: Limits) -> np.ndarray:
        """No longer than turns by TURN are, on any circle that it can drive."""
        length = min(MOVE * radius, TURN / (1.2 * limits.max_yaw_rate))
        curved_moves = [
            list_straight_and_curved(length, 1.2 * length * share * limits.max_yaw_rate) for share in CURVES
        ]
        return np.array([*curved_moves[0], *(move for rows in curved_moves[1:] for move in rows if move[2])])

    def body_rates(self, twist: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return twist[0], twist[0] * twist[1]

    def proposals(self, desired_twist: np.ndarray, limits: Limits) -> np.ndarray:
        """Slower, and steering otherwise; last it steers standing."""
        v, bend = desired_twist
        steered_rates = [limit_value(bend + share * limits.max_yaw_rate, limits.max_yaw_rate) for share in BENDS]
        proposed_twists = [(share * v, steered_rate) for share in SHARES[:6, 0] for steered_rate in steered_rates]
        return np.array([*proposed_twists, (0.0, bend)])

    def twist_towards(
        self, ahead: float, aside: float, turn: float, gear: float, speed: float, limits: Limits
    ) -> np.ndarray:
        """It cannot turn on the spot."""
        max_yaw_rate = limits.max_yaw_rate
        way_ahead = max(abs(ahead), NEAREST / max_yaw_rate)
        return np.array(
            (gear * speed, gear * turn / way_ahead + 0.5 * max_yaw_rate * (max_yaw_rate * aside + gear * turn))
        )
