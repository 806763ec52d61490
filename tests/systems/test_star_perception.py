"""A scan goes in, the planner's region and the controller's certified star come out."""

import dataclasses
from contextlib import nullcontext

import numpy as np
import pytest

from drake_starnav.control import ControllerParameters
from drake_starnav.errors import StarnavError
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.planning import PlannerParameters
from drake_starnav.robot import RobotParameters
from drake_starnav.surroundings.margins import SCAN_PATIENCE, Margins
from drake_starnav.surroundings.observation import Observation
from drake_starnav.systems.star_perception import StarPerception
from drake_starnav.worlds.world import World
from tests.helpers.alone import Alone
from tests.helpers.mounts import CORNERS, looks
from tests.helpers.scans import MARGINS, cast

ROBOT, PLANNER, CONTROLLER = RobotParameters(), PlannerParameters(), ControllerParameters()
RATE = 20.0
LIDAR = LidarParameters(rate=RATE)
WALLS = (-3.0, -3.0, 3.0, 3.0)
POST = World("post", (0, 0, 0), (0, 0), cylinders=[(0.9, 0.0, 0.2)], bounds=WALLS)
EMPTY = World("empty", (0, 0, 0), (0, 0), bounds=WALLS)
POSE = np.array([0.1, -0.2, 0.4])


class Perceived(Alone):
    """A perception."""

    def __init__(self, margins: Margins = MARGINS, certifies: bool = True) -> None:
        super().__init__(StarPerception(ROBOT, margins, LIDAR, certifies=certifies))

    def see(self, world: World, pose: np.ndarray = POSE) -> LaserScan:
        """Put a scan of the world before the next update."""
        self.world, self.shown = world, pose
        scan = self._show()
        self.put("pose", pose)
        return scan

    def _show(self) -> LaserScan:
        scan = dataclasses.replace(cast(self.world, self.shown), time=self.context.get_time())
        self.put("scan", scan)
        return scan

    def update(self, silent: bool = False) -> None:
        """Let one period pass, with another scan like the last one at its beginning."""
        if not silent:
            self._show()
        self.advance(1.0 / RATE)


def test_the_certificate_takes_smoothed_ranges_only_if_told_to() -> None:
    for beams in (0, 1):
        perceived = Perceived(margins=dataclasses.replace(MARGINS, smoothed_beams=beams))
        points = perceived.see(POST).points(POSE)
        perceived.update()
        off = [np.hypot(*(points - hit).T).min() for hit in perceived.out("surroundings").recent_hits.hits.points]
        assert len(off) > 20 and (max(off) > 1e-3) == bool(beams) and max(off) < 0.03


def test_a_scan_is_seen_at_once_whenever_it_comes() -> None:
    perceived = Perceived()
    perceived.see(POST)
    perceived.simulator.AdvanceTo(0.3 / RATE)
    first = perceived.out("observation")
    assert first.scan.time == 0.0
    perceived.see(EMPTY)
    second = perceived.out("observation")
    assert second.scan.time == 0.3 / RATE
    perceived.simulator.AdvanceTo(2.5 / RATE)
    assert perceived.out("observation") is second


def test_a_silent_sensor_certifies_nothing_until_a_scan_comes() -> None:
    perceived = Perceived()
    perceived.see(EMPTY)
    perceived.update()
    for _ in range(round(SCAN_PATIENCE) - 1):
        assert perceived.out("surroundings").certified_star.values.max() > 0.5
        perceived.update(silent=True)
    perceived.update(silent=True)
    assert not perceived.out("surroundings").certified_star.values.any() and not perceived.out("surroundings").has_views
    assert perceived.out("observation").region is not None  # the planner keeps what it knows
    perceived.update()
    assert perceived.out("surroundings").certified_star.values.max() > 0.5


def test_a_scan_without_a_valid_beam_is_none() -> None:
    perceived = Perceived()
    scan = perceived.see(EMPTY)
    lost = dataclasses.replace(scan, ranges=np.full(len(scan.ranges), np.nan), lost_beams=True)
    perceived.put("scan", lost)
    perceived.update(silent=True)
    assert not perceived.out("surroundings").certified_star.values.any()
    assert perceived.out("observation").region is None  # a planner that sees nothing waits
    perceived.update()
    assert perceived.out("surroundings").certified_star.values.any()


@pytest.mark.parametrize(
    "view, words",
    [
        ({"beams": 20}, "lidar.beams is 20, one every 18 degrees"),
        ({"beams": 90, "angle_min": -0.8, "angle_increment": 0.018}, "views that reach 90 degrees to each side"),
    ],
)
def test_with_the_certificate_a_lidar_that_sees_too_little_is_refused(view: dict, words: str) -> None:
    scan = dataclasses.replace(cast(POST, POSE, **view), time=0.001)
    for certifies in (True, False):
        perceived = Perceived(certifies=certifies)
        perceived.put("pose", POSE)
        perceived.put("scan", scan)
        with pytest.raises(StarnavError, match=words) if certifies else nullcontext():
            perceived.update(silent=True)
    assert perceived.out("observation").region is not None


def test_scans_of_several_lidars_count_once_each_has_one_and_while_none_is_old() -> None:
    mounts = [lidar.mount for lidar in CORNERS]
    alone, scans = Alone(StarPerception(ROBOT, MARGINS, LIDAR, mounts=mounts), pose=POSE), looks(POST, CORNERS, POSE)

    def show(*times: float) -> Observation:
        alone.context.SetTime(max(times))
        for name, scan, time in zip(("scan", "scan_2"), scans, times, strict=True):
            alone.put(name, dataclasses.replace(scan, time=time, scan_time=1.0 / RATE))
        return alone.out("observation")

    assert show(0.05, 0.0).region is None, "where the second one was taken is not known"
    seen = show(0.05, 0.05)
    assert seen.region is not None and seen.scan.full_circle and seen.scan.time == 0.05
    assert np.array_equal(seen.pose, POSE)
    hits = alone.out("surroundings").certified_star.boundary.points
    away = np.abs(np.hypot(*(hits - (0.9, 0.0)).T) - 0.2)
    assert len(hits) > 30 and np.sort(away)[:20].max() < 1e-6
    last = 0.05 + SCAN_PATIENCE / RATE
    assert show(0.07, 0.05).scan.time == 0.07 and show(last, 0.05).scan.time == last
    assert show(last + 0.05, 0.05).scan.time == last, "the second one is silent"
    assert show(last + 0.05, last + 0.1).scan.time == last + 0.1
    assert alone.system._perception.dropped(alone.context) == 0
