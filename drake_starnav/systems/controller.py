"""What all controllers of this package have in common: one proposal, in two output ports."""

from time import perf_counter
from typing import Any

import numpy as np
from pydrake.systems.framework import Context, LeafSystem

from drake_starnav.control.inputs import Proposal
from drake_starnav.systems.release import declare_vector
from drake_starnav.utils.stopwatch import Stopwatch

UNUSED_TWIST = np.zeros(2)
"""The twist that is commanded now, for laws that do not ask for it."""


class Controller(LeafSystem):
    """A system with the outputs `desired_twist` and `guiding_vector`; a subclass says what they are.

    Each is calculated for itself, without a cache entry: the vector is only drawn, and a cache would cost every command
    7 us.

    Attributes:
        needs_lidar_on_axis: whether it reads the scan of one lidar on the robot's axis, unturned; others are refused.
    """

    needs_lidar_on_axis = False

    def __init__(self, stopwatch: Stopwatch | None) -> None:
        super().__init__()
        self.stopwatch = stopwatch

    def _declare_outputs(self, size: int = 2) -> None:
        """Declare the outputs, with `size` components of a twist; call it after inputs and states are declared."""
        declare_vector(self, "desired_twist", size, Controller._desired_twist)
        declare_vector(self, "guiding_vector", 2, lambda own, context: own._propose(own._read(context)).guiding_vector)

    def _read(self, context: Context) -> Any:
        """What a proposal follows from."""
        raise NotImplementedError

    def _propose(self, read: Any) -> Proposal:
        raise NotImplementedError

    def _desired_twist(self, context: Context) -> np.ndarray:
        read, begin = self._read(context), perf_counter()
        twist = self._propose(read).twist
        if self.stopwatch is not None:
            self.stopwatch.note("command", begin)
        return twist
