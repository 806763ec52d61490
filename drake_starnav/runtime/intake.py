"""What drivers deliver -> scans with the pose at their own stamp, and the robot's state now. Pure functions."""

import dataclasses
import math
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from drake_starnav.errors import StarnavError, counted
from drake_starnav.geometry.se2 import find_pose_in_frame
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.mounts import ON_AXIS, Mount
from drake_starnav.lidar.outlier_filter import find_lone_close_hits, lose_beams
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.schema import Scenario
from drake_starnav.utils.snapshot import snapshot

PATIENCE = 0.1
"""Odometry older than this is stale, s: the pose now follows from the last one by its twist."""
EXTRAPOLATION = 0.03
"""The pose at the stamp of a scan is extrapolated by this at most, s, back as well; else it waits."""
OLDEST, KEPT_TIME = 1.0, 3.0
"""Scans that have waited longer than the first are dropped; odometry is kept for the second, s."""
CLOCK = 0.1
"""A stamp is at most this far ahead of the clock, s."""
JUMP, JUMP_SHARE, TURN_JUMP = 0.05, 0.3, 0.1
"""A pose jumps if it differs from where the twist leads until then by more than this, m and rad, and this share of what
the robot could have driven since."""
FROZEN, OLD_SCANS = 0.02, 64
"""Ranges that are equal to the bit to those of one of this many last scans are old, if the robot has moved by more than
the first since, m or rad."""
WALKING = 2.0
"""An obstacle leaves a lidar's range no faster than this, m/s, whether or not such are declared."""
FEWEST_HITS, HITS_LEFT = 10, 0.1
"""Of at least so many hits that cannot have left the lidar's range, this share is hit again by the next scan."""
LEAST_SHARE, LONGEST_SWEEP = 0.97, 1.2
"""A scan reaches at least this share of the declared range, and takes at most this many declared periods."""

WITHDRAWN = ()
"""A goal that is none, of a robot whose goal is withdrawn: one that `drive` was given does not count in its place."""


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
        lidars, cover_radius = scenario.all_lidars, scenario.robot.shape.cover_radius
        bodies = tuple(cover_radius - mount.offset for mount in mounts or (ON_AXIS,) * len(lidars))
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
        newest_stamps: stamp of the last scan taken of each lidar, s.
        arrival_times: when the last scan of each lidar came, s.
        jump_time: stamp of the last jump of the pose that is not declared, s.
        bad_odometry: what was wrong with the last one; empty: nothing.
        bad_scans: the same of the last scan of each lidar.
        seen_ranges: hash of the ranges of the last scans of each lidar, and the pose where such ranges came first.
        believed_scans: the last scan of each lidar that was believed; None: none yet.
        drop_counts: why scans and odometry were dropped, in the order in which it first happened, and how often.
    """

    rows: tuple[Odometry, ...] = ()
    waiting: tuple[tuple[int, LaserScan], ...] = ()
    newest_stamps: tuple[float, ...] = ()
    arrival_times: tuple[float, ...] = ()
    jump_time: float = -math.inf
    bad_odometry: str = ""
    bad_scans: tuple[str, ...] = ()
    seen_ranges: tuple[tuple[tuple[int, np.ndarray], ...], ...] = ()
    believed_scans: tuple[PosedScan | None, ...] = ()
    drop_counts: tuple[tuple[str, int], ...] = ()

    @staticmethod
    def empty(lidars: int) -> "Intake":
        """The intake of a robot with this number of lidars, before anything has come."""
        no_times = (-math.inf,) * lidars
        return Intake(
            newest_stamps=no_times,
            arrival_times=no_times,
            bad_scans=("",) * lidars,
            seen_ranges=((),) * lidars,
            believed_scans=(None,) * lidars,
        )

    def count_drop(self, why: str, **changes: Any) -> "Intake":
        """One thing more was dropped."""
        drop_counts = dict(self.drop_counts)
        drop_counts[why] = drop_counts.get(why, 0) + 1
        return dataclasses.replace(self, drop_counts=tuple(drop_counts.items()), **changes)


def restart_clock(intake: Intake, time: float) -> Intake:
    """The intake when the clock begins again: only the last pose stays, for where the odometry goes on from it."""
    last_rows = tuple(row._replace(time=time - OLDEST) for row in intake.rows[-1:])
    return dataclasses.replace(Intake.empty(len(intake.newest_stamps)), rows=last_rows)


def reset_beliefs(intake: Intake) -> Intake:
    """The intake that believes the next scan of each lidar, whatever those before it were."""
    empty = Intake.empty(len(intake.newest_stamps))
    return dataclasses.replace(intake, seen_ranges=empty.seen_ranges, believed_scans=empty.believed_scans)


def replace_item(items: tuple, k: int, item: Any) -> tuple:
    """The items, of which that with number `k` is another."""
    return (*items[:k], item, *items[k + 1 :])


def make_canonical_scan(scan: LaserScan, **changes: float) -> LaserScan:
    """The scan with numbers of 32 bits, as a ROS message has them, and changed fields: a log repeats it to the bit."""
    single: dict[str, Any] = {
        name: float(np.float32(getattr(scan, name)))
        for name in ("angle_min", "angle_increment", "range_min", "range_max", "time_increment", "scan_time")
    }
    ranges = scan.ranges.astype(np.float32).astype(float)
    return LaserScan(scan.time, ranges=ranges, lost_beams=True, **(single | changes))


def take_messages(
    intake: Intake, time: float, scans: Iterable[Any], odometry: Iterable[Any], lidars: Declared
) -> Intake:
    """The intake with messages that came until `time`, s, whatever they hold; none is taken twice."""
    for row in odometry:
        intake = _add_row(intake, time, row, lidars)
    for item in scans:
        k, scan = item if isinstance(item, tuple) else (0, item)
        intake = _add_scan(intake, time, k, scan, lidars)
    recent = tuple(row for row in intake.rows if row.time > time - KEPT_TIME) or intake.rows[-1:]
    return dataclasses.replace(intake, rows=recent)


def _add_row(intake: Intake, time: float, row: Any, declaration: Declared) -> Intake:
    try:
        row = Odometry(*map(float, row))
    except (TypeError, ValueError):
        return intake.count_drop("no odometry", bad_odometry=f"odometry is {type(row).__name__}, not an Odometry")
    if not all(map(math.isfinite, row)):
        return intake.count_drop("odometry that is not finite", bad_odometry="odometry is not finite")
    if row.time > time + CLOCK:
        fault_text = f"odometry is stamped {row.time - time:.3g} s ahead of the clock"
        return intake.count_drop("odometry from the future", bad_odometry=fault_text)
    last_row = intake.rows[-1] if intake.rows else None
    if last_row is not None and row.time <= last_row.time:
        return intake.count_drop("odometry twice or out of order")
    if last_row is not None and not declaration.jumps and (jump_text := _find_jump(last_row, row, declaration.robot)):
        fresh_intake = dataclasses.replace(
            Intake.empty(len(intake.newest_stamps)), newest_stamps=intake.newest_stamps, drop_counts=intake.drop_counts
        )
        return fresh_intake.count_drop("jump of the odometry", rows=(row,), jump_time=row.time, bad_odometry=jump_text)
    return dataclasses.replace(intake, rows=(*intake.rows, row), bad_odometry="")


def _find_jump(last: Odometry, row: Odometry, robot: RobotParameters) -> str:
    """How far a pose is from the way that the twist before it leads, if that is a jump: a robot may halt on it."""
    dt = min(
        row.time - last.time, OLDEST + robot.max_speed / robot.limits.max_deceleration
    )  # without odometry it brakes
    led = extrapolate_pose(last, last.time + dt) - last[1:4]
    driven_step = np.array((row.x - last.x, row.y - last.y, math.remainder(row.yaw - last.yaw, 2.0 * math.pi)))
    step_share = min(max(float(driven_step[:2] @ led[:2]), 0.0) / (float(led[:2] @ led[:2]) or 1.0), 1.0)
    excess_way = math.hypot(*(driven_step - step_share * led)[:2])
    excess_turn = abs(driven_step[2] - min(max(driven_step[2], min(led[2], 0.0)), max(led[2], 0.0)))
    if excess_way > JUMP + JUMP_SHARE * robot.max_speed * dt:
        return f"the pose jumps by {excess_way:.2g} m, and localization.jump is 0"
    if excess_turn > TURN_JUMP + JUMP_SHARE * robot.max_yaw_rate * dt:
        return f"the heading jumps by {excess_turn:.2g} rad"
    return ""


def _add_scan(intake: Intake, time: float, k: Any, scan: Any, declaration: Declared) -> Intake:
    if not isinstance(scan, LaserScan) or k not in range(len(declaration.lidars)):
        return _refuse_scan(intake, k, "no scan of a lidar", f"a scan is {type(scan).__name__} of lidar {k}")
    lidar = declaration.lidars[k]
    scan = make_canonical_scan(scan, scan_time=1.0 / lidar.rate)  # of drivers it may be 0, or anything
    scan = scan.mask_sectors(lidar.mask) if lidar.mask else scan
    if scan.time > time + CLOCK:
        fault_text = f"a scan is stamped {scan.time - time:.3g} s ahead of the clock"
        return _refuse_scan(intake, k, "scan from the future", fault_text)
    if scan.time <= max([intake.newest_stamps[k], *(each.time for j, each in intake.waiting if j == k)]):
        return intake.count_drop("scan twice or out of order")
    if scan_fault := describe_false_scan(scan, lidar):
        return _refuse_scan(intake, k, "false scan", scan_fault)
    scan = within_range(scan, lidar)
    close_beams = [] if lidar.outliers else find_lone_close_hits(scan, declaration.bodies[k]).tolist()
    scan = lose_beams(scan, close_beams)
    for beam in close_beams:
        intake = intake.count_drop(f"hit of beam {beam} of lidar {k} alone, inside the robot or nearer than range_min")
    waiting, arrival_times = (*intake.waiting, (k, scan)), replace_item(intake.arrival_times, k, time)
    return dataclasses.replace(
        intake, waiting=waiting, arrival_times=arrival_times, bad_scans=replace_item(intake.bad_scans, k, "")
    )


def _refuse_scan(intake: Intake, k: Any, kind: str, why: str) -> Intake:
    """The intake without a scan of a lidar, or of none."""
    lidars = range(len(intake.bad_scans))
    bad_scans = tuple(why if each == k or k not in lidars else intake.bad_scans[each] for each in lidars)
    return intake.count_drop(kind, bad_scans=bad_scans)


def describe_false_scan(scan: LaserScan, lidar: LidarParameters) -> str:
    """In what a scan falls short of its declared lidar; empty: in nothing."""
    declared_view = lidar.field_of_view
    if scan.measured_at == -math.inf:
        return "a scan measures nothing: all beams are lost"
    if scan.angle_increment > 1.05 * declared_view.angle_increment:
        return f"a scan has {len(scan.ranges)} beams over {scan.field_of_view.span:.3g} rad; declared: {lidar.beams}"
    if scan.field_of_view.span + scan.angle_increment < 0.97 * (declared_view.span + declared_view.angle_increment):
        return f"a scan spans {scan.field_of_view.span:.3g} rad; declared: {declared_view.span:.3g} rad"
    if scan.range_max < LEAST_SHARE * lidar.range_max:
        return f"a scan has range_max {scan.range_max:.3g} m; declared: {lidar.range_max:.3g} m"
    sweep_time = abs(scan.time_increment) * (len(scan.ranges) - 1)
    if sweep_time > LONGEST_SWEEP / lidar.rate:
        sweep_text = f"a scan takes {sweep_time:.3g} s by its time_increment of {scan.time_increment:.3g} s"
        return f"{sweep_text}; declared: {1.0 / lidar.rate:.3g} s from scan to scan"
    return ""


def within_range(scan: LaserScan, lidar: LidarParameters) -> LaserScan:
    """The scan with a range of at most the declared one, and without the one range that drivers send for no return.

    That is the farthest range of the scan, just below its `range_max`, if FEWEST_HITS beams hold it to the bit. The
    scan then reaches no farther, so that nothing is taken for free that was not measured.
    """
    range_limit = min(scan.range_max, float(np.float32(lidar.range_max)))
    near_limit = scan.ranges[(scan.ranges >= LEAST_SHARE * range_limit) & (scan.ranges < range_limit)]
    if len(near_limit) and np.count_nonzero(near_limit == near_limit.max()) >= FEWEST_HITS:
        range_limit = float(near_limit.max())
    if range_limit == scan.range_max:
        return scan
    ranges = np.where(scan.ranges >= range_limit, math.inf, scan.ranges)
    return dataclasses.replace(scan, ranges=ranges, range_max=range_limit)


def extrapolate_pose(row: Odometry, time: float) -> np.ndarray:
    """The pose (x, y, yaw) that follows from one by its twist, m and rad."""
    dt = time - row.time
    half_turn = 0.5 * row.omega * dt  # along the chord of the arc
    way_along = complex(row.v, row.aside) * dt * complex(math.cos(row.yaw + half_turn), math.sin(row.yaw + half_turn))
    return np.array((row.x + way_along.real, row.y + way_along.imag, row.yaw + 2.0 * half_turn))


def interpolate_pose(rows: Sequence[Odometry], time: float, ahead: float) -> np.ndarray | None:
    """The pose (x, y, yaw) at a time, s, interpolated, or extrapolated by `ahead` at most, s; None where unknown."""
    if not rows or not rows[0].time - ahead <= time <= rows[-1].time + ahead:
        return None
    next_row = next((k for k, row in enumerate(rows) if row.time >= time), None)
    if not next_row:
        return extrapolate_pose(rows[-1] if next_row is None else rows[0], time)
    a, b = rows[next_row - 1], rows[next_row]
    time_share, turn = (time - a.time) / (b.time - a.time), math.remainder(b.yaw - a.yaw, 2.0 * math.pi)
    return np.array((a.x + time_share * (b.x - a.x), a.y + time_share * (b.y - a.y), a.yaw + time_share * turn))


def estimate_state(rows: Sequence[Odometry], time: float) -> np.ndarray | None:
    """(x, y, yaw, v, omega) now, as of `Robot`; None where the odometry is stale."""
    pose = interpolate_pose(rows[-1:], max(time, rows[-1].time), PATIENCE) if rows else None
    if pose is None:
        return None
    last_row = rows[-1]
    speed = math.copysign(math.hypot(last_row.v, last_row.aside), last_row.v) if last_row.aside else last_row.v
    return np.array((*pose, speed, last_row.omega))


def find_next_scan(intake: Intake, time: float) -> tuple[Intake, PosedScan | None]:
    """The scan that waits longest, with the pose at its stamp; None: not yet, or there is none."""
    while intake.waiting:
        k, scan = first_waiting = min(intake.waiting, key=lambda each: each[1].time)
        pose = interpolate_pose(intake.rows, scan.time, EXTRAPOLATION)
        may_come = not intake.rows or scan.time >= intake.rows[0].time
        if pose is None and may_come and time - scan.time < OLDEST:
            break
        waiting = tuple(each for each in intake.waiting if each is not first_waiting)
        newest_stamps = replace_item(intake.newest_stamps, k, scan.time)
        intake = dataclasses.replace(intake, waiting=waiting, newest_stamps=newest_stamps)
        if pose is None:
            intake = intake.count_drop("scan without a pose")
            continue
        posed_scan, (kind, why) = PosedScan(k, scan, pose), _explain_disbelief(intake, k, scan, pose)
        if why:
            intake = _refuse_scan(intake, k, kind, why)
            continue
        range_hash = hash(scan.ranges.tobytes())
        if all(each != range_hash for each, _ in intake.seen_ranges[k]):
            seen_ranges = (*intake.seen_ranges[k], (range_hash, pose))[-OLD_SCANS:]
            intake = dataclasses.replace(intake, seen_ranges=replace_item(intake.seen_ranges, k, seen_ranges))
        believed_scans = replace_item(intake.believed_scans, k, posed_scan)
        return dataclasses.replace(intake, believed_scans=believed_scans), posed_scan
    return intake, None


def _explain_disbelief(intake: Intake, k: int, scan: LaserScan, pose: np.ndarray) -> tuple[str, str]:
    """Why a scan cannot be what the lidar sees now, by those before: the kind, and a sentence; both empty if it can."""
    range_hash = hash(scan.ranges.tobytes())
    if np.isfinite(scan.ranges).any():
        for each, place in intake.seen_ranges[k]:
            forward, way_aside, turn = find_pose_in_frame(place, pose)
            apparent_way = max(math.hypot(forward, way_aside), abs(math.remainder(turn, 2.0 * math.pi)))
            if each == range_hash and apparent_way > FROZEN:
                return "frozen scan", "scans are frozen: the robot moves, and they stay the same, or come again"
    last = intake.believed_scans[k]
    if last is None:
        return "", ""
    allowed_way = JUMP + math.dist(last.pose[:2], pose[:2]) + WALKING * scan.scan_time
    remaining = int(np.count_nonzero(np.isfinite(last.scan.ranges) & (last.scan.ranges < scan.range_max - allowed_way)))
    hits = int(np.count_nonzero(scan.ranges < scan.range_max))
    if remaining >= FEWEST_HITS and hits < HITS_LEFT * remaining:
        return (
            "scan without returns",
            f"a scan has {counted(hits, 'hit')}, where {remaining} of the last cannot be gone; until they return, or a "
            "reset",
        )
    return "", ""


def read_goal(goal: Any) -> tuple[float, ...] | None:
    """A goal as (x, y) or (x, y, yaw); None for none, or a `StarnavError` for what is no goal."""
    if goal is None or isinstance(goal, tuple) and goal == WITHDRAWN:
        return None
    try:
        goal_values = tuple(map(float, goal))
    except (TypeError, ValueError):
        goal_values = ()
    if len(goal_values) not in (2, 3) or not all(map(math.isfinite, goal_values)):
        raise StarnavError(f"goal is {goal}; allowed: finite (x, y) or (x, y, yaw), or None")
    return goal_values
