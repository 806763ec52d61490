"""Wheels that turn slower than commanded."""

import math

import numpy as np
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_starnav.station.fault_models import wheel_shares
from drake_starnav.systems.release import weakly

SLIP_PERIOD = 1.0
"""Period with which the slip of the wheels is drawn, s."""


class WheelSlip(LeafSystem):
    """Reduces the desired speed of the wheels of each side by a seeded random share.

    ```
                      ┌───────────┐
    desired_state ───>│ WheelSlip ├──> slipping_state
                      └───────────┘
    ```

    Ports:
        desired_state: vector of 2 n values as of `WheelSpeedCommand`, rad/s.
        slipping_state: vector, the same with less speed.
    """

    def __init__(self, *, sides: np.ndarray, slip: float, seed: int) -> None:
        """Of wheels on `sides` (n,), 0 left and 1 right, that lose up to the share `slip` of their speed."""
        super().__init__()
        self._sides, self._slip, self._seed = sides, slip, seed
        self._desired = self.DeclareVectorInputPort("desired_state", 2 * len(sides))
        self.DeclareVectorOutputPort("slipping_state", 2 * len(sides), weakly(self._calc))

    def _calc(self, context: Context, output: BasicVector) -> None:
        desired = self._desired.Eval(context).copy()
        shares = wheel_shares(self._slip, self._seed, math.floor(context.get_time() / SLIP_PERIOD + 1e-9))
        desired[len(self._sides) :] *= shares[self._sides]
        output.SetFromVector(desired)
