"""Twists that are certified: what every motion must keep, and the shield that asks it."""

from drake_starnav.safety.certificates import Certificate
from drake_starnav.safety.zones import KeepOut, SpeedZone

__all__ = ["Certificate", "KeepOut", "SpeedZone"]
