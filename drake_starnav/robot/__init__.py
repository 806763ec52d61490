"""The robot: what it covers, how it moves, and its limits."""

from drake_starnav.robot.base import Base
from drake_starnav.robot.limits import Limits
from drake_starnav.robot.parameters import BASES, RobotParameters

__all__ = ["BASES", "Base", "Limits", "RobotParameters"]
