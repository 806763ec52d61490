"""How far something is: lines without a terminal, a bar on one, of any width."""

import os
import pty
import subprocess
import sys
import time

import pytest

from drake_starnav.utils import progress
from drake_starnav.utils.progress import Progress, silence


@pytest.fixture
def clock(monkeypatch):
    """A clock to be set."""
    now = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    monkeypatch.setattr(progress, "FIRST_LINE", 10.0)
    return now


def test_without_a_terminal_a_line_comes_now_and_then(clock, capsys) -> None:
    with Progress("driving") as bar:
        for clock[0] in range(100, 200):
            bar.show((clock[0] - 100) / 100, f"{clock[0] - 100} m")
    assert capsys.readouterr().err.splitlines() == [
        "driving: 10 m, 00:10 so far, about 01:30 left",
        "driving: 30 m, 00:30 so far, about 01:10 left",
        "driving: 70 m, 01:10 so far, about 00:30 left",
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
        assert "driving: 5 m" in shown and "00:04 so far, at most 00:04 left" in shown
    assert capsys.readouterr().err.split("\r")[-2].strip() == ""


def test_a_terminal_without_columns_shows_a_bar() -> None:
    code = "from drake_starnav.utils.progress import Progress\nwith Progress('driving') as bar: bar.count(1, 2)"
    terminal, end = pty.openpty()
    subprocess.run([sys.executable, "-c", code], stderr=end, check=True)
    shown = os.read(terminal, 10_000)
    os.close(terminal)
    os.close(end)
    assert b"driving: 1 of 2" in shown


def test_a_new_beginning_is_counted_from_there(clock, monkeypatch, capsys) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    with Progress("driving") as bar:
        clock[0] += 60.0
        bar.restart()
        clock[0] += 3.0
        bar.show(0.5)
        assert "00:03 so far, about 00:03 left" in capsys.readouterr().err


def test_silence_is_kept_and_ends(capsys) -> None:
    with silence(True), silence(False), Progress("driving") as bar:
        bar.say("a line")
    with Progress("driving") as bar:
        bar.say("another")
    assert capsys.readouterr().err == "another\n"
