"""Several robots in one scene: each is where it was in its own run."""

import numpy as np
import pytest

from drake_starnav.cli.comparison import record_comparison
from drake_starnav.scenario import parse_scenario
from drake_starnav.visualization.plot import moment_picture
from tests.helpers.browser import BrowserCamera, browser_missing
from tests.helpers.camera import floor_to_page, plotted

TEXT = "world: !Obstacles {bounds: [-1, -2, 5, 2], cylinders: [[1.5, 0.1, 0.3]], goal: [3.5, 0.0]}\n"
METHODS = ("star", "star_paper")
TIME = 4.0


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    html = tmp_path_factory.mktemp("comparison") / "two.html"
    scenarios = {method: parse_scenario(TEXT, name="post", method=method) for method in METHODS}
    return record_comparison(scenarios, 0, html), html


def test_plot_shows_robots_where_logged(recorded) -> None:
    recorded, _ = recorded
    first, second = (robot.motion.at(TIME)[:2] for robot in recorded.robots)
    assert np.hypot(*(first - second)) > 0.3
    layers = recorded.timeline.visible(TIME)
    assert len(layers) > 2 * TIME  # trails
    picture = moment_picture(recorded, TIME)
    image = np.asarray(picture, dtype=float) / 255.0
    for robot in recorded.robots:
        for side in (-0.8, 0.8):
            place = robot.motion.at(TIME)[:2] + (0.0, side * robot.shape.radius)
            assert image[plotted(recorded, place, picture)] == pytest.approx(robot.color, abs=0.02)


@pytest.mark.slow
def test_browser_shows_robots_where_logged(recorded) -> None:
    recorded, html = recorded
    if browser_missing() is not None:
        pytest.skip(f"there is no {browser_missing()}")
    with BrowserCamera(html) as camera:
        image = np.asarray(camera.picture(TIME), dtype=float) / 255.0
        text = camera.page.inner_text("#starnav-panel")
    matrix, offset = floor_to_page(recorded.extent)
    for robot in recorded.robots:
        column, row = np.round(matrix @ robot.motion.at(TIME)[:2] + offset).astype(int)
        ring = round(0.8 * robot.shape.radius * np.sqrt(abs(np.linalg.det(matrix))))
        for place in (row - ring, row + ring):
            assert image[place, column] == pytest.approx(robot.color, abs=0.13)
    assert all(layer.label in text for layer in recorded.caption.legend.values())
    assert text.index("star: reached in") < text.index("star_paper: ")


def test_one_method_alone_drives_the_same(recorded, tmp_path) -> None:
    recorded, _ = recorded
    scenario = parse_scenario(TEXT, name="post", method=METHODS[1])
    alone = record_comparison({METHODS[1]: scenario}, 0, tmp_path / "one.html")
    assert np.array_equal(alone.robots[0].motion.poses, recorded.robots[1].motion.poses)
