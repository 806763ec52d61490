"""A second process between the loop and the base: when the loop falls silent, it ramps the base to zero.

It is told twists on its standard input, one JSON list a line, and passes them on. When none comes for DEADLINE seconds,
or the input ends, it brakes along the ramp that the last certified motion ends with. It is armed by the first twist,
loads neither Drake nor NumPy, and ignores Ctrl-C: the loop then ends in order.
"""

import contextlib
import json
import math
import select
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from typing import Any, NamedTuple

from drake_starnav.utils.imported import import_named

DEADLINE, PERIOD = 0.1, 0.02
"""s"""
ZEROS = 5
"""Number of zero twists that a base is sent in the end."""


class Ramp(NamedTuple):
    """How a base brakes: by how much its speed and its turning rate fall, m/s^2 and rad/s^2; one that steers keeps its
    curvature."""

    deceleration: float
    yaw_acceleration: float
    steers: bool = False

    def after(self, twist: Sequence[float], dt: float) -> list[float]:
        """The twist after a time, s, of braking."""
        speed = math.hypot(*twist[:-1])
        kept_share = max(speed - self.deceleration * dt, 0.0) / speed if speed > 0.0 else 0.0
        turn_rate = twist[-1]
        if not self.steers:
            turn_rate = math.copysign(max(abs(turn_rate) - self.yaw_acceleration * dt, 0.0), turn_rate)
        elif kept_share == 0.0:
            turn_rate = 0.0
        return [*(kept_share * each for each in twist[:-1]), turn_rate]


def read_ramp(limits: Any) -> Ramp:
    """By the `Limits` of a robot."""
    return Ramp(limits.max_deceleration, limits.max_yaw_acceleration, limits.steers > 0.0)


class Watched:
    """A base in a process of its own, for a robot's `drive`: what is sent here, it gets there, or a ramp.

    The base is an object with `drive(twist)` and `close()`, made there by a function that can be imported.
    """

    def __init__(self, base: str, arguments: dict[str, Any], ramp: Ramp) -> None:
        """
        Args:
            base: the function, as `module:name`.
            arguments: by name, as JSON can hold them.
            ramp: of the robot.
        """
        command = [sys.executable, "-m", __name__, base, json.dumps(arguments), json.dumps(ramp)]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, start_new_session=True)

    def drive(self, twist: Sequence[float]) -> None:
        """Send a twist; raises an `OSError` when the process has ended."""
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps([float(each) for each in twist]).encode() + b"\n")
        self.process.stdin.flush()

    def close(self) -> None:
        """End it: a base that still moves is ramped to zero first."""
        with contextlib.suppress(OSError):
            assert self.process.stdin is not None
            self.process.stdin.close()
        self.process.wait(timeout=10.0)


def watch(base: Any, ramp: Ramp, lines: Any = None) -> None:
    """Pass on to a base what comes as lines until they end, and ramp it to zero where they stop to come.

    Args:
        base: with `drive(twist)` and `close()`.
        ramp: of the robot.
        lines: a binary file that can be waited for; None for the standard input.
    """
    line_stream = sys.stdin.buffer.raw if lines is None else lines  # type: ignore[union-attr]
    twist: list[float] = []
    line_start, last_heard, zero_count, open_ = b"", time.monotonic(), 0, True
    while open_ or (twist and zero_count < ZEROS):
        wait_time = DEADLINE - (time.monotonic() - last_heard) if open_ and twist else 1.0
        if open_ and select.select([line_stream], [], [], max(wait_time, 0.0))[0]:
            data = line_stream.read(65536)
            open_ = bool(data)
            *whole_lines, line_start = (line_start + data).split(b"\n")
            if whole_lines:
                twist, last_heard, zero_count = json.loads(whole_lines[-1]), time.monotonic(), 0
                base.drive(twist)
            continue
        if twist and zero_count < ZEROS:
            twist = ramp.after(twist, PERIOD)
            zero_count += not any(twist)
            base.drive(twist)
            _wait_for_line(line_stream if open_ else None, PERIOD)
        elif open_:
            _wait_for_line(line_stream, 1.0)
    base.close()


def _wait_for_line(stream: Any, seconds: float) -> None:
    """Wait, or until a twist comes."""
    if stream is None:
        time.sleep(seconds)
    else:
        select.select([stream], [], [], seconds)


def main(base: str, arguments: str, ramp: str) -> int:
    """`python -m drake_starnav.runtime.watchdog MODULE:BASE ARGUMENTS RAMP`, the last two as JSON."""
    for each in (signal.SIGINT, signal.SIGTERM):
        signal.signal(each, signal.SIG_IGN)
    watch(import_named("base", base)(**json.loads(arguments)), Ramp(*json.loads(ramp)))
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
