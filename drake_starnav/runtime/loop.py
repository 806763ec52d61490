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
from drake_starnav.runtime.intake import Intake
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


class RobotDriver(Protocol):
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
    robot: RobotDriver,
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

    timing = _Timing(navigator)
    run_log = None if log is None else RunLog(log, navigator)
    navigator.reset()
    end = ""
    with _freeze_objects():
        try:
            with _handle_signals() as stop_signal, _handle_signals(signal.SIGUSR1) as reset_signal:
                robot.read()  # what waited while the navigator was built is old
                for _ in timing.begin_periods(seconds):
                    reading = _read(robot, goal, reset_signal)
                    command = navigator.step(*reading)
                    robot.drive(command)
                    timing.note(reading)
                    if run_log is not None:
                        run_log.note(reading, command, timing.durations[-1])
                    if not quiet:
                        timing.print_status(command)
                    if stop_signal.is_set():
                        end = "stopped"
                    elif until_reached and command.status == "reached" and not command.twist.any():
                        end = "reached"
                    if end:
                        break
        finally:
            _ramp_to_zero(navigator, robot)
            if run_log is not None:
                run_log.close()
    return timing.summarize(end or "over", navigator.intake)


@contextlib.contextmanager
def _freeze_objects() -> Iterator[None]:
    """Let the collector not look again at what is there, while the robot moves."""
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()


class _Timing:
    """What is measured of a drive: how long commands take, how old scans are at the next command, and late periods."""

    def __init__(self, navigator: Navigator) -> None:
        self.period = navigator.actuation.hold
        self.declared_delay = navigator.scenario.lidar.delay + navigator.scenario.drive.delay + self.period
        self.durations: list[float] = []
        self.scan_ages = [0.0]
        self._late_count, self._start_time = 0, 0.0

    def begin_periods(self, seconds: float) -> Iterator[None]:
        """Wait for each period to begin, for so long, s; those that are over are left out, and are late."""
        period_count, begin = 0, time.monotonic()
        while (current_time := time.monotonic()) < begin + seconds:
            due_time = begin + period_count * self.period
            if current_time < due_time:
                time.sleep(due_time - current_time)
            else:
                missed_count = max(int((current_time - begin) / self.period) - period_count, 0)
                period_count += missed_count
                self._late_count += missed_count if self.durations else 0
            self._start_time = time.perf_counter()
            yield
            period_count += 1

    def note(self, reading: Reading) -> None:
        """Note the command of a period after a reading, and how long all of it took."""
        self.durations.append(time.perf_counter() - self._start_time)
        arrived_scans = reading.scans if isinstance(reading.scans, (list, tuple)) else ()
        scans = (each[-1] if isinstance(each, tuple) and each else each for each in arrived_scans)  # whatever else came
        ages = (reading.now + self.durations[-1] - scan.time for scan in scans if isinstance(scan, LaserScan))
        self.scan_ages += filter(math.isfinite, ages)

    def print_status(self, command: Command) -> None:
        """Print a status on one line, twice a second."""
        if len(self.durations) % max(round(0.5 / self.period), 1) == 0:
            twist = ", ".join(f"{each:+.2f}" for each in command.twist)
            warning = _describe_slow_answer(self.scan_ages[-MANY:], self.declared_delay)
            line = f"{command.status}  {twist}  {command.why or warning}"
            print(f"\r{line[:118]:<118}", end="", file=sys.stderr, flush=True)

    def summarize(self, end: str, intake: Intake) -> Driven:
        """What the drive was like, by how it ended and what was dropped."""
        p50, p99, longest = np.percentile(self.durations or [0.0], (50.0, 99.0, 100.0)).tolist()
        answer = float(np.percentile(self.scan_ages, 99.0))
        step, dropped = (p50, p99, longest), dict(intake.drop_counts)
        return Driven(end, len(self.durations), self._late_count, step, dropped, answer, self.declared_delay)


def _read(robot: RobotDriver, goal: Sequence[float] | None, reset: threading.Event) -> Reading:
    """Read a robot; the goal is `goal` where it reads none, and an event that is set asks for a reset, once."""
    reading = Reading(*robot.read())
    if reading.goal is None:
        reading = reading._replace(goal=goal)
    if reset.is_set():
        reset.clear()
        reading = reading._replace(reset=True)
    return reading


def _ramp_to_zero(navigator: Navigator, robot: RobotDriver) -> None:
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


def _describe_slow_answer(answers: Sequence[float], declared_delay: float) -> str:
    """Say that 99 of 100 answers take longer than declared, s; empty: they do not."""
    answer = float(np.percentile(answers, 99.0))
    if answer <= declared_delay:
        return ""
    allowed_text = f"lidar.delay, drive.delay and a period allow {1e3 * declared_delay:.0f} ms"
    return f"warning: {1e3 * answer:.0f} ms from scan to command; {allowed_text}"
