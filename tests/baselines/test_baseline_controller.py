"""The baselines through a context: the same outputs as the star controller's, from what each may know."""

import numpy as np
import pytest
from pydrake.common.value import Value

from drake_starnav.baselines.baseline_controller import BaselineController, foa
from drake_starnav.baselines.baseline_step import Baseline
from drake_starnav.baselines.dsm_circles import DsmBaseline
from drake_starnav.baselines.foa import FoaBaseline
from drake_starnav.control import ControllerParameters
from drake_starnav.errors import StarnavError
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.systems.twist_shield import Unshielded
from drake_starnav.utils.stopwatch import Stopwatch
from drake_starnav.worlds import World
from tests.baselines.test_baseline_step import EVERY, SETTINGS
from tests.helpers.controlling import Controlling

ROBOT, CONTROLLER = RobotParameters(), ControllerParameters()
SCANNING = pytest.mark.parametrize("settings", list(SETTINGS.values())[1:], ids=list(SETTINGS)[1:])


def scan(*, wall_at: float = np.inf) -> LaserScan:
    """A scan of 360 beams; a wall crosses the x axis of S at a distance, m."""
    bearings = np.linspace(-np.pi, np.pi, 360, endpoint=False)
    with np.errstate(divide="ignore"):
        ranges = np.where(np.cos(bearings) > 0.05, wall_at / np.cos(bearings), np.inf)
    return LaserScan(0.0, -np.pi, 2.0 * np.pi / 360, 0.02, 5.0, np.where(ranges < 5.0, ranges, np.inf))


def controlling_of(baseline: Baseline, *, stopwatch: Stopwatch | None = None, **inputs: object) -> Controlling:
    """Those inputs that are not given, or None, are left unconnected."""
    defaults = {"goal": [3.0, 0.0], "state": np.zeros(5), "scan": Value(scan()), "scan_pose": np.zeros(3)}
    given = {name: value for name, value in {**defaults, **inputs}.items() if value is not None}
    controller = BaselineController(ROBOT, baseline, stopwatch=stopwatch)
    return Controlling(controller, Unshielded(ROBOT, CONTROLLER, stopwatch=stopwatch), given)


def with_discs(discs: list[tuple[float, float, float]]) -> Value:
    return Value(World("discs", (0.0, 0.0, 0.0), (3.0, 0.0), np.array(discs).reshape(-1, 3)))


@EVERY
def test_drives_to_the_goal_and_says_where(settings) -> None:
    controlling = controlling_of(settings, world=with_discs([]))
    assert np.array_equal(controlling.out("twist_command"), np.zeros(2))
    v, omega = controlling.update(100)
    assert 0.3 < v <= ROBOT.max_speed + 1e-12
    assert omega == pytest.approx(0.0, abs=1e-6)
    assert controlling.out("guiding_vector") == pytest.approx([1.0, 0.0], abs=1e-6)


def test_turns_to_the_short_term_goal_if_it_follows_the_roadmap() -> None:
    controlling = controlling_of(FoaBaseline(follows_roadmap=True), short_term_goal=[0.0, 3.0])
    assert controlling.update(20)[1] > 0.5


@SCANNING
def test_a_scan_counts_where_it_was_taken(settings) -> None:
    """A wall ahead in S, but S was turned around when it was seen: the way is free."""
    blocked = controlling_of(settings, goal=[3.0, 0.3], scan=Value(scan(wall_at=0.36)))
    free = controlling_of(settings, goal=[3.0, 0.3], scan=Value(scan(wall_at=0.36)), scan_pose=[0.0, 0.0, np.pi])
    assert free.update(60)[0] > blocked.update(60)[0] + 0.1


def test_dsm_knows_its_obstacles_and_needs_no_scan() -> None:
    free = controlling_of(DsmBaseline(), world=with_discs([]))
    ahead = controlling_of(DsmBaseline(), world=with_discs([(0.6, 0.02, 0.3)]))
    assert free.update(60)[0] > 0.3
    assert abs(ahead.update(20)[1]) > 0.5


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["robot.model=omnibot"], "method foa with robot.base omnidirectional; allowed: star, or a differential drive"),
        (["goals=[[1, 0, 0.5]]"], "has a yaw with method foa, which follows no turns on the spot"),
    ],
)
def test_what_no_baseline_can_do_is_refused(overrides: list[str], words: str) -> None:
    with pytest.raises(StarnavError, match=words):
        foa(load_scenario("forest", method="foa", overrides=overrides))
