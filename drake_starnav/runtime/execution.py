"""Whether the base does what it is told, within what is declared. Pure functions.

One that does not is braked. When it stands, and has stood for REST_TIME, it is tried again: it may have hesitated. It
is not if it fails again within RETRY_TIME, or if the scans change while the odometry says that it stands, which is then
false. So it is, too, with an odometry that differs from what the scans show of the robot's way.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from drake_starnav.lidar.mounts import Mount
from drake_starnav.localization.odometry_check import OdometryCheck
from drake_starnav.localization.scan_matching import OdometryError
from drake_starnav.robot.limits import Limits
from drake_starnav.robot.motion import convert_to_velocity
from drake_starnav.runtime.intake import Odometry, PosedScan
from drake_starnav.scenario.schema import Scenario
from drake_starnav.utils.snapshot import snapshot

WINDOW = 2.0
"""What is told and what is done are compared over this time, s."""
WAY_DIFFERENCE, WAY_SHARE = 0.1, 0.1
"""The way driven may differ from the one commanded by this, m, and by this share of it, beside what is declared."""
TURN_DIFFERENCE, TURN_SHARE = 0.6, 0.2
"""The same of the angle turned, rad; wheels that slide turn a robot by some 0.3 rad in MuJoCo."""
SEEN_OFF, SEEN_TURN, SEEN_SHARE, SEEN_STEPS = 0.2, 0.1, 0.15, 3
"""Scans may show a way that differs from the odometry's by the first, in cover radii, an angle by the second, rad, and
both by this share, beside what is declared; fewer steps than the last do not tell."""
LEAST_ARM = 0.5
"""Distance of a wheel that slips from the robot's axis, as a share of its radius."""
REST_TIME, RETRY_TIME = 1.0, 10.0
"""A base that has stood for the first, s, is tried again; if it then fails within the second, s, that lasts."""
STANDING_SPEED, POSE_CHANGE, RANGE_CHANGE = 0.02, 0.05, 0.1
"""A robot slower than this stands, m/s and rad/s; a pose stays that changes by less, m and rad; a range has changed
that differs by more than the last, m."""
FEWEST = 10
"""Beams that must have a range for that."""
CHANGED_SHARE, CARRIED_SHARE = 0.2, 0.5
"""The odometry of a base that fails lies if more than the first share of the ranges changed while its pose stayed; a
robot that is told to stand was carried if more than the second did."""


class CommandedVelocity(NamedTuple):
    """What was commanded from a time on, s: speeds along x and y, m/s, and turning, rad/s."""

    time: float
    v_x: float
    v_y: float
    turning: float

    @staticmethod
    def of(time: float, twist: np.ndarray, limits: Limits) -> "CommandedVelocity":
        """By the twist of a base, whose last component is a curvature where it steers."""
        v_x, v_y, turning = convert_to_velocity(twist)
        return CommandedVelocity(time, v_x, v_y, turning * v_x if limits.steers > 0.0 else turning)


@snapshot
class Execution:
    """What was told and done lately. Immutable.

    Attributes:
        velocities: commanded, oldest first.
        scans: of the first lidar, oldest first.
        why: what the base does other than it is told; empty: nothing.
        is_lost: whether that is what the scans show of its odometry: what was seen lies elsewhere.
        needs_new_goal: whether `why` lasts until the goal is withdrawn while the robot stands, and given anew.
        standing_since: since when it stands, s, while there is a `why`; infinite: it does not.
        trial_time: when it was last tried again, s.
        check: the odometry held against the scans of the first lidar.
    """

    velocities: tuple[CommandedVelocity, ...] = ()
    scans: tuple[PosedScan, ...] = ()
    why: str = ""
    is_lost: bool = False
    needs_new_goal: bool = False
    standing_since: float = math.inf
    trial_time: float = -math.inf
    check: OdometryCheck = OdometryCheck()

    @property
    def fault_text(self) -> str:
        """`why`, and whether it lasts."""
        return f"{self.why}; until the goal is given anew" if self.needs_new_goal else self.why


def add_command(execution: Execution, command: CommandedVelocity, delay: float) -> Execution:
    """What is told from now on; what is too old to be compared is forgotten."""
    recent_commands = tuple(each for each in execution.velocities if each.time > command.time - 2.0 * WINDOW - delay)
    return replace(execution, velocities=(*recent_commands, command))


def describe_lidar_error(scenario: Scenario) -> OdometryError:
    """What is declared of the first lidar, for an `OdometryCheck`, to which nothing declared of the odometry counts."""
    return OdometryError(0.0, 0.0, scenario.all_lidars[0].noise, scenario.robot.shape.cover_radius)


def add_scan(execution: Execution, latest: PosedScan, mount: Mount, scenario: Scenario) -> Execution:
    """What the first lidar has seen."""
    scans = tuple(each for each in execution.scans if each.scan.time > latest.scan.time - WINDOW)
    check = execution.check.add_scan(latest.scan, latest.pose, describe_lidar_error(scenario), mount)
    return replace(execution, scans=(*scans, latest), check=check)


def judge_execution(execution: Execution, time: float, rows: Sequence[Odometry], scenario: Scenario) -> Execution:
    """Whether the base does what it is told until now, s; without odometry it is not known."""
    if execution.needs_new_goal or not rows:
        return execution
    if not execution.why:
        failure = describe_not_executed(execution.velocities, rows, scenario)
        conflict = describe_disagreement(execution.check, scenario)
        must_wait = bool(failure or conflict) and time < execution.trial_time + RETRY_TIME
        needs_new_goal = must_wait or bool(failure) and is_pose_denied(execution.scans)
        return replace(execution, why=conflict or failure, is_lost=bool(conflict), needs_new_goal=needs_new_goal)
    last_row, last_command = rows[-1], execution.velocities[-1][1:] if execution.velocities else ()
    if any(abs(each) > STANDING_SPEED for each in (last_row.v, last_row.aside, last_row.omega, *last_command)):
        return replace(execution, standing_since=math.inf)
    standing_since = min(execution.standing_since, time)
    if time > standing_since + REST_TIME:
        return Execution((), execution.scans, trial_time=time)
    return replace(execution, standing_since=standing_since)


def acknowledge_withdrawal(execution: Execution) -> Execution:
    """The execution after the goal was withdrawn from a robot that stands: what lasts is tried once more."""
    return Execution(scans=execution.scans, trial_time=execution.trial_time)


def compute_changed_share(scans: Sequence[PosedScan]) -> float:
    """Share of the beams that changed while the pose stayed as it is now; NaN where fewer than FEWEST tell anything."""
    if not scans:
        return math.nan
    scan_poses, newest = np.array([each.pose for each in scans]), scans[-1].scan
    left_poses = np.flatnonzero(np.abs(scan_poses - scan_poses[-1]).max(axis=1) > POSE_CHANGE)
    oldest = scans[left_poses[-1] + 1 if len(left_poses) else 0].scan
    if len(oldest.ranges) != len(newest.ranges):
        return 1.0
    is_known = (np.isfinite(oldest.ranges) | np.isfinite(newest.ranges)) & ~np.isnan(oldest.ranges + newest.ranges)
    ranges_before, ranges_after = (np.clip(each.ranges[is_known], 0.0, each.range_max) for each in (oldest, newest))
    has_changed = np.abs(ranges_before - ranges_after) > RANGE_CHANGE
    return float(has_changed.mean()) if len(has_changed) >= FEWEST else math.nan


def is_pose_denied(scans: Sequence[PosedScan]) -> bool:
    """Whether scans change while the pose stays, or tell nothing."""
    return bool(scans) and not compute_changed_share(scans) <= CHANGED_SHARE


def is_carried(execution: Execution) -> bool:
    """Whether most of what a robot sees changed while it was told to stand, and its odometry says that it stood."""
    is_standing = bool(execution.velocities) and not any(any(each[1:]) for each in execution.velocities)
    return is_standing and compute_changed_share(execution.scans) > CARRIED_SHARE


def compare_motion(
    commands: Sequence[CommandedVelocity], rows: Sequence[Odometry], delay: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """What was commanded and what was driven, each (ahead, aside, turned), m and rad, and the time of both, s.

    `delay` is that of a command's effect, s. The time is 0 where nothing can be compared.
    """
    nothing = np.zeros(3), np.zeros(3), 0.0
    if len(commands) < 2 or len(rows) < 2:
        return nothing
    command_rows, driven_rows = np.array(commands), np.array(rows)
    row_times = driven_rows[:, 0]
    begin = max(row_times[-1] - WINDOW, command_rows[0, 0] + delay, row_times[0])
    driven_rows = driven_rows[np.searchsorted(row_times, begin) :]
    if len(driven_rows) < 2:
        return nothing
    begin, end = driven_rows[0, 0], driven_rows[-1, 0]
    command_ends = np.clip(np.append(command_rows[:, 0], math.inf) + delay, begin, end)
    asked_way = (np.diff(command_ends)[:, None] * command_rows[:, 1:]).sum(axis=0)
    row_steps = np.diff(driven_rows[:, 1:4], axis=0)
    row_turns = np.mod(row_steps[:, 2] + math.pi, 2.0 * math.pi) - math.pi
    middle_yaws = driven_rows[:-1, 3] + 0.5 * row_turns
    way_ahead = row_steps[:, 0] * np.cos(middle_yaws) + row_steps[:, 1] * np.sin(middle_yaws)
    way_aside = row_steps[:, 1] * np.cos(middle_yaws) - row_steps[:, 0] * np.sin(middle_yaws)
    return asked_way, np.array((way_ahead.sum(), way_aside.sum(), row_turns.sum())), float(end - begin)


def describe_not_executed(commands: Sequence[CommandedVelocity], rows: Sequence[Odometry], scenario: Scenario) -> str:
    """What the base, or its odometry, does other than it is told; empty: nothing."""
    drive = scenario.drive
    asked_way, driven_way, time = compare_motion(commands, rows, drive.delay)
    asked_length, deviation = math.hypot(*asked_way[:2]), math.hypot(*(driven_way - asked_way)[:2])
    turn, driven_turn = asked_way[2], driven_way[2]
    if deviation > WAY_DIFFERENCE + drive.error + (WAY_SHARE + drive.slip) * asked_length:
        done = math.hypot(*driven_way[:2])
        return f"not executed: {done:.2f} m driven by the odometry, {asked_length:.2f} m commanded in {time:.1f} s"
    slipped_way = drive.slip * (abs(turn) + asked_length / (LEAST_ARM * scenario.robot.radius))
    if abs(driven_turn - turn) > TURN_DIFFERENCE + TURN_SHARE * abs(turn) + slipped_way:
        return f"not executed: {driven_turn:.2f} rad turned by the odometry, {turn:.2f} rad commanded in {time:.1f} s"
    return ""


def describe_disagreement(check: OdometryCheck, scenario: Scenario) -> str:
    """How the robot's way by its odometry differs from what the scans show; empty: by no more than is declared."""
    if len(check.steps) < SEEN_STEPS:
        return ""
    difference, localization = check.sum_differences(), scenario.localization
    share = SEEN_SHARE + localization.drift + scenario.drive.slip
    obstacle_way = scenario.obstacles.max_speed * difference.time
    way_text = f"{difference.seen_way:.2f} m driven by the scans, {difference.driven_way:.2f} m by the odometry"
    angle_text = f"{difference.seen_turn:.2f} rad turned by the scans, {difference.driven_turn:.2f} rad by the odometry"
    declared_error = localization.jump + obstacle_way + share * difference.driven_way
    if difference.way_error > SEEN_OFF * scenario.robot.shape.cover_radius + declared_error:
        return f"scans and odometry disagree: {way_text}"
    if difference.turn_error > SEEN_TURN + (obstacle_way > 0.0) * TURN_DIFFERENCE + share * difference.driven_turn:
        return f"scans and odometry disagree: {angle_text}"
    return ""
