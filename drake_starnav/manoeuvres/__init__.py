"""Manoeuvres of a robot that is no disc: when they begin, how they are searched for, and how they are driven."""

from drake_starnav.manoeuvres.manoeuvre import plan_with_manoeuvres

__all__ = ["plan_with_manoeuvres"]
