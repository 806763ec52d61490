"""The log of a drive becomes a recording as of a simulated run."""

import math

import numpy as np
import pytest

from drake_starnav import StarnavError, World, parse_scenario
from drake_starnav.cli.record import record
from drake_starnav.simulation.log_recording import record_log
from tests.runtime.test_log import logged

pytest.importorskip("mcap")
PLAIN = parse_scenario("{}", name="plain")
POSTS = World("posts", (1.0, 2.0, 0.5), (5.0, 4.0), cylinders=np.array([(2.5, 3.3, 0.25), (3.5, 2.4, 0.3)]))


@pytest.mark.parametrize(
    "robot", ["{}", "robot: {base: omnidirectional, model: omnibot}", "localization: {drift: 0.01}"]
)
def test_the_robot_is_where_it_was(tmp_path, robot) -> None:
    driven = logged(tmp_path / "run.mcap", parse_scenario(robot, name="logged"), seconds=4.0, world=POSTS)
    recorded = record_log(tmp_path / "run.mcap", tmp_path / "run.html")
    motion = recorded.motions[0]
    assert math.dist(motion.poses[0, :2], POSTS.start[:2]) < 0.05
    assert math.dist(motion.poses[-1, :2], driven.pose[:2]) < 0.15
    assert recorded.duration == pytest.approx(4.0, abs=0.1)
    text = (tmp_path / "run.html").read_text(encoding="utf-8")
    assert "log run.mcap" in text and "driving after" in text


def test_the_command_records_it_with_a_still(tmp_path) -> None:
    pytest.importorskip("matplotlib")
    logged(tmp_path / "run.mcap", PLAIN, seconds=2.0)
    html = tmp_path / "a.html"
    assert record(["--log", str(tmp_path / "run.mcap"), "--html", str(html), "--png", "1", "--quiet"]) == 0
    assert html.stat().st_size > 1e5 and (tmp_path / "a-1s.png").stat().st_size > 1e4


@pytest.mark.parametrize("arguments", [[], ["forest", "--log", "run.mcap"]])
def test_either_a_run_or_a_log(arguments, capsys) -> None:
    assert record(arguments) == 2
    assert "one of them" in capsys.readouterr().err


def test_a_log_without_a_pose(tmp_path) -> None:
    logged(tmp_path / "run.mcap", PLAIN, seconds=0.0)
    with pytest.raises(StarnavError, match="no pose of the robot"):
        record_log(tmp_path / "run.mcap", tmp_path / "run.html")
