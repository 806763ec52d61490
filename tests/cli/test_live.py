"""A live run as its page drives it: through clicked buttons and moved sliders."""

import numpy as np
import pytest

from drake_starnav.cli.live import LiveRobots, LiveRun
from drake_starnav.cli.simulate import simulate
from drake_starnav.loading import parse_scenario

TEXT = "world: !Obstacles {bounds: [-1, -2, 5, 2], cylinders: [[1.5, 0.1, 0.3]], goal: [3.0, 0.0]}\n"
SCENARIO = parse_scenario(TEXT, name="post")


def click(run: LiveRun, button: str) -> None:
    name = button.encode()
    message = b"\x82\xa4type\xa6button\xa4name" + bytes([0xA0 + len(name)]) + name  # MessagePack of a small mapping
    run.meshcat._InjectWebsocketMessage(message=message)


def advance(run: LiveRun, seconds: float) -> None:
    end = run.time + seconds
    while run.time < end - 1e-6:
        assert run.step()


@pytest.fixture
def run() -> LiveRun:
    return LiveRun(SCENARIO, seed=3, real_time_rate=0.0)


def test_it_waits_for_start_and_pause_holds_it(run) -> None:
    assert run.step() and run.time == 0.0
    click(run, "start")
    advance(run, 0.5)
    click(run, "pause")
    now = run.time
    assert run.step() and run.step() and run.time == now
    click(run, "start")
    assert run.step() and run.time > now


def test_stop_ends_it_and_the_buttons_go(run) -> None:
    click(run, "start")
    advance(run, 0.2)
    click(run, "stop")
    assert not run.step()
    assert run.outcome.startswith("stopped after")
    run.finish()
    assert run.meshcat.GetButtonNames() == [] and run.meshcat.GetSliderNames() == []


def test_the_goal_moves_while_it_runs_and_after_arrival() -> None:
    run = LiveRun(SCENARIO, seed=3, real_time_rate=0.0)
    click(run, "start")
    while "reached" not in run.progress_text:
        assert run.step() and run.time < 15.0
    run.meshcat.SetSliderValue("goal x", 0.5)
    run.meshcat.SetSliderValue("goal y", -1.0)
    advance(run, 0.3)
    assert run.goal == pytest.approx([0.5, -1.0], abs=0.05)
    while "reached" not in run.progress_text:
        assert run.step() and run.time < 40.0
    assert np.hypot(*(run.pose[:2] - [0.5, -1.0])) < 0.35


def test_a_recording_of_it_may_be_kept(tmp_path) -> None:
    html = tmp_path / "live.html"
    run = LiveRun(SCENARIO, seed=3, real_time_rate=0.0, html=html)
    click(run, "start")
    advance(run, 0.5)
    click(run, "stop")
    run.run(quiet=True)
    run.finish()
    assert "stopped after 0.5 s" in html.read_text(encoding="utf-8")
    assert list(tmp_path.iterdir()) == [html]


def test_several_robots_drive_to_their_own_goals(tmp_path) -> None:
    text = """world: !Obstacles {bounds: [-1, -2, 3, 2]}
robots: [{start: [0, -1, 0], goal: [0.5, -1]}, {name: box, model: carrier, start: [0, 1, 0], goal: [0.8, 1]}]
"""
    scenario, html = parse_scenario(text, name="two"), tmp_path / "two.html"
    run = LiveRobots(scenario, real_time_rate=0.0, html=html)
    assert run.meshcat.GetSliderNames() == []
    click(run, "start")
    while run.progress_text != "2 of 2 have reached their goals":
        assert run.step() and run.time < 20.0
    for path in ("/starnav/trail/box", "/world/starbot_1_/starbot/base_link/rim", "/world/box_/carrier/base_link/rim"):
        assert run.meshcat.HasPath(path), path
    click(run, "stop")
    run.run(quiet=True)
    run.finish()
    page = html.read_text(encoding="utf-8")
    assert "stopped after" in page and "box: its goals" in page


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--meshcat", "--json", "x.json"], "--json with --meshcat"),
        (["--meshcat", "--real-time-rate", "-1"], "--real-time-rate is -1; allowed: 0 <= x <= 100"),
        (["--real-time-rate", "2"], "with --meshcat"),
    ],
)
def test_options_that_do_not_go_together(arguments, words, tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    assert simulate(["forest", *arguments]) == 2
    assert words in capsys.readouterr().err
