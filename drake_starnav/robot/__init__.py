"""The robot: what it covers, how it moves, and its limits."""

from drake_starnav.robot.base import Base
from drake_starnav.robot.limits import Limits
from drake_starnav.robot.motion import BrakingMotion, Motion
from drake_starnav.robot.parameters import BASES, MODEL_FILES, RobotParameters

__all__ = ["BASES", "MODEL_FILES", "Base", "BrakingMotion", "Limits", "Motion", "RobotParameters"]
