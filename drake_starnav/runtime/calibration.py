"""Parameters of a robot and its lidars from the log of a drive, as YAML to declare. Pure functions."""

import math
from typing import NamedTuple

import numpy as np

from drake_starnav.errors import StarnavError, counted
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.mounts import Mount
from drake_starnav.localization.odometry_check import KEPT_STEPS, OdometryCheck
from drake_starnav.runtime.execution import CommandedVelocity, compare_motion, describe_lidar_error
from drake_starnav.runtime.intake import EXTRAPOLATION, Odometry, interpolate_pose
from drake_starnav.runtime.log import Log
from drake_starnav.scenario.schema import Scenario

LONGEST_DELAY, DELAY_STEP = 0.5, 0.01
"""Delays of the drive that are tried, s."""
STILL_SPEED, LEAST_SCANS = 0.005, 10
"""Noise is measured while a robot is slower than this, m/s and rad/s, in this many scans at least."""
OWN_NOISE = 5.0
"""A hit that stays equal, within this many standard deviations, while the robot moves is on the robot itself."""
SHIPPED_DEVIATION = 0.003
"""What the shipped bases deviate until they stand, m; only more is to be declared."""
ALIGNMENT_SHARE, LEAST_TURN = 0.03, 1.0
"""Scans show the odometry's drift only above the first share of it, which is the error of their alignment; and of the
heading where the robot turned by the second within some steps, rad."""


class LoggedDrive(NamedTuple):
    """What a log holds, for these functions.

    Attributes:
        scenario: that drove.
        scans: of the lidar in question, at first the first, with the time at which each came, s.
        lidars: those of each lidar.
        mounts: of the lidars.
        rows: odometry, in order.
        velocities: commanded.
        send_delays: how long after its time each was sent, s.
    """

    scenario: Scenario
    scans: tuple[tuple[float, LaserScan], ...]
    rows: tuple[Odometry, ...]
    velocities: tuple[CommandedVelocity, ...]
    send_delays: tuple[float, ...]
    lidars: tuple[tuple[tuple[float, LaserScan], ...], ...]
    mounts: tuple[Mount, ...]


def select_drive(log: Log, scenario: Scenario) -> LoggedDrive:
    """What came in and was commanded; a `StarnavError` where that is too little."""
    lidars: list[list[tuple[float, LaserScan]]] = [[] for _ in scenario.all_lidars]
    rows: list[Odometry] = []
    commands: list[CommandedVelocity] = []
    send_delays: list[float] = []
    for (current_time, arrived_scans, odometry, *_), command, delay in log.ticks:
        send_delays.append(delay)
        for k, scan in filter(None, arrived_scans):
            lidars[k].append((current_time, scan))
        for row in filter(None, odometry):
            if all(map(math.isfinite, row)) and (not rows or row.time > rows[-1].time):
                rows.append(row)
        commands.append(CommandedVelocity.of(current_time, command.twist, scenario.robot.limits))
    least, scans = min(map(len, lidars)), tuple(map(tuple, lidars))
    if least < LEAST_SCANS or len(rows) < LEAST_SCANS:
        raise StarnavError(
            f"the log has {counted(least, 'scan')} and {counted(len(rows), 'pose')}; "
            f"allowed: at least {LEAST_SCANS} of each"
        )
    return LoggedDrive(scenario, scans[0], tuple(rows), tuple(commands), tuple(send_delays), scans, log.mounts)


def estimate_lidar(log: LoggedDrive) -> dict[str, float]:
    """Beams, limits, rate, noise, lost beams and delay of the lidar, by the keys of `lidar`."""
    scan_times = np.array([scan.time for _, scan in log.scans])
    scan_stride = min(len(scan_times) - 1, LEAST_SCANS)  # as they may come by the raster of something else
    scan_delays = np.array([arrival_time - scan.time for arrival_time, scan in log.scans])
    last = log.scans[-1][1]
    ranges = np.array([scan.ranges for _, scan in log.scans if len(scan.ranges) == len(last.ranges)])
    latest = float(np.quantile(scan_delays, 0.99))
    wait = min(1.0 / log.scenario.controller.rate, latest - float(scan_delays.min()))  # for a step: no delay of its own
    turn_end = last.angle_min + len(last.ranges) * last.angle_increment if last.full_circle else last.angle_max
    return {
        "beams": len(last.ranges),
        "angle_min": round(last.angle_min, 6),
        "angle_max": round(min(turn_end, last.angle_min + 2.0 * math.pi), 6),
        "range_min": round(last.range_min, 4),
        "range_max": round(last.range_max, 4),
        "rate": float(f"{scan_stride / np.median(scan_times[scan_stride:] - scan_times[:-scan_stride]):.3g}"),
        "noise": _round_up(estimate_range_noise(log)),
        "dropout": _round_up(float(np.isnan(ranges).mean())),
        "delay": _round_up(max(latest - wait, 0.0)),
    }


def estimate_range_noise(log: LoggedDrive) -> float:
    """Standard deviation of ranges while the robot stands, m, the median of all beams; NaN where it never does."""
    row_times = np.array([row.time for row in log.rows])
    is_moving = np.array([max(abs(row.v), abs(row.aside), abs(row.omega)) > STILL_SPEED for row in log.rows])
    still_scans: list[np.ndarray] = []
    best_noise = math.nan
    for _, scan in (*log.scans, (0.0, None)):
        rows_around = (
            slice(0, 0) if scan is None else slice(*np.searchsorted(row_times, (scan.time - 0.2, scan.time + 0.2)))
        )
        if scan is not None and not is_moving[rows_around].any() and len(row_times[rows_around]):
            still_scans.append(scan.ranges)
            continue
        if len(still_scans) >= LEAST_SCANS and len({len(each) for each in still_scans}) == 1:
            hit_ranges = np.array(still_scans)[:, np.isfinite(still_scans).all(axis=0)]
            if hit_ranges.shape[1]:
                best_noise = float(np.nanmin((best_noise, np.median(hit_ranges.std(axis=0, ddof=1)))))
        still_scans = []
    return best_noise


def estimate_mask(log: LoggedDrive) -> list[list[float]] | None:
    """Where the lidar sees the robot, as of `lidar.mask`; None: unknown, as the robot hardly moved."""
    last_scan, radius = log.scans[-1][1], log.scenario.robot.radius
    if np.ptp([row[1:3] for row in log.rows], axis=0).max() < 2.0 * radius:
        return None  # what stands about it looks the same
    ranges = np.array([scan.ranges for _, scan in log.scans if len(scan.ranges) == len(last_scan.ranges)])
    is_near = ranges < 1.5 * radius  # -inf included
    near_ranges = np.clip(ranges, 0.0, 1.5 * radius)
    range_spread = np.where(is_near, np.abs(near_ranges - np.median(near_ranges, axis=0)), 0.0).max(axis=0)
    noise = estimate_range_noise(log)
    is_own = (is_near.mean(axis=0) > 0.9) & (range_spread < OWN_NOISE * (0.01 if math.isnan(noise) else noise) + 1e-6)
    sector_edges = np.flatnonzero(np.diff(np.concatenate(([0], is_own.astype(int), [0]))))
    half = 0.5 * last_scan.angle_increment
    return np.round(
        [(last_scan.bearings[a] - half, last_scan.bearings[b - 1] + half) for a, b in sector_edges.reshape(-1, 2)], 4
    ).tolist()


def estimate_drive(log: LoggedDrive) -> dict[str, float]:
    """Delay, slip and error of the drive, by the keys of `drive`: least values that this log allows."""
    rows, delay = np.array(log.rows), estimate_drive_delay(log)
    robot = log.scenario.robot
    braking_time = max(robot.max_speed / robot.limits.max_deceleration, 0.5)
    lost_ways, stray_shares = [0.0], [0.0]
    for end in np.arange(rows[0, 0] + braking_time, rows[-1, 0], 0.5 * braking_time):
        braking_rows = log.rows[np.searchsorted(rows[:, 0], end - braking_time) : np.searchsorted(rows[:, 0], end)]
        asked_way, driven_way, time = compare_motion(log.velocities, braking_rows, delay)
        asked_length = math.hypot(*asked_way[:2])
        if time < 0.5 * braking_time:
            continue
        deviation = driven_way - asked_way
        stray_shares.append(math.hypot(deviation[0], deviation[1]))
        if asked_length > robot.radius:
            lost_ways.append(1.0 - math.hypot(*driven_way[:2]) / asked_length)
    drive_slip = max(float(np.quantile(lost_ways, 0.98)), 0.0)
    drive_error = max(float(np.quantile(stray_shares, 0.98)) - SHIPPED_DEVIATION, 0.0)
    explained_by_slip = drive_slip * robot.max_speed * braking_time
    delay = delay if delay > 1.0 / log.scenario.controller.rate else 0.0  # a command is reached within its period
    delay = max(delay, float(np.quantile(log.send_delays, 0.99)))
    return {
        "delay": _round_up(delay),
        "slip": _round_up(drive_slip, 0.01),
        "error": _round_up(max(drive_error - explained_by_slip, 0.0), 0.005),
    }


def estimate_drive_delay(log: LoggedDrive) -> float:
    """The delay with which the twist of the odometry follows the commanded one best, s."""
    rows, commands = np.array(log.rows), np.array(log.velocities)
    measured_velocity = np.column_stack((rows[:, 4], rows[:, 6], rows[:, 5]))
    velocity_scale = np.maximum(np.abs(commands[:, 1:]).max(axis=0), 0.05)
    tried_delays = np.arange(0.0, LONGEST_DELAY + 1e-9, DELAY_STEP)
    delay_misfits = []
    for delay in tried_delays:
        at = np.searchsorted(commands[:, 0], rows[:, 0] - delay, side="right") - 1
        deviation = (measured_velocity - commands[np.maximum(at, 0), 1:])[at >= 0] / velocity_scale
        delay_misfits.append(float((deviation**2).mean()))
    best = float(tried_delays[int(np.argmin(delay_misfits))])
    return best if delay_misfits[0] - min(delay_misfits) > 1e-4 else 0.0  # a command that never changes tells nothing


def estimate_odometry_drift(log: LoggedDrive) -> float:
    """Drift of the odometry that the first lidar's scans show, as of `localization.drift`; NaN if it hardly moved."""
    scenario, row_times = log.scenario, np.array([row.time for row in log.rows])
    lidar, check, drift_shares = scenario.all_lidars[0], OdometryCheck(), []
    error = describe_lidar_error(scenario)
    for _, scan in log.lidars[0]:
        next_row = int(np.searchsorted(row_times, scan.time))
        pose = interpolate_pose(log.rows[max(next_row - 1, 0) : next_row + 1], scan.time, EXTRAPOLATION)
        if pose is None:
            continue
        previous_check, check = check, check.add_scan(scan.mask_sectors(lidar.mask), pose, error, log.mounts[0])
        if check.steps is not previous_check.steps and len(check.steps) == KEPT_STEPS:
            total = check.sum_differences()
            turning_share = total.turn_error / total.driven_turn if total.driven_turn > LEAST_TURN else 0.0
            drift_shares.append(max(total.way_error / max(total.driven_way, error.body), turning_share))
    return float(np.quantile(drift_shares, 0.9)) if drift_shares else math.nan


def calibrate(log: Log, scenario: Scenario) -> str:
    """YAML to declare, with what it rests on.

    Args:
        log: of a drive with turns, and with some seconds of standing.
        scenario: that drove.
    """
    logged_run = select_drive(log, scenario)
    drive_section = estimate_drive(logged_run)
    lidar_sections = [_make_lidar_section(logged_run._replace(scans=scans)) for scans in logged_run.lidars]
    seconds = logged_run.rows[-1].time - logged_run.rows[0].time
    way = float(np.hypot(*np.diff(np.array(logged_run.rows)[:, 1:3].T, axis=1)).sum())
    lines = [
        f"# {seconds:.0f} s, {way:.1f} m, {len(logged_run.scans)} scans, {len(logged_run.rows) / seconds:.0f} "
        "poses a second"
    ]
    lines.append("lidars:" if scenario.lidars else "lidar:")
    for lidar, section in zip(scenario.all_lidars, lidar_sections, strict=True):
        lines += [f"  - frame: {lidar.frame}"] * bool(scenario.lidars)
        lines += [f"{'    ' if scenario.lidars else '  '}{line}" for line in section]
    drift = estimate_odometry_drift(logged_run)
    if drift > ALIGNMENT_SHARE:
        lines += ["localization:", f"  drift: {_round_up(drift, 0.01):g}"]
    elif math.isnan(drift):
        lines.append("# localization.drift: unknown, as the robot hardly moved, or its scans do not fit each other")
    lines += ["drive:", *(f"  {name}: {value:g}" for name, value in drive_section.items())]
    if drive_section["slip"] > 0.2 or drive_section["error"] > 0.1:
        lines.append("# the base does not do what it is told: look for the cause before this is declared")
    return "\n".join(lines) + "\n"


def _make_lidar_section(log: LoggedDrive) -> list[str]:
    """What to declare of a lidar."""
    lidar_values, mask = estimate_lidar(log), estimate_mask(log)
    lines = [f"{name}: {value:g}" for name, value in lidar_values.items() if not math.isnan(value)]
    if math.isnan(lidar_values["noise"]):
        lines.append("# noise: unknown, as the robot never stood for half a second: let it stand before it drives")
    unknown_mask = "# mask: unknown, as the robot hardly moved"
    return [*lines, unknown_mask if mask is None else f"mask: {mask}" if mask else "# mask: it does not see the robot"]


def _round_up(value: float, least: float = 0.001) -> float:
    """A value to declare: rounded up to a multiple of `least`; what is below half of that is nothing."""
    return value if math.isnan(value) else round(math.ceil(max(value / least - 0.5, 0.0)) * least, 6)
