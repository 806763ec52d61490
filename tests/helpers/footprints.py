"""Footprints that change by the time, and some to change between."""

from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import Context, LeafSystem

from drake_starnav.geometry.footprint import Footprint
from drake_starnav.robot import RobotParameters

ROUND = RobotParameters().shape
LONG = RobotParameters(footprint=[[-0.4, -0.25], [0.4, -0.25], [0.4, 0.25], [-0.4, 0.25]]).shape
WIDE = RobotParameters(footprint=[[-0.25, -0.45], [0.25, -0.45], [0.25, 0.45], [-0.25, 0.45]]).shape
"""With both arms stretched out: it passes no gap of 0.64 m."""


class ToldFootprint(LeafSystem):
    """Tells at any time the last footprint of some (since when, s, footprint) whose time has come."""

    def __init__(self, *steps: tuple[float, Footprint]) -> None:
        super().__init__()
        self._steps = steps
        self.DeclareAbstractOutputPort(
            "footprint", lambda: Value[object](steps[0][1]), self._calc, {self.time_ticket()}
        )

    def _calc(self, context: Context, output: AbstractValue) -> None:
        now = context.get_time() + 1e-9
        output.set_value([shape for since, shape in self._steps if since <= now][-1])
