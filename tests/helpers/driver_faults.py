"""What drivers of a robot do wrong, and what they do that is no harm."""

import math
from dataclasses import replace

import numpy as np

from drake_starnav.geometry.se2 import find_pose_in_frame
from drake_starnav.runtime.loop import Reading

BEGIN = 1.6
"""When it begins, s: a robot is at full speed."""


def driven(navigator, robot, seconds, fault=None, begin=BEGIN):
    """Commands during a time, s, with a fault from `begin` on."""
    commands = []
    while robot.time < seconds - 1e-9:
        reading = robot.read()
        if fault is not None and robot.time >= begin - 1e-9:
            reading = fault(reading, robot.time - begin)
        commands.append(navigator.step(*reading))
        robot.drive(commands[-1])
        if commands[-1].status == "reached" and robot.stands:
            break
    return commands


class Faults:
    """What drivers do wrong: each a function of a reading and the time since it began."""

    def __init__(self) -> None:
        self.kept: list = []

    def scans_stop(self, r, t):
        return r._replace(scans=[])

    def scans_freeze(self, r, t):
        self.kept = self.kept or r.scans
        return r._replace(scans=[replace(self.kept[0], time=scan.time) for scan in r.scans])

    def scans_freeze_with_lost_beams(self, r, t):
        self.kept = self.kept or [scan.mask_sectors([(2.0, 2.2)]) for scan in r.scans]
        return r._replace(scans=[replace(self.kept[0], time=scan.time) for scan in r.scans])

    def scans_come_again_in_turn(self, r, t):
        if len(self.kept) < 3:
            self.kept += r.scans
        return r._replace(scans=[replace(self._next(), time=scan.time) for scan in r.scans])

    def _next(self):
        self.kept = [*self.kept[1:], self.kept[0]]
        return self.kept[0]

    def scans_without_returns(self, r, t):
        return r._replace(scans=[replace(scan, ranges=np.full_like(scan.ranges, math.inf)) for scan in r.scans])

    def scans_take_longer_than_declared(self, r, t):
        return r._replace(scans=[replace(scan, time_increment=1.0) for scan in r.scans])

    def scans_are_lost(self, r, t):
        lost = [replace(s, ranges=np.full_like(s.ranges, math.nan), lost_beams=True) for s in r.scans]
        return r._replace(scans=lost)

    def scans_of_half_the_beams(self, r, t):
        return r._replace(
            scans=[replace(s, ranges=s.ranges[::2], angle_increment=2.0 * s.angle_increment) for s in r.scans]
        )

    def scans_late(self, r, t):
        self.kept += r.scans
        return r._replace(scans=[self.kept.pop(0)] if self.kept and self.kept[0].time < r.now - 0.3 else [])

    def scans_of_the_future(self, r, t):
        return r._replace(scans=[replace(scan, time=scan.time + 100.0) for scan in r.scans])

    def scans_of_the_past(self, r, t):
        return r._replace(scans=[replace(scan, time=scan.time - 100.0) for scan in r.scans])

    def scans_are_none(self, r, t):
        return r._replace(scans=[None, "scan"])

    def odometry_stops(self, r, t):
        return r._replace(odometry=[])

    def odometry_freezes(self, r, t):
        self.kept = self.kept or r.odometry
        return r._replace(odometry=[self.kept[0]._replace(time=r.now)])

    def odometry_stands(self, r, t):
        self.kept = self.kept or r.odometry
        return r._replace(odometry=[self.kept[0]._replace(time=r.now, v=0.0, omega=0.0)])

    def odometry_stands_and_the_goal_moves(self, r, t):
        return self.odometry_stands(r, t)._replace(goal=(r.goal[0] + 1e-6 * t, r.goal[1]))

    def odometry_begins_anew(self, r, t):
        self.kept = self.kept or r.odometry
        poses = [find_pose_in_frame(self.kept[0][1:4], row[1:4]) for row in r.odometry]
        return r._replace(
            odometry=[row._replace(x=x, y=y, yaw=yaw) for row, (x, y, yaw) in zip(r.odometry, poses, strict=True)]
        )

    def odometry_is_nan(self, r, t):
        return r._replace(odometry=[r.odometry[0]._replace(x=math.nan)])

    def odometry_late(self, r, t):
        self.kept += r.odometry
        return r._replace(odometry=[self.kept.pop(0)] if self.kept[0].time < r.now - 0.3 else [])

    def odometry_of_the_past(self, r, t):
        return r._replace(odometry=[row._replace(time=row.time - 100.0) for row in r.odometry])

    def odometry_is_none(self, r, t):
        return r._replace(odometry=[None, (1.0,)])

    def clock_alone_ahead(self, r, t):
        return r._replace(now=r.now + 100.0)

    def clock_alone_back(self, r, t):
        return r._replace(now=r.now - 100.0)

    def clock_stands(self, r, t):
        self.kept = self.kept or [r.now]
        return r._replace(now=self.kept[0])

    def clock_and_stamps_stand(self, r, t):
        self.kept = self.kept or [r]
        return self.kept[0]

    def clock_creeps_back(self, r, t):
        self.kept = self.kept or [r.now]
        return r._replace(now=self.kept[0] - 0.05 * t)

    def clock_is_nan(self, r, t):
        return r._replace(now=math.nan)

    def goal_is_cleared(self, r, t):
        return r._replace(goal=None)

    def goal_is_nan(self, r, t):
        return r._replace(goal=(math.nan, 0.0))

    def goal_is_text(self, r, t):
        return r._replace(goal="kitchen")

    def nothing_comes(self, r, t):
        return Reading(r.now)


class Harmless:
    """What drivers do that is none of the robot's business."""

    def scans_twice(self, r, t):
        return r._replace(scans=[*r.scans, *r.scans])

    def odometry_twice(self, r, t):
        return r._replace(odometry=[*r.odometry, *r.odometry])

    def scans_out_of_order(self, r, t):
        return r._replace(scans=[*r.scans, *(replace(scan, time=scan.time - 0.04) for scan in r.scans)])

    def odometry_out_of_order(self, r, t):
        return r._replace(odometry=[*r.odometry, *(row._replace(time=row.time - 0.01) for row in r.odometry)])

    def clock_and_stamps_jump_ahead(self, r, t):
        scans = [replace(scan, time=scan.time + 100.0) for scan in r.scans]
        return Reading(r.now + 100.0, scans, [row._replace(time=r.now + 100.0) for row in r.odometry], r.goal)

    def clock_and_stamps_jump_back(self, r, t):
        scans = [replace(scan, time=scan.time - 100.0) for scan in r.scans]
        return Reading(r.now - 100.0, scans, [row._replace(time=r.now - 100.0) for row in r.odometry], r.goal)

    def jitter(self, r, t):
        return r._replace(now=r.now + 0.009 * math.sin(1e3 * t))


FAULTS, HARMLESS = ([name for name in vars(kind) if not name.startswith("_")] for kind in (Faults, Harmless))
SLOWER = {
    "odometry_freezes": 3.0,
    "odometry_stands": 3.0,
    "odometry_stands_and_the_goal_moves": 3.0,
    "scans_come_again_in_turn": 1.5,
}
"""Within this time, s, instead of 1 s."""
