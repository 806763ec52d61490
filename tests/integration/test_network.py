"""What listens, listens on loopback: whoever reaches a scheduler or a page can run code, or steer the robot."""

import os
import sys

import pytest

from drake_starnav.cli.live import LiveRun
from drake_starnav.scenario.scenario_file import parse_scenario
from drake_starnav.visualization.meshcat_stage import start_quiet_meshcat
from tests.helpers.sockets import LOOPBACK, listening

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="sockets are looked up in /proc")


def test_pages_of_meshcat_listen_on_loopback() -> None:
    recording = start_quiet_meshcat()
    live = LiveRun(parse_scenario("world: !Obstacles {goal: [1.5, 0.0]}", name="empty"))
    assert recording.port() != live.meshcat.port()
    assert listening(os.getpid()) and listening(os.getpid()) <= LOOPBACK
