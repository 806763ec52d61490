"""The page of a live run has the panel and the bar of a recording's, and its button drives."""

import json
import urllib.error
import urllib.request
from collections.abc import Callable

import numpy as np
import pytest
from pydrake.geometry import Meshcat, MeshcatParams
from pydrake.systems.analysis import Simulator

from drake_starnav.cli.live import LiveRun
from drake_starnav.scenario.scenario_file import parse_scenario
from drake_starnav.visualization.live_page import SLIDERS, SliderGoal, add_goal_sliders
from drake_starnav.worlds.world import World
from tests.helpers.browser import FLAGS, PATIENCE, browser_missing, find_chromium

TEXT = "world: !Obstacles {bounds: [-1, -2, 5, 2], cylinders: [[1.5, 0.1, 0.3]], goal: [3.0, 0.0]}\n"
RIGHT_EDGES = """
[...document.querySelectorAll('#starnav-panel, #starnav-panel *')].map(part => part.getBoundingClientRect().right)
"""


@pytest.fixture
def run():
    run = LiveRun(parse_scenario(TEXT, name="post"), seed=3, real_time_rate=0.0, say=lambda text: None)
    yield run
    run.page.close()


def test_it_answers_with_the_page_and_the_state_and_nothing_else(run) -> None:
    def get(path: str) -> str:
        with urllib.request.urlopen(run.page.address + path) as answer:
            return answer.read().decode()

    assert "starnav-panel" in get("") and f'src="{run.meshcat.web_url()}/' in get("")
    assert json.loads(get("state")) == {"time": 0.0, "running": False, "ended": False, "said": "press start"}
    with pytest.raises(urllib.error.HTTPError):
        get("etc/passwd")


SHOWN = """place => {
  const at = viewer.camera.position.clone().set(place[0], 0, -place[1]).project(viewer.camera);
  const box = viewer.dom_element.getBoundingClientRect();
  return [box.x + 0.5 * (1 + at.x) * box.width, box.y + 0.5 * (1 - at.y) * box.height];
}"""
"""Where the page shows a point of the floor, pixels."""
FRAMES = "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 50))))"
"""Let the page draw."""


@pytest.mark.slow
@pytest.mark.parametrize(("bounds", "turned"), [((-1, -2, 5, 2), False), ((-2, -1, 2, 5), True)])
def test_clicks_and_arrow_keys_move_the_goal_as_the_screen_shows_the_floor(bounds, turned: bool) -> None:
    api = pytest.importorskip("playwright.sync_api")
    if browser_missing() is not None:
        pytest.skip(f"there is no {browser_missing()}")
    text = f"world: !Obstacles {{bounds: {list(bounds)}, goal: [1.0, 1.0]}}\n"
    run = LiveRun(parse_scenario(text, name="open"), seed=3, real_time_rate=0.0, say=lambda text: None)

    def goal() -> list[float]:
        return [run.meshcat.GetSliderValue(name) for name in SLIDERS]

    def moved(act: Callable[[], None]) -> list[float]:
        """The goal after an act of the user's; the page says it some time later."""
        before = goal()
        page.evaluate(FRAMES)
        act()
        for _ in range(100):
            page.wait_for_timeout(30)
            if goal() != before:
                page.wait_for_timeout(30)  # x and y come one after the other
                return goal()
        raise AssertionError("the goal has not moved")

    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=find_chromium(), headless=True, args=list(FLAGS))
        page = browser.new_page(viewport={"width": 1100, "height": 800})
        page.set_default_timeout(1e3 * PATIENCE)
        page.goto(run.page.address)
        page.wait_for_function("viewer.connection.readyState === 1 && 'goal y' in viewer.gui_controllers")
        for view in ("oblique", "top"):
            page.evaluate(f"starnav.look('{view}')")
            for place in ((0.5, -0.6), (1.5, 1.4)):
                assert moved(lambda at=place: page.mouse.click(*page.evaluate(SHOWN, at))) == pytest.approx(
                    place, abs=0.04
                )
        page.mouse.click(*page.evaluate(SHOWN, (bounds[2] + 0.3, 0.0)))  # outside the walls
        here = goal()
        assert here == pytest.approx((1.5, 1.4), abs=0.04)
        for key, (x, y) in {"Right": (1, 0), "Up": (0, 1), "Left": (-1, 0), "Down": (0, -1)}.items():
            there = moved(lambda name=f"Arrow{key}": page.keyboard.press(name))
            way = np.array(page.evaluate(SHOWN, there)) - page.evaluate(SHOWN, here)
            assert way / np.hypot(*way) == pytest.approx((x, -y), abs=0.05)
            step = (-y, x) if turned else (x, y)
            assert np.subtract(there, here) == pytest.approx(0.05 * np.array(step), abs=1e-9)
            here = there
        before = page.locator("#starnav-x").get_attribute("d")
        start, end = (page.evaluate(SHOWN, place) for place in ((0.0, 0.0), (1.0, 0.0)))
        tip = np.array([float(value) for value in before.split("L")[1].split("M")[0].split()]) - 42.0
        along = np.subtract(end, start) / np.hypot(*np.subtract(end, start))
        assert tip / np.hypot(*tip) == pytest.approx(along, abs=0.05)
        page.mouse.move(600, 300)
        page.mouse.down()
        page.mouse.move(700, 350, steps=4)  # turns the camera
        page.mouse.up()
        page.wait_for_timeout(100)
        assert goal() == here
        browser.close()
    run.page.close()


@pytest.mark.slow
def test_a_browser_starts_pauses_and_sees_the_run(run) -> None:
    api = pytest.importorskip("playwright.sync_api")
    if browser_missing() is not None:
        pytest.skip(f"there is no {browser_missing()}")
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=find_chromium(), headless=True, args=list(FLAGS))
        page = browser.new_page(viewport={"width": 1100, "height": 800})
        page.set_default_timeout(1e3 * PATIENCE)
        complaints: list[str] = []
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.goto(run.page.address)
        page.wait_for_function("viewer.connection.readyState === 1")
        for part in ("post", "method star, seed 3, live", "robot", "laser scan"):
            assert part in page.inner_text("#starnav-panel")
        assert "trail, 0 to 0.8 m/s" in page.inner_text("#starnav-panel")
        for width, height in ((1600, 900), (1100, 800), (420, 800)):
            page.set_viewport_size({"width": width, "height": height})
            page.reload()
            page.wait_for_function("viewer.connection.readyState === 1")
            for control in ("stop", "goal y"):  # in sight without scrolling
                box = page.get_by_text(control, exact=True).bounding_box()
                assert box is not None and box["y"] + box["height"] <= height, width
            panel, *parts = page.evaluate(RIGHT_EDGES)
            assert max(parts) <= panel, width  # or they would cover the scene
        page.set_viewport_size({"width": 1100, "height": 800})

        def press_and_step(drives: bool) -> None:
            page.click("#starnav-play")
            for _ in range(200):
                run.step()
                if page.evaluate("document.getElementById('starnav-play').classList.contains('playing')") == drives:
                    return
            raise AssertionError("the button has not changed")

        press_and_step(True)
        for _ in range(20):
            run.step()
        press_and_step(False)
        now = run.time
        page.wait_for_timeout(500)
        run.step()
        assert now == run.time > 0.5
        assert float(page.inner_text("#starnav-clock").split()[2]) == pytest.approx(now, abs=0.051)
        seen = page.evaluate("starnav.followed()")
        assert seen[0] == pytest.approx(run.pose[0], abs=0.1)
        assert complaints == []
        browser.close()


WORLD = World("open", (0, 0, 0), (1.2345, -0.5678), bounds=(-1.0, -2.0, 6.0, 2.0))


@pytest.fixture
def meshcat() -> Meshcat:
    return Meshcat(MeshcatParams(host="localhost", show_stats_plot=False))


def test_the_goal_is_the_worlds_until_a_slider_moves(meshcat) -> None:
    system = SliderGoal(WORLD.goal, add_goal_sliders(meshcat, WORLD), period=0.1)
    simulator = Simulator(system)
    port = system.GetOutputPort("goal")
    simulator.AdvanceTo(1.0)
    assert np.array_equal(port.Eval(simulator.get_context()), WORLD.goal)
    meshcat.SetSliderValue("goal x", 4.0)
    simulator.AdvanceTo(1.25)
    assert port.Eval(simulator.get_context()) == pytest.approx([4.0, WORLD.goal[1]], abs=0.005)
