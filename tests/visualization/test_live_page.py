"""The page of a live run has the panel and the bar of a recording's, and its button drives."""

import json
import urllib.error
import urllib.request

import pytest

from drake_starnav.cli.live import LiveRun
from drake_starnav.scenario import parse_scenario
from drake_starnav.visualization.browser import FLAGS, PATIENCE, browser_missing, find_chromium

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
        assert page.inner_text("#starnav-clock") == f"t = {now:.1f} s"
        seen = page.evaluate("starnav.followed()")
        assert seen[0] == pytest.approx(run.pose[0], abs=0.1)
        assert complaints == []
        browser.close()
