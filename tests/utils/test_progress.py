"""How far something is: lines without a terminal, a bar on one, and only the newest task of several."""

import os
import pty
import subprocess
import sys
import time

import pytest

from drake_starnav.utils import progress
from drake_starnav.utils.progress import Progress, duration_text, silence


@pytest.fixture
def clock(monkeypatch):
    """A clock to be set; the bar is only drawn when something is reported."""
    now = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    monkeypatch.setattr(progress, "REFRESH", 3600.0)
    monkeypatch.setattr(progress, "FIRST_LINE", 10.0)
    return now


def test_without_a_terminal_a_line_comes_now_and_then(clock, capsys) -> None:
    with Progress("driving") as bar:
        for clock[0] in range(100, 200):
            bar.show((clock[0] - 100) / 100, f"{clock[0] - 100} m")
    assert capsys.readouterr().err.splitlines() == [
        "driving: 10 m, 10 s so far, about 1.5 min left",
        "driving: 30 m, 30 s so far, about 70 s left",
        "driving: 70 m, 70 s so far, about 30 s left",
    ]


def test_a_short_task_says_nothing(capsys) -> None:
    with Progress("driving") as bar:
        bar.count(1, 2)
    assert capsys.readouterr().err == ""


def test_a_terminal_shows_a_bar_at_once_and_removes_it(clock, monkeypatch, capsys) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    with Progress("driving") as bar:
        assert "driving" in capsys.readouterr().err
        clock[0] += 4.0
        bar.show(0.5, "5 m", at_most=True)
        shown = capsys.readouterr().err
        assert "driving: 5 m" in shown and "4 s so far, at most 4 s left" in shown
    assert capsys.readouterr().err.split("\r")[-2].strip() == ""


def test_a_terminal_without_columns_shows_a_bar() -> None:
    code = "from drake_starnav.utils.progress import Progress\nwith Progress('driving') as bar: bar.count(1, 2)"
    terminal, end = pty.openpty()
    subprocess.run([sys.executable, "-c", code], stderr=end, check=True)
    shown = os.read(terminal, 10_000)
    os.close(terminal)
    os.close(end)
    assert b"driving: 1 of 2" in shown


def test_equal_parts_take_equal_times(clock, monkeypatch, capsys) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    with Progress("pictures") as bar:
        clock[0] += 3.0
        bar.count(1, 5)
        shown = capsys.readouterr().err
        assert "1 of 5" in shown and "about 12 s left" in shown
        clock[0] += 3.0  # the second takes longer, and so may the others
        bar.count(1, 5)
        assert "about 24 s left" in capsys.readouterr().err


def test_of_several_tasks_the_newest_is_shown(clock, capsys) -> None:
    with Progress("driving") as outer:
        with Progress("compiling") as inner:
            clock[0] += 20.0
            outer.show(0.1)
            inner.show(0.2)
        outer.show(0.3)
    assert [line.partition(":")[0] for line in capsys.readouterr().err.splitlines()] == ["compiling", "driving"]


def test_the_time_of_a_task_on_the_way_is_not_counted(clock, monkeypatch, capsys) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    with Progress("driving") as outer:
        clock[0] += 2.0
        with Progress("compiling"):
            clock[0] += 60.0
        capsys.readouterr()
        outer.show(0.5)
        assert "2 s so far, about 2 s left" in capsys.readouterr().err
        outer.restart()
        clock[0] += 3.0
        outer.show(0.5)
        assert "3 s so far, about 3 s left" in capsys.readouterr().err
        with Progress("compiling"):
            clock[0] += 60.0
            outer.restart()
            clock[0] += 5.0
        outer.show(0.5)
        assert "0 s so far" in capsys.readouterr().err


def test_silence_is_kept_and_ends(capsys) -> None:
    with silence(True), silence(False), Progress("driving") as bar:
        bar.say("a line")
    with Progress("driving") as bar:
        bar.say("another")
    assert capsys.readouterr().err == "another\n"


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.2, "0 s"), (89.0, "89 s"), (91.0, "1.5 min"), (1800.0, "30 min"), (5500.0, "1.5 h"), (40_000.0, "11 h")],
)
def test_times_have_two_digits_and_their_unit(seconds: float, text: str) -> None:
    assert duration_text(seconds) == text
