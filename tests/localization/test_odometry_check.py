"""How far a robot came by its scans, whatever its odometry says."""

import math
from dataclasses import replace

import numpy as np
import pytest

from drake_starnav.geometry.se2 import compose_poses
from drake_starnav.lidar.mounts import ON_AXIS, Mount
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.localization.odometry_check import KEPT_STEPS, OdometryCheck
from drake_starnav.localization.scan_matching import OdometryError
from drake_starnav.worlds.view import scan_from, visible_shapes
from drake_starnav.worlds.world import World

ROOM = World("room", (0.0, 0.0, 0.0), (3.0, 1.0), bounds=(-2.0, -2.0, 6.0, 3.0), cylinders=np.array([(1.6, -1.4, 0.3)]))
PERIOD = 0.1


def checked(share, turning=1.0, lidar=None, mount=ON_AXIS, world=ROOM, curve=0.6) -> OdometryCheck:
    """The check after a curve of 3 m through a room, by an odometry that counts a share of ways and of angles."""
    lidar = lidar or LidarParameters(rate=10.0)
    shapes, check, pose, counted = visible_shapes(world), OdometryCheck(), np.zeros(3), np.zeros(3)
    for k in range(60):
        true = compose_poses(pose, (mount.x, mount.y, mount.yaw))
        scan = replace(scan_from(shapes, true, lidar, 0, k), time=PERIOD * k)
        check = check.add_scan(scan, counted, OdometryError(0.0, 0.0, lidar.noise), mount)
        step = np.array((0.5, 0.0, curve * math.sin(0.1 * k))) * PERIOD
        pose, counted = compose_poses(pose, step), compose_poses(counted, step * (share, share, turning))
    return check


@pytest.mark.parametrize("share", [0.7, 0.92, 1.0, 1.3])
@pytest.mark.parametrize(
    ("noise", "mount"), [(0.01, ON_AXIS), (0.03, Mount(0.2, -0.1, 0.5, False)), (0.01, Mount(0.2, 0.0, math.pi, False))]
)
def test_the_way_that_scans_show(share, noise, mount) -> None:
    check = checked(share, lidar=LidarParameters(rate=10.0, noise=noise), mount=mount)
    found = check.sum_differences()
    assert len(check.steps) == KEPT_STEPS
    assert found.driven_way == pytest.approx(share * found.seen_way, rel=0.03)
    assert found.way_error == pytest.approx(abs(1.0 - share) * found.seen_way, abs=0.03 * found.seen_way)
    assert found.turn_error < 0.03


@pytest.mark.parametrize("turning", [0.7, 1.3])
def test_the_angle_that_scans_show(turning) -> None:
    found = checked(1.0, turning).sum_differences()
    assert found.driven_turn == pytest.approx(turning * found.seen_turn, rel=0.05)


def test_what_scans_do_not_show_is_believed() -> None:
    corridor = World("corridor", (0.0, 0.0, 0.0), (50.0, 0.0), bounds=(-100.0, -2.0, 100.0, 2.0))
    assert checked(0.7, world=corridor, curve=0.0).sum_differences().way_error < 0.1
