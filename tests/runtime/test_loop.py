"""However a drive ends, the base has been ramped to zero."""

import math
import os
import signal
import threading
from dataclasses import replace

import numpy as np
import pytest

from drake_starnav import load_scenario
from drake_starnav.runtime import Driven, Navigator, drive, loop
from drake_starnav.runtime.intake import WITHDRAWN
from tests.helpers.bare_robot import BareRobot

FOREST = load_scenario("forest")
STEP = FOREST.robot.max_acceleration / FOREST.controller.rate


class Clock:
    """A clock that only sleep advances: whatever the machine does beside, a drive takes the same time."""

    now = 0.0

    def monotonic(self) -> float:
        return self.now

    perf_counter = monotonic

    def sleep(self, seconds: float) -> None:
        self.now += seconds


@pytest.fixture(autouse=True)
def clock(monkeypatch) -> Clock:
    monkeypatch.setattr(loop, "time", Clock())
    return loop.time


@pytest.fixture(scope="module")
def navigator() -> Navigator:
    return Navigator(FOREST, warm=False)


class Base(BareRobot):
    """Keeps what it was told; `at` is called with the number of each reading."""

    def __init__(self, at=lambda tick: None) -> None:
        super().__init__(FOREST)
        self.at, self.told, self.closed, self.readings = at, [], False, 0

    def read(self):
        self.readings += 1
        self.at(self.readings)
        return super().read()

    def drive(self, command) -> None:
        self.told.append(command.twist.copy())
        super().drive(command)

    def close(self) -> None:
        self.closed = True


def ramped(base: Base) -> None:
    """It was ramped to zero, told so, and closed."""
    speeds = np.array(base.told)[:, 0]
    assert speeds.max() > 0.4 and base.closed
    assert (np.abs(np.array(base.told[-5:])) == 0.0).all()
    assert np.abs(np.diff(speeds)).max() <= STEP + 1e-9


def test_it_ends_after_its_time(navigator) -> None:
    base = Base()
    driven = drive(navigator, base, seconds=1.0)
    ramped(base)
    assert driven.end == "over" and driven.late == 0 and abs(driven.ticks - FOREST.controller.rate) <= 1
    assert "0 periods late" in str(driven)


@pytest.mark.parametrize("sent", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_it(navigator, sent) -> None:
    before = signal.getsignal(sent)
    base = Base(lambda tick: os.kill(os.getpid(), sent) if tick == 45 else None)
    assert drive(navigator, base, seconds=20.0).end == "stopped"
    ramped(base)
    assert signal.getsignal(sent) is before


def test_an_exception_ends_it(navigator) -> None:
    def fail(tick):
        if tick == 45:
            raise OSError("the lidar was unplugged")

    base = Base(fail)
    with pytest.raises(OSError, match="unplugged"):
        drive(navigator, base, seconds=20.0)
    ramped(base)


def test_a_base_that_cannot_be_told_is_tried_again(navigator) -> None:
    class Loose(Base):
        def drive(self, command) -> None:
            super().drive(command)
            if len(self.told) == 46:
                raise OSError("cable")

    base = Loose()
    with pytest.raises(OSError, match="cable"):
        drive(navigator, base, seconds=20.0)
    ramped(base)


def test_late_commands_are_counted_and_do_not_delay_others(navigator, clock) -> None:
    held = 4.5 / FOREST.controller.rate
    base = Base(lambda tick: clock.sleep(held) if tick == 20 else None)
    driven = drive(navigator, base, seconds=1.0)
    assert driven.late == 3 and driven.step[2] == pytest.approx(held)
    assert abs(driven.ticks + driven.late - FOREST.controller.rate) <= 1
    assert base.closed


def test_commands_that_follow_their_scans_later_than_declared_are_said(navigator, capsys) -> None:
    class Slow(Base):
        def read(self):
            reading = super().read()
            return reading._replace(scans=[replace(scan, time=scan.time - 0.06) for scan in reading.scans])

    assert navigator.scenario.lidar.delay == navigator.scenario.drive.delay == 0.0
    said = "ms from scan to command; lidar.delay, drive.delay and a period allow 25 ms"
    assert said not in str(Driven("over", 30, 0, (0.0, 0.0, 0.0), {}, answer=0.025, declared=0.025))
    driven = drive(navigator, Slow(), seconds=0.6, quiet=False)
    assert driven.answer == pytest.approx(0.06, abs=1e-3)
    assert f"warning: {1e3 * driven.answer:.0f} {said}" in str(driven)
    assert said in capsys.readouterr().err


def test_what_waited_before_the_drive_is_not_driven_by(navigator) -> None:
    class Waiting(Base):
        scanned = 0

        def read(self):
            reading, self.scanned = super().read(), self.scanned + 1
            late = 5.0 if self.scanned == 1 else 0.0
            return reading._replace(scans=[replace(scan, time=scan.time - late) for scan in reading.scans])

    assert drive(navigator, Waiting(), seconds=0.6).answer < 4.0


@pytest.mark.parametrize("is_read", [True, False])
def test_it_ends_at_the_goal_that_is_read_or_else_given_on_request(navigator, is_read) -> None:
    class Aiming(Base):
        def read(self):
            return super().read()._replace(goal=aim if is_read else None)

    base = Aiming()
    aim = base.pose[0] + 0.7, base.pose[1]
    given = (0.0, 0.0) if is_read else aim
    assert drive(navigator, base, goal=given, seconds=20.0, until_reached=True).end == "reached"
    assert base.stands and math.dist(base.pose[:2], aim) < FOREST.simulation.goal_tolerance


def test_a_goal_that_is_withdrawn_stops_it_whatever_was_given(navigator) -> None:
    class Withdrawing(Base):
        said, fastest = "", 0.0

        def read(self):
            return super().read()._replace(goal=None if self.time < 1.0 else WITHDRAWN)

        def drive(self, command) -> None:
            super().drive(command)
            self.fastest = max(self.fastest, self.speed)
            if self.stands and self.time > 1.0 and not self.said:
                self.said = command.why
                os.kill(os.getpid(), signal.SIGTERM)

    base = Withdrawing()
    assert drive(navigator, base, goal=base.world.goal, seconds=60.0).end == "stopped"
    assert base.stands and base.fastest > 0.5 and base.said == "the goal is withdrawn"


def test_another_thread_may_drive(navigator) -> None:
    base, results = Base(), []
    thread = threading.Thread(target=lambda: results.append(drive(navigator, base, seconds=0.8)))
    thread.start()
    thread.join(20.0)
    assert results and base.closed
