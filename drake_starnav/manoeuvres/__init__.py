"""Manoeuvres of a robot that is no disc: when they begin, how they are searched for, and how they are driven."""
