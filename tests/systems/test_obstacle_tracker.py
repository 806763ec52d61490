"""Scans go in, scans that know what moves and tracks come out."""

import dataclasses
import math

import numpy as np
import pytest

from drake_starnav.geometry.se2 import compose_poses
from drake_starnav.lidar.laser_scan import DYNAMIC
from drake_starnav.lidar.mounts import Mount, align_with_robot
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.moving.parameters import DynamicObstacleParameters
from drake_starnav.navigation import make_diagram
from drake_starnav.scenario.scenario_file import parse_scenario
from drake_starnav.systems.obstacle_tracker import ObstacleTracker
from tests.helpers.alone import Alone
from tests.helpers.scenes import PERIOD, Scene, hall, straight

OBSTACLES = DynamicObstacleParameters(max_speed=1.0)
SCENE = Scene(hall((2.0, 1.0, 0.3)), (0.25,), straight((1.5, -1.0), (0.0, 0.6)))


def test_a_scan_that_says_nothing_or_is_known_changes_nothing() -> None:
    alone = Alone(ObstacleTracker(OBSTACLES, LidarParameters(rate=1.0 / PERIOD)), pose=np.zeros(3))
    for k in range(5):
        alone.put("scan", SCENE.scan(k * PERIOD, np.zeros(3)))
        alone.simulator.AdvanceTo((k + 0.2) * PERIOD)
    before = alone.out("tracks")
    alone.simulator.AdvanceTo(5 * PERIOD)
    assert alone.out("tracks") is before
    scan = SCENE.scan(6 * PERIOD, np.zeros(3))
    lost = dataclasses.replace(scan, ranges=np.full_like(scan.ranges, np.nan), lost_beams=True)
    alone.put("scan", lost)
    alone.simulator.AdvanceTo(6.2 * PERIOD)
    assert alone.out("tracks") is before


def test_it_is_wired_only_where_obstacles_are_declared_to_move() -> None:
    def systems(text: str) -> dict[str, object]:
        diagram = make_diagram(parse_scenario(text, name="test"))
        return {system.get_name(): system for system in diagram.GetSystems()}

    plain, crowd = systems("world: !Room {}"), systems("world: !Room {}\nobstacles: {max_speed: 0.5}")
    assert "tracker" not in plain
    assert isinstance(crowd["tracker"], ObstacleTracker)
    for name in ("controller", "shield"):
        assert crowd[name].HasInputPort("tracks") and not plain[name].HasInputPort("tracks")


@pytest.mark.parametrize(
    "mount", [Mount(0.0, 0.0, 2.0, False), Mount(0.0, 0.0, 0.7, True), Mount(0.2, -0.1, -1.0, False)], ids=str
)
def test_what_moves_is_tracked_where_it_is_wherever_the_lidar_is_mounted(mount: Mount) -> None:
    """Turned, upside down or off the axis; and the scan comes out as it went in, but for what moves."""
    pose = np.array((-0.5, 0.3, 0.4))
    alone = Alone(ObstacleTracker(OBSTACLES, LidarParameters(rate=1.0 / PERIOD), (mount,)), pose=pose)
    for k in range(30):
        scan = SCENE.scan(k * PERIOD, compose_poses(pose, mount[:3]))
        if mount.upside_down:
            scan = align_with_robot(scan, Mount(0.0, 0.0, 0.0, True))
        alone.put("scan", scan)
        alone.simulator.AdvanceTo((k + 0.2) * PERIOD)
    tracks, out = map(alone.out, ("tracks", "scan"))
    assert tracks.is_confirmed.sum() == 1
    assert math.dist(tracks.position[tracks.is_confirmed][0], SCENE.at(29 * PERIOD)[0]) < 0.06
    np.testing.assert_array_equal(out.ranges, scan.ranges)
    assert out.angle_min == pytest.approx(scan.angle_min) and (out.motion == DYNAMIC).sum() > 5
    moving = (
        scan.points(compose_poses(pose, mount[:3]))[out.motion[scan.hits] == DYNAMIC] if not mount.upside_down else []
    )
    assert all(math.dist(point, SCENE.at(29 * PERIOD)[0]) < 0.3 for point in moving)
