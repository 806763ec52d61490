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

from drake_starnav.utils.imported import load_lazily

__all__, __getattr__ = load_lazily(__name__, __file__)
