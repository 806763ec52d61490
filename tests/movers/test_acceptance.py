"""Both certificates: what one of them refuses is refused."""

import numpy as np
import pytest

from drake_starnav.control import ControllerParameters
from drake_starnav.control.braking import limits_array
from drake_starnav.movers.acceptance import accepted, standards
from drake_starnav.movers.parameters import MoverParameters
from drake_starnav.robot import RobotParameters
from drake_starnav.stars.free_range import smoothed_distances
from drake_starnav.stars.parameters import StarParameters
from drake_starnav.stars.safety import SafetyStar, ScanMemory, safety_star
from tests.movers.scenes import hall
from tests.scans import cast

ROBOT = RobotParameters()
LIMITS = limits_array(ROBOT)
MOVERS = MoverParameters(max_speed=0.8)
NOTHING, AHEAD = np.zeros((0, 6)), np.array([(0.7, 0.0, 0.0, 0.0, 0.8, 0.0)])


def accepts(star: SafetyStar, want: tuple[float, float], rows: np.ndarray = NOTHING, v: float = 0.0, **changes) -> bool:
    standard = standards(star, ControllerParameters(**changes), ROBOT, MOVERS)
    return accepted(0.0, 0.0, 0.0, v, 0.0, *want, LIMITS, standard, rows, 0.0)


def seen(wall: float) -> SafetyStar:
    """What is certified in a hall whose column's face is `wall` (m) ahead."""
    scan, pose, stars = cast(hall((wall + 0.2, 0.0, 0.2))), np.zeros(3), StarParameters()
    memory = ScanMemory().remembered(scan, pose, 2.0, 1)
    return safety_star(memory, scan, smoothed_distances(scan, stars), pose, ROBOT.radius + 0.01, 1.2, stars)


@pytest.mark.parametrize("by", ["star", "points"])
def test_either_certificate_may_refuse(by: str) -> None:
    assert accepts(seen(2.0), (0.8, 0.0), v=0.7, certified_by=by)
    assert not accepts(seen(0.5), (0.8, 0.0), v=0.7, certified_by=by)  # what stays
    assert not accepts(seen(2.0), (0.8, 0.0), AHEAD, v=0.7, certified_by=by)  # what moves
    assert accepts(seen(2.0), (-0.3, 0.0), AHEAD, certified_by=by)


def test_without_a_scan_nothing_is_accepted_and_without_a_certificate_everything_that_stays() -> None:
    assert not accepts(SafetyStar.none(), (0.5, 0.0))
    assert accepts(SafetyStar.none(), (0.5, 0.0), certificate=False)
    assert not accepts(SafetyStar.none(), (0.8, 0.0), AHEAD, v=0.7, certificate=False)


def test_outside_of_the_star_only_the_way_away_from_the_wall_is_accepted() -> None:
    close = seen(ROBOT.radius + 0.005)
    assert not accepts(close, (0.3, 0.0))
    assert accepts(close, (-0.3, 0.0))
