"""How a robot moves: its commands, what its limits leave of them, and the motions that it may try."""

from collections.abc import Iterable
from typing import Protocol

import numpy as np

from drake_starnav.robot.limits import Limits, Velocity

SHARES = np.array(
    [(speed, 1.0) for speed in (1.0, 0.8, 0.6, 0.4, 0.25, 0.1, 0.0)]
    + [(speed, turn) for turn in (0.5, 0.0, -0.5) for speed in (0.5, 0.0)]
)
"""Shares of the desired speed and of the desired turning that are proposed, in this order."""
MOVE = 0.21
"""Length of a move of a manoeuvre, in radii of the disc around the robot."""


class Base(Protocol):
    """A base, commanded by twists; inside the package as an array with one number for each of `components`.

    The motion that follows a twist is `robot.motion.roll_out`: two components are a speed along x and a turning rate,
    or with `Limits.steers` a curvature; three are speeds along x and y, and a turning rate. The twist that drives in a
    direction is `find_velocity_towards`, converted.
    """

    @property
    def components(self) -> tuple[str, ...]:
        """Names of a twist's components, with their units."""

    @property
    def turns_on_the_spot(self) -> bool:
        """Whether it turns without driving."""

    @property
    def steers(self) -> bool:
        """Whether it is commanded a curvature instead of a turning rate."""

    @property
    def holonomic(self) -> bool:
        """Whether it drives in any direction without turning."""

    def motion_primitives(self, radius: float, limits: Limits) -> np.ndarray:
        """Moves of a manoeuvre, shape (k, 5): dx, dy, dyaw in the robot's frame, m and rad, cost, m, and gear.

        Gear 0 turns on the spot, 1 drives forwards or aside, -1 backwards. The robot turns within a `radius` (m).
        """

    def saturate(self, twist: np.ndarray, limits: Limits) -> np.ndarray:
        """The twist, cut off where it exceeds the limits; NaN stays NaN.

        The one place where what is asked of a robot becomes what it can do: shield and drive ask here.
        """

    def body_rates(self, twist: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Speed, with the sign of that along x, m/s, and turning rate, rad/s, of a robot that follows a twist.

        Args:
            twist: shape (n, ...), with the components first: one twist, or many.
        """

    def proposals(self, desired_twist: np.ndarray, limits: Limits) -> Iterable[np.ndarray]:
        """Twists to try for a desired one, the best first: itself."""

    def twist_towards(
        self, ahead: float, aside: float, turn: float, gear: float, speed: float, limits: Limits
    ) -> np.ndarray:
        """The twist towards a pose of a manoeuvre.

        Args:
            ahead, aside: where it is in the robot's frame, m.
            turn: by how much it is turned against the robot, rad.
            gear: in which it is to be reached, as in `motion_primitives`.
            speed: at which, m/s.
            limits: of the robot; its turns on the spot end at rest.
        """


def convert_to_twist(velocity: Velocity | np.ndarray, base: Base) -> np.ndarray:
    """A velocity as a twist of a base; or many, shape (n, 3) -> (n, 2 or 3)."""
    return np.array(velocity)[..., :: 1 if len(base.components) == 3 else 2].copy()


def list_straight_and_curved(length: float, turn: float) -> list[tuple]:
    """Return `motion_primitives` in both gears: straight on by a length (m), and 1.2 of it with turns (rad)."""
    primitives = []
    for gear in (1.0, -1.0):
        cost = 1.0 if gear > 0.0 else 1.2  # of a metre
        primitives.append((gear * length, 0.0, 0.0, cost * length, gear))
        primitives += [(gear * 1.2 * length, 0.0, side * turn, cost * 1.4 * length, gear) for side in (1.0, -1.0)]
    return primitives
