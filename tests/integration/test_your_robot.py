"""The page about users' robots does what it says, and published robots drive."""

import math
import re
import shlex
from pathlib import Path

import pytest

from drake_starnav.cli.main import main
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.schema import Scenario
from drake_starnav.station.navigation_station import NavigationStation
from drake_starnav.worlds.world import World
from tests.helpers.robots import driven

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "your_robot.md").read_text(encoding="utf-8")


def block(language: str) -> str:
    (text,) = re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)
    return text


COMMANDS = re.findall(r"^starnav (simulate .*)$", PAGE, re.MULTILINE)


@pytest.mark.slow
@pytest.mark.parametrize("number", [0, 1])
def test_the_robot_of_the_page_reaches_its_goal(tmp_path: Path, monkeypatch, number: int) -> None:
    assert len(COMMANDS) == 2
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cart.urdf").write_text(block("xml"), encoding="utf-8")
    if number == 1:
        (tmp_path / "cart.yaml").write_text(block("yaml"), encoding="utf-8")
    assert main(shlex.split(COMMANDS[number])) == 0


def test_the_robot_of_the_page_drives_as_it_is_told(tmp_path: Path) -> None:
    path = tmp_path / "cart.urdf"
    path.write_text(block("xml"), encoding="utf-8")
    scenario = Scenario("test", None, RobotParameters(model=str(path), radius=2.0), LidarParameters(frame="base_link"))
    x, y, _, v, omega = driven(NavigationStation(World("open", (0.0, 0.0, 0.0), (5.0, 0.0)), scenario), 0.0, 1.5)
    assert math.hypot(x, y) < 0.01 and (v, omega) == pytest.approx((0.0, 1.5), abs=0.03)
