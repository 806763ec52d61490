"""Predicted places of discs, straight and off a wall, and places from which something may come out of hiding."""

import dataclasses
import math

import numpy as np
import pytest

from drake_starnav.moving.parameters import DynamicObstacleParameters
from drake_starnav.moving.prediction import (
    OCCLUSION_SPACING,
    PREDICTION_STEP,
    find_occlusion_points,
    predict_trajectories,
)
from tests.helpers.loop import drive
from tests.helpers.scans import cast
from tests.helpers.scenes import Scene, hall

NOTHING = np.zeros((0, 2))
WALL = np.column_stack((np.full(200, 2.0), np.linspace(-5.0, 5.0, 200)))


def one(velocity: tuple[float, float], *, walls: np.ndarray = NOTHING) -> np.ndarray:
    return predict_trajectories(np.zeros((1, 2)), np.array([velocity]), np.array([0.3]), walls)[0]


def test_it_lasts_as_long_as_asked_and_begins_now() -> None:
    trajectory = one((0.5, 0.0))
    assert (len(trajectory) - 1) * PREDICTION_STEP >= 3.0
    np.testing.assert_array_equal(trajectory[0], (0.0, 0.0))


def test_it_comes_back_from_a_wall() -> None:
    trajectory = one((0.8, 0.2), walls=WALL)
    assert trajectory[:, 0].max() <= 2.0 - 0.3 + 0.8 * PREDICTION_STEP
    assert trajectory[-1, 0] < trajectory[:, 0].max() - 0.3
    np.testing.assert_allclose(np.diff(trajectory[:, 1]), 0.2 * PREDICTION_STEP, atol=0.015)


COLUMN = (1.0, 0.0, 0.3)


def test_places_lie_on_the_shadow_s_edges_and_no_beam_has_looked_there() -> None:
    scan = cast(hall(COLUMN))
    places = find_occlusion_points(scan, np.zeros(3))
    away = np.hypot(*places.T)
    assert away.min() < 1.0 + OCCLUSION_SPACING and away.max() > 3.5
    bearing = np.abs(np.arctan2(places[:, 1], places[:, 0]))
    edge = np.arcsin(COLUMN[2] / COLUMN[0])
    assert (np.abs(bearing - edge) < 2.0 * scan.angle_increment).all()


def test_places_go_with_the_robot() -> None:
    pose = np.array((-0.5, 0.2, 0.7))
    places = find_occlusion_points(cast(hall(COLUMN), pose), pose)
    shadow = math.atan2(-0.2, 1.5)
    bearing = np.arctan2(places[:, 1] - 0.2, places[:, 0] + 0.5) - shadow
    np.testing.assert_allclose(np.abs(bearing), math.asin(0.3 / math.hypot(1.5, 0.2)), atol=0.035)


def test_an_empty_hall_hides_nothing() -> None:
    assert len(find_occlusion_points(cast(hall()), np.zeros(3))) == 0


@pytest.mark.parametrize("speed", [0.8, 1.2, 1.5])
@pytest.mark.parametrize("lead", [0.4, 0.6, 0.7, 0.8, 0.95])
def test_one_that_comes_out_of_hiding_is_not_run_into(speed: float, lead: float) -> None:
    """It waits behind a partition, and comes round its end for the robot that is so much before it, m."""
    wall = np.array([(0.0, 0.3), (0.12, 0.3), (0.12, 2.5), (0.0, 2.5)])
    way = np.array([(0.45, 0.9), (0.38, 0.3), (0.3, 0.12), (0.12, 0.05), (-2.0, 0.0)])
    along = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(way, axis=0).T))))
    far, comes = 2.4, 1.0 / 0.8 + (2.4 - lead) / 0.8  # as it takes 1 s to be at 0.8 m/s, at most

    def at(time: float) -> np.ndarray:
        s = speed * max(time - comes, 0.0)
        return np.array(((np.interp(s, along, way[:, 0]), np.interp(s, along, way[:, 1])),))

    scene = Scene(dataclasses.replace(hall(), polygons=(wall,)), (0.25,), at)
    obstacles = DynamicObstacleParameters(max_speed=speed, caution=1.0)
    assert (
        drive(scene, np.array((-far, 0.0, 0.0)), np.array((2.5, 0.0)), obstacles, duration=7.0).outcome != "collision"
    )
