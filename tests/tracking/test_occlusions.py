"""Something may come out from behind what was hit."""

import dataclasses
import math

import numpy as np
import pytest

from drake_starnav.tracking.occlusions import HIDDEN_SPACING, hidden_places
from drake_starnav.tracking.parameters import MoverParameters
from tests.helpers.loop import drive
from tests.helpers.scans import cast
from tests.helpers.scenes import Scene, hall

COLUMN = (1.0, 0.0, 0.3)


def test_places_lie_on_the_shadow_s_edges_and_no_beam_has_looked_there() -> None:
    scan = cast(hall(COLUMN))
    places = hidden_places(scan, np.zeros(3))
    away = np.hypot(*places.T)
    assert away.min() < 1.0 + HIDDEN_SPACING and away.max() > 3.5
    bearing = np.abs(np.arctan2(places[:, 1], places[:, 0]))
    edge = np.arcsin(COLUMN[2] / COLUMN[0])
    assert (np.abs(bearing - edge) < 2.0 * scan.angle_increment).all()


def test_places_go_with_the_robot() -> None:
    pose = np.array((-0.5, 0.2, 0.7))
    places = hidden_places(cast(hall(COLUMN), pose), pose)
    shadow = math.atan2(-0.2, 1.5)
    bearing = np.arctan2(places[:, 1] - 0.2, places[:, 0] + 0.5) - shadow
    np.testing.assert_allclose(np.abs(bearing), math.asin(0.3 / math.hypot(1.5, 0.2)), atol=0.035)


def test_an_empty_hall_hides_nothing() -> None:
    assert len(hidden_places(cast(hall()), np.zeros(3))) == 0


@pytest.mark.parametrize("speed", [0.5, 1.0, 1.5])
@pytest.mark.parametrize("lead", [0.3, 0.5, 0.7])
def test_one_that_comes_out_of_hiding_is_not_run_into(speed: float, lead: float) -> None:
    """It waits behind a partition, and comes round its end when the robot is so much before it."""
    wall = np.array([(0.0, 0.4), (0.12, 0.4), (0.12, 2.5), (0.0, 2.5)])
    comes = 3.0 - lead / 0.8

    def at(time: float) -> np.ndarray:
        return np.array(((0.4, 0.75 - speed * max(time - comes, 0.0)),))

    scene = Scene(dataclasses.replace(hall(), polygons=(wall,)), (0.25,), at)
    start = np.array((-0.4 - 0.8 * 2.6, 0.0, 0.0))
    movers = MoverParameters(max_speed=speed, caution=1.0)
    assert drive(scene, start, np.array((2.5, 0.0)), movers, duration=6.0).outcome != "collision"
