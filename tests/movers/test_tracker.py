"""From scan to scan: what is told of each beam."""

import numpy as np

from drake_starnav.movers.parameters import MoverParameters
from drake_starnav.movers.tracker import Tracked, track
from drake_starnav.scan import MOVES
from tests.movers.scenes import PERIOD, Scene, hall, straight

MOVERS = MoverParameters(max_speed=1.0)


def test_all_beams_of_a_track_that_counts_move() -> None:
    scene = Scene(hall((2.0, 1.5, 0.2)), (0.3,), straight((1.5, -1.0), (0.0, 0.5)))
    known = Tracked()
    for k in range(25):
        known = track(known, scene.scan(k * PERIOD, np.zeros(3)), np.zeros(3), MOVERS)
    scan = known.scan
    points = scan.points_at(scan.distances, np.ones(360, bool), np.zeros(3))
    own = np.hypot(*(points - scene.at(24 * PERIOD)[0]).T) < 0.3 + 1e-6
    assert own.any()
    np.testing.assert_array_equal(scan.motion == MOVES, own)


def test_what_was_known_before_is_not_changed() -> None:
    scene = Scene(hall(), (0.3,), straight((1.5, -1.0), (0.0, 0.5)))
    first = track(Tracked(), scene.scan(0.0, np.zeros(3)), np.zeros(3), MOVERS)
    position = first.tracks.position.copy()
    track(first, scene.scan(PERIOD, np.zeros(3)), np.zeros(3), MOVERS)
    np.testing.assert_array_equal(first.tracks.position, position)
    assert Tracked().scan.lost.all()
