"""The matcher between a robot whose odometry errs and its planner."""

import dataclasses

import numpy as np
import pytest

from drake_starnav.geometry.se2 import compose_poses, invert_pose, transform_points
from drake_starnav.localization.scan_matching import OdometryError
from drake_starnav.planning.guidance import Guidance
from drake_starnav.robot.motion import BrakingMotion
from drake_starnav.surroundings import Observation
from drake_starnav.surroundings.surroundings import Surroundings
from drake_starnav.systems.scan_matcher import ScanMatcher
from drake_starnav.worlds.world import World
from tests.helpers.alone import Alone
from tests.helpers.scans import RADIUS, cast, observe_scan, observed

RATE, DRIFT = 20.0, 0.1
ROOM = World("room", (0, 0, 0), (0, 0), cylinders=[(1.0, 1.2, 0.3), (-1.2, 0.9, 0.2)], bounds=(-3.0, -2.0, 3.0, 2.0))
PATH = np.array([(0.5, 0.2), (1.5, -0.4)])


class Matching(Alone):
    """A matcher."""

    def __init__(self) -> None:
        super().__init__(ScanMatcher(OdometryError(DRIFT, 0.0, 0.01)), guidance=Guidance.along(PATH))
        self.put("certificate", BrakingMotion(True, np.array([(1.0, 0.0, 0.5)])))
        self.put("observation", Observation.none())
        self.put("surroundings", Surroundings.unknown())
        self.believe(np.zeros(3))

    def believe(self, pose: np.ndarray) -> None:
        self.put("state", np.array((*pose, 0.8, -0.1)))
        self.put("scan_pose", pose)

    def see(self, pose: np.ndarray, believed: np.ndarray) -> None:
        """Stand at a true pose, believe another, scan, and let one period pass."""
        scan = dataclasses.replace(cast(ROOM, pose), time=self.context.get_time())
        self.put("observation", observed(scan, believed))
        self.put("surroundings", observe_scan(scan, believed, RADIUS, 1.0))
        self.believe(believed)
        self.advance(1.0 / RATE)


@pytest.fixture
def driven() -> tuple[Matching, np.ndarray, np.ndarray]:
    """A matcher after a metre of driving, with the true and the believed pose."""
    matching = Matching()
    for x in np.arange(0.0, 1.0, 0.04):
        pose, believed = np.array((x, -0.2, 0.0)), np.array((x * (1.0 + DRIFT), -0.2, 0.0))
        matching.see(pose, believed)
    return matching, pose, believed


def test_what_the_planner_sees_is_where_it_truly_is(driven) -> None:
    matching, pose, believed = driven
    assert believed[0] - pose[0] > 0.09
    for name in ("pose", "scan_pose", "state"):
        assert matching.out(name)[:3] == pytest.approx(pose, abs=0.01)
    assert np.array_equal(matching.out("state")[3:], (0.8, -0.1))
    star = matching.out("observation")
    assert star.pose == pytest.approx(pose, abs=0.01)
    assert np.array_equal(star.region.center, star.pose[:2])
    certified = matching.out("surroundings").certified_star
    np.testing.assert_allclose((*certified.center, certified.bearing_0), star.pose + (0.0, 0.0, star.scan.angle_min))
    away, hits = np.hypot(*(certified.boundary.points - star.pose[:2]).T), star.scan.distances[star.scan.hits]
    np.testing.assert_allclose(away, hits[hits < 1.0 + 2.0 * RADIUS])


def test_what_the_controller_is_told_lies_in_its_own_frame(driven) -> None:
    matching, _, believed = driven
    correction = compose_poses(matching.out("pose"), invert_pose(believed))
    matching.put("guidance", Guidance(PATH, False, Guidance.none().regions))
    guidance = matching.out("guidance")
    assert not guidance.arrives
    np.testing.assert_allclose(transform_points(correction, guidance.path), PATH, atol=1e-9)
    assert matching.out("certificate").certified
    np.testing.assert_allclose(
        matching.out("certificate").path[0], compose_poses(correction, (1.0, 0.0, 0.5)), atol=1e-9
    )


def test_a_scan_is_only_used_once(driven) -> None:
    matching, _, believed = driven
    before = matching.out("pose")
    matching.believe(believed)
    matching.advance(1.0)
    assert np.array_equal(matching.out("pose"), before)
