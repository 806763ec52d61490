"""How far something is: lines without a terminal, a bar on one."""

import time

from drake_starnav.utils.progress import Progress, silence_progress


def test_without_a_terminal_a_line_a_minute_comes(monkeypatch, capsys) -> None:
    now = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    with Progress("driving") as bar:
        for now[0] in range(100, 250):
            bar.show((now[0] - 100) / 150, f"{now[0] - 100} m")
    assert capsys.readouterr().err.splitlines() == ["driving: 61 m", "driving: 122 m"]


def test_a_terminal_shows_a_bar_at_once_and_removes_it(monkeypatch, capsys) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    with Progress("driving") as bar:
        assert "driving" in capsys.readouterr().err
        bar.count(1, 2)
        assert "00:00 so far, 1 of 2" in capsys.readouterr().err
        bar.say("a line")
        assert "a line\n" in capsys.readouterr().err
        bar.restart()
        bar.hide()
    assert capsys.readouterr().err.split("\r")[-2].strip() == ""


def test_silence_is_kept_and_ends(capsys) -> None:
    with silence_progress(True), silence_progress(False), Progress("driving") as bar:
        bar.say("a line")
    with Progress("driving") as bar:
        bar.say("another")
    assert capsys.readouterr().err == "another\n"
