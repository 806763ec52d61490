"""The record and the recording of a run, be it of one robot or of several."""

import dataclasses

import numpy as np
import pytest

from drake_starnav.geometry.trajectory import Motion
from drake_starnav.loading import parse_scenario
from drake_starnav.robot import RobotParameters
from drake_starnav.simulation.records import make_robots_record, record_comparison
from drake_starnav.simulation.robots import RobotTrial
from drake_starnav.simulation.run import run_trial
from drake_starnav.simulation.trial import make_trial_record
from drake_starnav.visualization.tracks import COLORS
from tests.helpers.browser import BrowserCamera, browser_missing
from tests.helpers.camera import floor_to_page

WORLD = "world: !Obstacles {bounds: [-1, -2, 5, 2], goal: [4, 0]}\nsimulation: {timeout: 0.2}\n"


@pytest.fixture(scope="module")
def alone() -> dict:
    return make_trial_record(run_trial(parse_scenario(WORLD, name="one")))


@pytest.mark.parametrize(
    ("ends", "decides"),
    [
        ([("reached", 5.0), ("reached", 9.0)], 1),
        ([("timeout", 20.0), ("reached", 9.0)], 0),
        ([("timeout", 20.0), ("collision", 9.0), ("blocked", 20.0)], 1),
        ([("interrupted", 3.0), ("reached", 2.0)], 0),
    ],
)
def test_who_arrives_last_or_not_at_all_decides(alone: dict, ends: list[tuple[str, float]], decides: int) -> None:
    one = run_trial(parse_scenario(WORLD, name="one"))
    still = Motion(np.zeros(1), np.zeros((1, 3)))
    trials = [
        RobotTrial(f"r{k}", dataclasses.replace(one, outcome=outcome, time_s=time), 1.0 - 0.1 * k, still)
        for k, (outcome, time) in enumerate(ends)
    ]
    record = make_robots_record(trials)
    assert (record["outcome"], record["time_s"]) == ends[decides]
    assert record["min_gap_m"] == trials[-1].min_gap_m
    assert record.keys() - {"robots", "min_gap_m"} == alone.keys()


POST = "world: !Obstacles {bounds: [-1, -2, 5, 2], cylinders: [[1.5, 0.1, 0.3]], goal: [3.5, 0.0]}\n"
METHODS = ("star", "star_paper")
TIME, RADIUS = 4.0, RobotParameters().radius


@pytest.fixture(scope="module")
def compared(tmp_path_factory):
    html = tmp_path_factory.mktemp("comparison") / "two.html"
    scenarios = {method: parse_scenario(POST, name="post", method=method) for method in METHODS}
    return record_comparison(scenarios, 0, html), html


@pytest.mark.slow
def test_browser_shows_robots_where_logged(compared) -> None:
    recorded, html = compared
    if browser_missing() is not None:
        pytest.skip(f"there is no {browser_missing()}")
    with BrowserCamera(html) as camera:
        image = np.asarray(camera.picture(TIME), dtype=float) / 255.0
        text = camera.page.inner_text("#starnav-panel")
    matrix, offset = floor_to_page(recorded.extent)
    for motion, color in zip(recorded.motions, COLORS, strict=False):
        column, row = np.round(matrix @ motion.at(TIME)[:2] + offset).astype(int)
        ring = round(0.8 * RADIUS * np.sqrt(abs(np.linalg.det(matrix))))
        for place in (row - ring, row + ring):
            assert image[place, column] == pytest.approx(color, abs=0.13)
    assert all(layer.label in text for layer in recorded.caption.legend.values())
    assert text.index("star: reached in") < text.index("star_paper: ")
