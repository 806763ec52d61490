"""Footprint, front and velocities, which move with their bodies and are drawn anew only where they change."""

import math
from unittest.mock import MagicMock

import numpy as np
import pytest

from drake_starnav.geometry.footprint import disc, footprint
from drake_starnav.visualization.meshcat_stage import MeshcatStage
from drake_starnav.visualization.star_roadmap_visualizer import BodyMarks
from drake_starnav.worlds.moving_obstacles import MovingObstacles

LONG = footprint(((0.6, 0.2), (-0.2, 0.2), (-0.2, -0.2), (0.6, -0.2)))


@pytest.fixture
def stage():
    return MeshcatStage(MagicMock(), "/starnav", 0.05)


def shown(stage: MeshcatStage, layer: str, time: float) -> list:
    return [s for path, s in stage.shapes.items() if path.startswith(f"/starnav/{layer}/") and s.shown.at(time)]


def test_the_footprint_in_force_moves_with_the_robot(stage) -> None:
    marks = BodyMarks(stage, MovingObstacles(), 1.0)
    for time, shape in ((0.0, LONG), (1.0, LONG), (2.0, disc(0.9))):
        marks.draw_robot(np.array((time, 2.0, 0.5 * math.pi)), shape, time)
    for time, reach in ((0.0, 0.6), (1.5, 0.6), (2.5, 0.9)):
        (rim,), (front,) = (shown(stage, layer, time) for layer in ("footprint", "front"))
        assert rim.points[:, 0].max() == front.points[:, 0].max() == pytest.approx(reach)
        X_WB = rim.poses.at(time)
        assert X_WB[:, 3] == pytest.approx((min(time, 2.0), 2.0, 0.0))
        assert X_WB[:2, 0] == pytest.approx((0.0, 1.0), abs=1e-9)


def test_arrows_have_the_length_and_the_direction_of_the_velocity(stage) -> None:
    to_and_fro = np.array([(0.0, 1.0, 1.0), (2.0, 2.0, 1.0), (3.0, 2.0, 1.0), (4.0, 2.0, 3.0)])
    marks = BodyMarks(stage, MovingObstacles(np.array([0.3]), (to_and_fro,)), 1.0)
    for time in np.arange(0.05, 4.0, 0.1):
        marks.draw_velocities(float(time))
    for time, length, direction in ((1.05, 0.5, (1.0, 0.0)), (3.55, 2.0, (0.0, 1.0))):
        (arrow,) = shown(stage, "velocities", time)
        assert arrow.points[:, 0].max() == pytest.approx(length)
        assert arrow.poses.at(time)[:2, 0] == pytest.approx(direction, abs=1e-9)
    assert not shown(stage, "velocities", 2.55)
    assert len(stage.shapes) == 2
