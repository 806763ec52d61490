"""The loop of a robot: read, step, drive, once a control period, and a ramp to zero however it ends."""

import contextlib
import gc
import math
import signal
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np

from drake_starnav.errors import counted
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.runtime.navigator import Command, Navigator
from drake_starnav.runtime.watchdog import ZEROS

MANY = 200
"""The status tells how late the commands were that answered this many last scans."""
LONGEST_RAMP = 10.0
"""The ramp at the end takes this long at most, s."""


class Reading(NamedTuple):
    """What came since the last reading, and whether a reset is asked, as of `Navigator.step`."""

    now: float
    scans: Any = ()
    odometry: Any = ()
    goal: Any = None
    reset: bool = False


class DrivenRobot(Protocol):
    """What `drive` needs of a robot; see `drake_starnav.runtime`."""

    def read(self) -> Reading: ...

    def drive(self, command: Command) -> None: ...

    def close(self) -> None: ...


class Driven(NamedTuple):
    """What a drive was like.

    Attributes:
        end: reached, stopped (by a signal) or over (the time).
        ticks: how many commands were given, without the last ramp.
        late: periods that passed without a command.
        step: p50, p99 and longest time of read, step and drive together, s.
        dropped: why inputs were dropped, and how often.
        answer: in 99 of 100 cases a scan's stamp was no older than this when the command that follows it was sent, s.
        declared: `lidar.delay`, `drive.delay` and a control period together, s, which `answer` shall not exceed.
    """

    end: str
    ticks: int
    late: int
    step: tuple[float, float, float]
    dropped: dict[str, int]
    answer: float = 0.0
    declared: float = math.inf

    def __str__(self) -> str:
        p50, p99, worst = (1e3 * each for each in self.step)
        report_text = f"{self.end} after {counted(self.ticks, 'command')}, {counted(self.late, 'period')} late; "
        report_text += f"a command takes {p50:.1f} ms (p99 {p99:.1f}, longest {worst:.1f})"
        report_text += "".join(f"; {count} x {why}" for why, count in self.dropped.items())
        warning = _describe_slow_answer([self.answer], self.declared)
        return f"{report_text}; {warning}" if warning else report_text


def drive(
    navigator: Navigator,
    robot: DrivenRobot,
    *,
    goal: Sequence[float] | None = None,
    log: str | Path | None = None,
    seconds: float = math.inf,
    until_reached: bool = False,
    quiet: bool = True,
) -> Driven:
    """Drive a robot until a signal, SIGTERM or SIGINT, ends it; SIGUSR1 resets the navigator, see `Navigator.step`.

    The schedule is absolute: a late command does not delay those after it, and is counted. Whatever ends the loop, an
    exception included, the base is ramped to zero and told so several times, then the robot is closed.

    Args:
        goal: as of `Navigator.step`, where the robot reads none.
        log: the MCAP file to write, as of `replay`.
        seconds: after which it ends, too.
        until_reached: whether it ends when the goal is reached and the robot stands.
        quiet: no line with the status.
    """
    from drake_starnav.runtime.log import RunLog  # late: an extra

    period, scenario, end = navigator.actuation.hold, navigator.scenario, "over"
    timing = _Timing(scenario.lidar.delay + scenario.drive.delay + period)
    run_log = None if log is None else RunLog(Path(log), navigator)
    navigator.reset()
    gc.collect()
    gc.freeze()  # what is there stays: the collector need not look at it again while the robot moves
    try:
        with _handle_signals() as stop_signal, _handle_signals(signal.SIGUSR1) as reset_signal:
            robot.read()  # what waited while the navigator was built is old
            begin = time.monotonic()
            for tick in _count_periods(begin, period, begin + seconds):
                start_time = time.perf_counter()
                reading = _read(robot, goal, reset_signal)
                command = navigator.step(*reading)
                robot.drive(command)
                timing.note(tick, reading, time.perf_counter() - start_time)
                if run_log is not None:
                    run_log.note(reading, command, timing.durations[-1])
                if not quiet and len(timing.durations) % max(round(0.5 / period), 1) == 0:
                    _print_status(command, _describe_slow_answer(timing.scan_ages[-MANY:], timing.declared_delay))
                if stop_signal.is_set():
                    end = "stopped"
                    break
                if until_reached and command.status == "reached" and not command.twist.any():
                    end = "reached"
                    break
    finally:
        _ramp_to_zero(navigator, robot)
        if run_log is not None:
            run_log.close()
        gc.unfreeze()
    return timing.summarize(end, dict(navigator.intake.drop_counts))


class _Timing:
    """What is measured of a drive: how long commands take, how old scans are at the next command, and late periods."""

    def __init__(self, declared_delay: float) -> None:
        self.declared_delay = declared_delay
        self.durations: list[float] = []
        self.scan_ages = [0.0]
        self._late_count, self._last_tick = 0, 0

    def note(self, tick: int, reading: Reading, duration: float) -> None:
        """Note the command of a period, by its number, from 1, after a reading, and how long all of it took, s."""
        self._late_count += tick - self._last_tick - 1 if self._last_tick else 0
        self._last_tick = tick
        self.durations.append(duration)
        self.scan_ages += _measure_scan_ages(reading, duration)

    def summarize(self, end: str, dropped: dict[str, int]) -> Driven:
        """What the drive was like, by how it ended and what was dropped."""
        p50, p99, longest = np.percentile(self.durations or [0.0], (50.0, 99.0, 100.0)).tolist()
        answer = float(np.percentile(self.scan_ages, 99.0))
        return Driven(
            end, len(self.durations), self._late_count, (p50, p99, longest), dropped, answer, self.declared_delay
        )


def _read(robot: DrivenRobot, goal: Sequence[float] | None, reset: threading.Event) -> Reading:
    """Read a robot; the goal is `goal` where it reads none, and an event that is set asks for a reset, once."""
    reading = Reading(*robot.read())
    if reading.goal is None:
        reading = reading._replace(goal=goal)
    if reset.is_set():
        reset.clear()
        reading = reading._replace(reset=True)
    return reading


def _count_periods(begin: float, period: float, end: float) -> Iterator[int]:
    """Numbers of the periods, from 1, each when it begins; those that are over are left out."""
    period_number = 1
    while (current_time := time.monotonic()) < end:
        due_time = begin + (period_number - 1) * period
        if current_time < due_time:
            time.sleep(due_time - current_time)
        else:
            period_number = max(period_number, int((current_time - begin) / period) + 1)
        yield period_number
        period_number += 1


def _ramp_to_zero(navigator: Navigator, robot: DrivenRobot) -> None:
    """Ramp to zero, say so several times, and close; what fails on the way is raised at the end."""
    first_error: BaseException | None = None
    period, zero_count, end_time = navigator.actuation.hold, 0, time.monotonic() + LONGEST_RAMP
    with _handle_signals():
        while zero_count < ZEROS and time.monotonic() < end_time:
            command = navigator.brake("the loop has ended")
            zero_count += command.status == "standing"
            try:
                robot.drive(command)
            except Exception as error:
                first_error, zero_count = error, zero_count + 1
            time.sleep(period)
        robot.close()
    if first_error is not None and sys.exception() is None:
        raise first_error


@contextlib.contextmanager
def _handle_signals(*numbers: signal.Signals) -> Iterator[threading.Event]:
    """Signals, or else SIGTERM and SIGINT, only set an event; in the main thread, where alone they come."""
    signal_event, previous_handlers = threading.Event(), {}
    if threading.current_thread() is threading.main_thread():
        for each in numbers or (signal.SIGTERM, signal.SIGINT):
            previous_handlers[each] = signal.signal(each, lambda *_: signal_event.set())
    try:
        yield signal_event
    finally:
        for each, handler in previous_handlers.items():
            signal.signal(each, handler)


def _measure_scan_ages(reading: Reading, took: float) -> list[float]:
    """How old the scans that came were when the command was sent, s, whatever else came."""
    arrived_scans = reading.scans if isinstance(reading.scans, (list, tuple)) else ()
    scans = (each[-1] if isinstance(each, tuple) and each else each for each in arrived_scans)
    scan_ages = [reading.now + took - scan.time for scan in scans if isinstance(scan, LaserScan)]
    return [age for age in scan_ages if math.isfinite(age)]


def _describe_slow_answer(answers: Sequence[float], declared_delay: float) -> str:
    """Say that 99 of 100 answers take longer than declared, s; empty: they do not."""
    answer = float(np.percentile(answers, 99.0))
    if answer <= declared_delay:
        return ""
    allowed_text = f"lidar.delay, drive.delay and a period allow {1e3 * declared_delay:.0f} ms"
    return f"warning: {1e3 * answer:.0f} ms from scan to command; {allowed_text}"


def _print_status(command: Command, warning: str) -> None:
    """Status on one line."""
    twist = ", ".join(f"{each:+.2f}" for each in command.twist)
    line = f"{command.status}  {twist}  {command.why or warning}"
    print(f"\r{line[:118]:<118}", end="", file=sys.stderr, flush=True)
