"""Kinematics of a differential drive."""

import numpy as np
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_starnav.robot import BASES, Limits
from drake_starnav.station.robot_geometry import Drive
from drake_starnav.systems.release import weakly


class WheelSpeedCommand(LeafSystem):
    """Turns a twist into the desired state of the wheel actuators, and no twist beyond the robot's limits.

    ```
                      ┌───────────────────┐
    twist_command ───>│ WheelSpeedCommand ├──> desired_state
                      └───────────────────┘
    ```

    Ports:
        twist_command: vector (v, omega), m/s and rad/s, left and forward positive; cut off at the limits.
        desired_state: vector of n wheel angles (zero and unused, as is their gain) and n speeds, rad/s, in the order of
            the actuators, as `MultibodyPlant.get_desired_state_input_port` takes it.
    """

    def __init__(self, *, limits: Limits, drive: Drive) -> None:
        """
        Args:
            limits: of the robot.
            drive: its n wheels.
        """
        super().__init__()
        self._base = BASES["differential"]
        self._limits, self._drive, n = limits, drive, len(drive.radii)
        self._angles = np.zeros(n)
        self._twist = self.DeclareVectorInputPort("twist_command", 2)
        self.DeclareVectorOutputPort("desired_state", 2 * n, weakly(self._calc_state), {self._twist.ticket()})

    def _calc_state(self, context: Context, output: BasicVector) -> None:
        rates = self._drive.rates(*self._base.saturated(self._twist.Eval(context), self._limits).tolist())
        output.SetFromVector(np.concatenate((self._angles, rates)))
