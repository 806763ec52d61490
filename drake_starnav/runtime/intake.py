"""What drivers deliver -> scans with the pose at their own stamp, and the robot's state now. Pure functions."""

import dataclasses
import math
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.se2 import now_in
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.mounts import ON_AXIS, Mount
from drake_starnav.lidar.outlier_filter import lone_close_hits
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.schema import Scenario
from drake_starnav.utils.snapshot import snapshot

PATIENCE = 0.1
"""Odometry older than this is stale, s: the pose now follows from the last one by its twist."""
AHEAD = 0.03
"""The pose at the stamp of a scan is extrapolated by this at most, s, back as well; else it waits."""
OLDEST, KEPT = 1.0, 3.0
"""Scans that have waited longer than the first are dropped; odometry is kept for the second, s."""
CLOCK = 0.1
"""A stamp is at most this far ahead of the clock, s."""
JUMP, JUMP_SHARE, TURN_JUMP = 0.05, 0.3, 0.1
"""A pose jumps if it differs from where the twist leads until then by more than this, m and rad, and this share of what
the robot could have driven since."""
FROZEN = 0.02
"""Ranges that stay equal to the bit while the robot moves by more than this, m or rad, are frozen."""


class Odometry(NamedTuple):
    """Where a robot believes to be, and its twist in its own frame.

    Attributes:
        time: when, s, on the clock of all stamps and of `now`.
        x, y, yaw: of the robot's frame in the odometry's, m and rad.
        v, omega: along its x axis, m/s, and turning, rad/s.
        aside: along its y axis, m/s; of omnidirectional bases.
    """

    time: float
    x: float
    y: float
    yaw: float
    v: float
    omega: float
    aside: float = 0.0


class Declared(NamedTuple):
    """What inputs are held against; `jumps`: whether the pose may; `bodies`: the robot's radius about each lidar, m."""

    lidars: tuple[LidarParameters, ...]
    robot: RobotParameters
    jumps: bool
    bodies: tuple[float, ...]

    @staticmethod
    def of(scenario: Scenario, mounts: Sequence[Mount] | None = None) -> "Declared":
        """By a scenario; `mounts` of its lidars, None: on the robot's axis."""
        lidars, narrow = scenario.all_lidars, scenario.robot.shape.narrow
        bodies = tuple(narrow - mount.offset for mount in mounts or (ON_AXIS,) * len(lidars))
        return Declared(lidars, scenario.robot, scenario.localization.jump > 0.0, bodies)


class PosedScan(NamedTuple):
    """The scan of a lidar, by its number, and the robot's pose (x, y, yaw) at its stamp, m and rad."""

    lidar: int
    scan: LaserScan
    pose: np.ndarray


@snapshot
class Intake:
    """What has come in and is not used up. Immutable.

    Attributes:
        rows: odometry, oldest first.
        waiting: scans, each with the number of its lidar, oldest first.
        newest: stamp of the last scan taken of each lidar, s.
        jumped: stamp of the last jump of the pose that is not declared, s.
        bad_odometry, bad_scan: what was wrong with the last one; empty: nothing.
        frozen: ranges and place of the first of equal scans, of each lidar.
        dropped: why scans and odometry were dropped, in the order in which it first happened, and how often.
    """

    rows: tuple[Odometry, ...] = ()
    waiting: tuple[tuple[int, LaserScan], ...] = ()
    newest: tuple[float, ...] = ()
    jumped: float = -math.inf
    bad_odometry: str = ""
    bad_scan: str = ""
    frozen: tuple[tuple[np.ndarray, np.ndarray] | None, ...] = ()
    dropped: tuple[tuple[str, int], ...] = ()

    @staticmethod
    def empty(lidars: int) -> "Intake":
        """The intake of a robot with this number of lidars, before anything has come."""
        return Intake(newest=(-math.inf,) * lidars, frozen=(None,) * lidars)

    def without(self, why: str, **changes: Any) -> "Intake":
        """One thing more was dropped."""
        counts = dict(self.dropped)
        counts[why] = counts.get(why, 0) + 1
        return dataclasses.replace(self, dropped=tuple(counts.items()), **changes)


def canonical(scan: LaserScan, **changes: float) -> LaserScan:
    """The scan with numbers of 32 bits, as a ROS message has them, and changed fields: a log repeats it to the bit."""
    single: dict[str, Any] = {
        name: float(np.float32(getattr(scan, name)))
        for name in ("angle_min", "angle_increment", "range_min", "range_max", "time_increment", "scan_time")
    }
    ranges = scan.ranges.astype(np.float32).astype(float)
    return LaserScan(scan.time, ranges=ranges, lost_beams=True, **(single | changes))


def taken(intake: Intake, now: float, scans: Iterable[Any], odometry: Iterable[Any], declared: Declared) -> Intake:
    """The intake with messages that came until `now`, s, whatever they hold; none is taken twice."""
    for row in odometry:
        intake = _with_row(intake, now, row, declared)
    for item in scans:
        k, scan = item if isinstance(item, tuple) else (0, item)
        intake = _with_scan(intake, now, k, scan, declared)
    recent = tuple(row for row in intake.rows if row.time > now - KEPT) or intake.rows[-1:]
    return dataclasses.replace(intake, rows=recent)


def _with_row(intake: Intake, now: float, row: Any, declared: Declared) -> Intake:
    try:
        row = Odometry(*map(float, row))
    except (TypeError, ValueError):
        return intake.without("no odometry", bad_odometry=f"odometry is {type(row).__name__}, not an Odometry")
    if not all(map(math.isfinite, row)):
        return intake.without("odometry that is not finite", bad_odometry="odometry is not finite")
    if row.time > now + CLOCK:
        text = f"odometry is stamped {row.time - now:.3g} s ahead of the clock"
        return intake.without("odometry from the future", bad_odometry=text)
    last = intake.rows[-1] if intake.rows else None
    if last is not None and row.time <= last.time:
        return intake.without("odometry twice or out of order")
    if last is not None and not declared.jumps and (far := _jump(last, row, declared.robot)):
        return intake.without("jump of the odometry", rows=(row,), waiting=(), jumped=row.time, bad_odometry=far)
    return dataclasses.replace(intake, rows=(*intake.rows, row), bad_odometry="")


def _jump(last: Odometry, row: Odometry, robot: RobotParameters) -> str:
    """How far a pose is from the way that the twist before it leads, if that is a jump: a robot may halt on it."""
    dt = row.time - last.time
    led = extrapolated(last, row.time) - last[1:4]
    moved = np.array((row.x - last.x, row.y - last.y, math.remainder(row.yaw - last.yaw, 2.0 * math.pi)))
    share = min(max(float(moved[:2] @ led[:2]), 0.0) / (float(led[:2] @ led[:2]) or 1.0), 1.0)
    off = math.hypot(*(moved - share * led)[:2])
    turned = abs(moved[2] - min(max(moved[2], min(led[2], 0.0)), max(led[2], 0.0)))
    if off > JUMP + JUMP_SHARE * robot.max_speed * dt:
        return f"the pose jumps by {off:.2g} m, and localization.jump is 0"
    if turned > TURN_JUMP + JUMP_SHARE * robot.max_yaw_rate * dt:
        return f"the heading jumps by {turned:.2g} rad"
    return ""


def _with_scan(intake: Intake, now: float, k: Any, scan: Any, declared: Declared) -> Intake:
    if not isinstance(scan, LaserScan) or k not in range(len(declared.lidars)):
        return intake.without("no scan of a lidar", bad_scan=f"a scan is {type(scan).__name__} of lidar {k}")
    lidar = declared.lidars[k]
    scan = canonical(scan, scan_time=1.0 / lidar.rate)  # of drivers it may be 0, or anything
    scan = scan.masked(lidar.mask) if lidar.mask else scan
    if scan.time > now + CLOCK:
        text = f"a scan is stamped {scan.time - now:.3g} s ahead of the clock"
        return intake.without("scan from the future", bad_scan=text)
    if scan.time <= max([intake.newest[k], *(each.time for j, each in intake.waiting if j == k)]):
        return intake.without("scan twice or out of order")
    if wrong := false_scan(scan, lidar):
        return intake.without("false scan", bad_scan=wrong)
    for beam in () if lidar.outliers else lone_close_hits(scan, declared.bodies[k]):
        intake = intake.without(f"hit of beam {beam} of lidar {k} alone, inside the robot or nearer than range_min")
    return dataclasses.replace(intake, waiting=(*intake.waiting, (k, scan)), bad_scan="")


def false_scan(scan: LaserScan, lidar: LidarParameters) -> str:
    """In what a scan falls short of its declared lidar; empty: in nothing."""
    view = lidar.field_of_view
    if scan.measured_at == -math.inf:
        return "a scan measures nothing: all beams are lost"
    if scan.angle_increment > 1.05 * view.angle_increment:
        return f"a scan has {len(scan.ranges)} beams over {scan.field_of_view.span:.3g} rad; declared: {lidar.beams}"
    if scan.field_of_view.span + scan.angle_increment < 0.97 * (view.span + view.angle_increment):
        return f"a scan spans {scan.field_of_view.span:.3g} rad; declared: {view.span:.3g} rad"
    if scan.range_max < 0.97 * lidar.range_max:
        return f"a scan has range_max {scan.range_max:.3g} m; declared: {lidar.range_max:.3g} m"
    return ""


def extrapolated(row: Odometry, time: float) -> np.ndarray:
    """The pose (x, y, yaw) that follows from one by its twist, m and rad."""
    dt = time - row.time
    half = 0.5 * row.omega * dt  # along the chord of the arc
    along = complex(row.v, row.aside) * dt * complex(math.cos(row.yaw + half), math.sin(row.yaw + half))
    return np.array((row.x + along.real, row.y + along.imag, row.yaw + 2.0 * half))


def pose_at(rows: Sequence[Odometry], time: float, ahead: float) -> np.ndarray | None:
    """The pose (x, y, yaw) at a time, s, interpolated, or extrapolated by `ahead` at most, s; None where unknown."""
    if not rows or not rows[0].time - ahead <= time <= rows[-1].time + ahead:
        return None
    after = next((k for k, row in enumerate(rows) if row.time >= time), None)
    if not after:
        return extrapolated(rows[-1] if after is None else rows[0], time)
    a, b = rows[after - 1], rows[after]
    share, turn = (time - a.time) / (b.time - a.time), math.remainder(b.yaw - a.yaw, 2.0 * math.pi)
    return np.array((a.x + share * (b.x - a.x), a.y + share * (b.y - a.y), a.yaw + share * turn))


def state_at(rows: Sequence[Odometry], now: float) -> np.ndarray | None:
    """(x, y, yaw, v, omega) now, as of `Robot`; None where the odometry is stale."""
    pose = pose_at(rows[-1:], max(now, rows[-1].time), PATIENCE) if rows else None
    if pose is None:
        return None
    last = rows[-1]
    speed = math.copysign(math.hypot(last.v, last.aside), last.v) if last.aside else last.v
    return np.array((*pose, speed, last.omega))


def next_scan(intake: Intake, now: float) -> tuple[Intake, PosedScan | None]:
    """The scan that waits longest, with the pose at its stamp; None: not yet, or there is none."""
    while intake.waiting:
        k, scan = first = min(intake.waiting, key=lambda each: each[1].time)
        pose = pose_at(intake.rows, scan.time, AHEAD)
        coming = not intake.rows or scan.time >= intake.rows[0].time
        if pose is None and coming and now - scan.time < OLDEST:
            break
        waiting = tuple(each for each in intake.waiting if each is not first)
        newest = (*intake.newest[:k], scan.time, *intake.newest[k + 1 :])
        intake = dataclasses.replace(intake, waiting=waiting, newest=newest)
        if pose is None:
            intake = intake.without("scan without a pose")
            continue
        intake, still = _frozen(intake, k, scan, pose)
        if not still:
            return intake, PosedScan(k, scan, pose)
        intake = intake.without("frozen scan", bad_scan=still)
    return intake, None


def _frozen(intake: Intake, k: int, scan: LaserScan, pose: np.ndarray) -> tuple[Intake, str]:
    """The intake with the first of equal scans noted, and what is wrong if one is equal though the robot moved."""
    before = intake.frozen[k]
    same = before is not None and np.array_equal(before[0], scan.ranges, equal_nan=True)
    if before is None or not same or not np.isfinite(scan.ranges).any():
        known = (*intake.frozen[:k], (scan.ranges, pose), *intake.frozen[k + 1 :])
        return dataclasses.replace(intake, frozen=known), ""
    forward, aside, turn = now_in(before[1], pose)
    moved = max(math.hypot(forward, aside), abs(math.remainder(turn, 2.0 * math.pi))) > FROZEN
    return intake, "scans are frozen: the robot moves, and they stay the same" if moved else ""


def goal_of(goal: Any) -> tuple[float, ...] | None:
    """A goal as (x, y) or (x, y, yaw); None for none, or a `StarnavError` for what is no goal."""
    if goal is None:
        return None
    try:
        values = tuple(map(float, goal))
    except (TypeError, ValueError):
        values = ()
    if len(values) not in (2, 3) or not all(map(math.isfinite, values)):
        raise StarnavError(f"goal is {goal}; allowed: finite (x, y) or (x, y, yaw), or None")
    return values
