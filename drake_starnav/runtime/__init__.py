"""A robot whose loop is not ours: scans and odometry in, twists out, by the navigation of a scenario.

`Navigator.step` is one command; `drive` calls it once a control period for a robot, which is any object with three
methods:

    read() -> Reading(now, scans, odometry, goal)   what came since the last call, and the time now; does not block
    drive(command)                                  send `command.twist` to the base at once
    close()                                         give everything back; the base has been told to stand

All times are seconds on one clock, that of the stamps. `scans` are `LaserScan`s, of a robot with several lidars pairs
of the lidar's number, from 0, and the scan; `odometry` are `Odometry`; `goal` is (x, y), (x, y, yaw) or None. `read`
and `drive` may raise: the loop then ramps to zero, closes and ends.

A base that does not stand by itself when its commands end (`drive.timeout`) is sent them through a second process,
`Watched`; the robot then says `watched = True`. One that knows where its lidars are has `mounts`.
A name is imported when first used: the watchdog needs neither Drake nor NumPy.
"""

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from drake_starnav.runtime.intake import Odometry as Odometry
    from drake_starnav.runtime.log import Replayed as Replayed
    from drake_starnav.runtime.log import read_log as read_log
    from drake_starnav.runtime.log import replay as replay
    from drake_starnav.runtime.loop import Driven as Driven
    from drake_starnav.runtime.loop import Reading as Reading
    from drake_starnav.runtime.loop import drive as drive
    from drake_starnav.runtime.navigator import Command as Command
    from drake_starnav.runtime.navigator import Navigator as Navigator
    from drake_starnav.runtime.watchdog import Ramp as Ramp
    from drake_starnav.runtime.watchdog import Watched as Watched

MODULES = {
    "Command": "navigator", "Driven": "loop", "Navigator": "navigator", "Odometry": "intake", "Ramp": "watchdog",
    "Reading": "loop", "Replayed": "log", "Watched": "watchdog", "drive": "loop", "read_log": "log", "replay": "log",
}  # fmt: skip
"""Of each public name."""
__all__ = list(MODULES)


def __getattr__(name: str) -> object:
    if name not in MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{MODULES[name]}"), name)
