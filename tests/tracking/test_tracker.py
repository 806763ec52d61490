"""From scan to scan: what is told of each beam."""

import numpy as np

from drake_starnav.geometry.se2 import composed
from drake_starnav.lidar.laser_scan import DYNAMIC
from drake_starnav.tracking.parameters import DynamicObstacleParameters
from drake_starnav.tracking.tracker import Tracked, track
from tests.helpers.scans import cast_rolling
from tests.helpers.scenes import PERIOD, Scene, hall, straight

OBSTACLES = DynamicObstacleParameters(max_speed=1.0)


def test_all_beams_of_a_track_that_counts_move() -> None:
    scene = Scene(hall((2.0, 1.5, 0.2)), (0.3,), straight((1.5, -1.0), (0.0, 0.5)))
    known = Tracked()
    for k in range(25):
        known = track(known, scene.scan(k * PERIOD, np.zeros(3)), np.zeros(3), OBSTACLES)
    scan = known.scan
    points = scan.points_at(scan.distances, np.ones(360, bool), np.zeros(3))
    own = np.hypot(*(points - scene.at(24 * PERIOD)[0]).T) < 0.3 + 1e-6
    assert own.any()
    np.testing.assert_array_equal(scan.motion == DYNAMIC, own)


def test_with_full_caution_what_stands_may_start_and_else_is_trusted_to_stay() -> None:
    scene = Scene(hall((1.0, 0.0, 0.3), half=2.0), (), lambda t: np.zeros((0, 2)))
    for caution in (1.0, 0.99, 0.0):
        obstacles, known = DynamicObstacleParameters(max_speed=1.0, caution=caution), Tracked()
        for k in range(60):
            known = track(known, scene.scan(k * PERIOD, np.zeros(3)), np.zeros(3), obstacles)
        standing, occlusions = known.tracks.standing, known.tracks.occlusions
        assert len(known.tracks.hits) == 0
        assert (
            (len(standing) > 10 and len(occlusions) > 10) if caution == 1.0 else (len(standing) == len(occlusions) == 0)
        )
        assert np.abs(np.hypot(standing[:, 0] - 1.0, standing[:, 1]) - 0.3).max(initial=0.0) < 1e-6


def test_what_was_known_before_is_not_changed() -> None:
    scene = Scene(hall(), (0.3,), straight((1.5, -1.0), (0.0, 0.5)))
    first = track(Tracked(), scene.scan(0.0, np.zeros(3)), np.zeros(3), OBSTACLES)
    position = first.tracks.position.copy()
    track(first, scene.scan(PERIOD, np.zeros(3)), np.zeros(3), OBSTACLES)
    np.testing.assert_array_equal(first.tracks.position, position)
    assert Tracked().scan.lost.all()


def test_nothing_moves_in_the_rolling_scans_of_a_lidar_that_turns() -> None:
    world, known, pose, period = hall((1.5, 1.2, 0.2), (-1.0, 2.0, 0.15)), Tracked(), np.zeros(3), 0.2
    for k in range(12):
        step = (0.04, 0.0, 0.15 if k % 6 < 3 else -0.15) if k else (0.0, 0.0, 0.0)  # to and fro
        before, pose = pose, np.array(composed(pose, step))
        scan = cast_rolling(world, before, pose, period, time=k * period, beams=180)
        known = track(known, scan, pose, OBSTACLES)
        assert known.scan.time_increment == 0.0 or k == 0
        assert not (known.scan.motion == DYNAMIC).any() and not known.tracks.confirmed.any()
