"""The systems that would run on the robot."""

from drake_starnav.systems.jump_guard import JumpGuard
from drake_starnav.systems.release import release
from drake_starnav.systems.state_predictor import StatePredictor

__all__ = ["JumpGuard", "StatePredictor", "release"]
