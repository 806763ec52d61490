"""Robots that have driven in one scene: their hulls, colours and trails in the recording."""

import numpy as np
import pytest

from drake_starnav import RobotParameters, Scenario, World
from drake_starnav.geometry.trajectory import Motion
from drake_starnav.utils.resources import find_model_path
from drake_starnav.visualization.plot import draw_moment
from drake_starnav.visualization.tracks import COLORS, RobotTrack, record_tracks
from tests.helpers.camera import plotted

WORLD = World("empty", (0.0, 0.0, 0.0), (2.0, 0.0), bounds=(-2.0, -2.0, 2.0, 2.0))


def test_trails_grow_behind_robots_of_their_colours(tmp_path) -> None:
    times = np.linspace(0.0, 2.0, 41)
    lines = {
        name: np.column_stack((times - 1.0, np.full(41, y), np.zeros(41))) for name, y in (("a", 1.0), ("b", -1.0))
    }
    driven = [
        RobotTrack(name, Scenario("two", None), Motion(times, line), "reached", [(0.0, 0.0)] if name == "b" else [])
        for name, line in lines.items()
    ]
    recorded = record_tracks(driven, WORLD, "two", "2 robots", tmp_path / "two.html")
    assert recorded.duration == 2.0
    assert [layer.label for layer in recorded.caption.legend.values()][:2] == ["a: reached", "b: reached"]
    picture = draw_moment(recorded, 2.0)
    image = np.asarray(picture, dtype=float) / 255.0
    for place, number in (((0.0, 1.0), 0), ((0.0, -1.0), 1), ((0.0, 0.0), 1), ((1.0, 1.2), 0), ((1.0, -1.2), 1)):
        assert image[plotted(recorded, place, picture)] == pytest.approx(COLORS[number], abs=0.15)
    before = np.asarray(draw_moment(recorded, 0.5), dtype=float) / 255.0
    assert before[plotted(recorded, (0.0, 1.0), picture)] != pytest.approx(COLORS[0], abs=0.15)


def test_robots_and_obstacles_have_the_height_that_they_have_in_the_plant(tmp_path) -> None:
    text = find_model_path("robots", "starbot.urdf").read_text(encoding="utf-8")
    low, high = '<origin xyz="0 0 0.03"/>\n      <geometry><cylinder radius="0.25" length="{}"/>', "0 0 0.43"
    text = text.replace(low.format(0.1), low.format(0.9).replace("0 0 0.03", high))
    (tmp_path / "tall.urdf").write_text(text, encoding="utf-8")
    tall = RobotParameters(model=str(tmp_path / "tall.urdf"), radius=0.3)
    scenario = Scenario("tall", None, robot=tall)
    driven = [RobotTrack("tall", scenario, Motion(np.arange(2.0), np.zeros((2, 3))), "reached")]
    recorded = record_tracks(driven, WORLD, "tall", "1 robot", tmp_path / "tall.html")
    placed = [(solid.vertices, solid.poses.at(0.0)) for solid in recorded.scene.solids]
    assert min((vertices @ X[2, :3] + X[2, 3]).max() for vertices, X in placed) > 0.9
