"""Wheels that turn slower than commanded."""

import math

from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_starnav.station.fault_models import wheel_shares
from drake_starnav.systems.release import weakly

SLIP_PERIOD = 1.0
"""Period with which the slip of the wheels is drawn, s."""


class WheelSlip(LeafSystem):
    """Reduces the desired speed of each wheel by a seeded random share.

    ```
                      ┌───────────┐
    desired_state ───>│ WheelSlip ├──> slipping_state
                      └───────────┘
    ```

    Ports:
        desired_state: vector (0, 0, left, right) as of `WheelSpeedCommand`, rad/s.
        slipping_state: vector, the same with less speed.
    """

    def __init__(self, *, slip: float, seed: int) -> None:
        """
        Args:
            slip: largest share of its speed that a wheel loses.
            seed: a non-negative whole number below 2**64.
        """
        super().__init__()
        self._slip, self._seed = slip, seed
        self._desired = self.DeclareVectorInputPort("desired_state", 4)
        self.DeclareVectorOutputPort("slipping_state", 4, weakly(self._calc))

    def _calc(self, context: Context, output: BasicVector) -> None:
        desired = self._desired.Eval(context).copy()
        desired[2:] *= wheel_shares(self._slip, self._seed, math.floor(context.get_time() / SLIP_PERIOD + 1e-9))
        output.SetFromVector(desired)
