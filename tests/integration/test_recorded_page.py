"""A recording opened in a real browser: it needs no network, lasts as long as the run, and shows what happened."""

import io
import os

import numpy as np
import pytest
from matplotlib.image import imread

from drake_starnav.visualization.meshes import LAYERS
from drake_starnav.visualization.page import VIEWS
from tests.helpers.browser import BrowserCamera, browser_missing
from tests.helpers.camera import PANEL_WIDTH, camera_pose, projected
from tests.helpers.recorded_drive import CAPTION, DURATION, EXTENT, POSES, SPEED, record


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("recording") / "posts.html"
    record(path)
    return path


@pytest.fixture(scope="module")
def page(recording):
    missing = browser_missing()
    if missing is not None:
        pytest.skip(f"there is no {missing}")
    with BrowserCamera(recording) as camera:
        page = camera.page
        page.requests, page.complaints = [], []
        page.on("request", lambda request: page.requests.append(request.url))
        page.on("console", lambda message: message.type == "error" and page.complaints.append(message.text))
        page.on("pageerror", lambda error: page.complaints.append(str(error)))
        page.reload()  # what is heard now is heard from the start
        page.wait_for_function("viewer.animator.duration > 0")
        yield page


def picture(page, time):
    """The page's pixels at a time of the recording, shape (height, width, 3), 0 to 1."""
    page.evaluate(f"starnav.show({time})")
    return imread(io.BytesIO(page.screenshot()))[..., :3]


def magenta(image):
    """Column and row of the middle of the robot in a picture."""
    rows, columns = np.nonzero((image[..., 0] > 0.6) & (image[..., 2] > 0.6) & (image[..., 1] < 0.3))
    assert len(rows) > 200
    return np.array([columns.mean(), rows.mean()])


def pixel(x, y):
    """Column and row where the top view shows a point of the floor."""
    return projected(np.array([x, y, 0.0]), *camera_pose(EXTENT))


@pytest.mark.slow
def test_no_error_and_no_network(page):
    assert page.complaints == []
    assert [url[:80] for url in page.requests if not url.startswith(("file:", "data:", "blob:"))] == []


@pytest.mark.slow
def test_each_layer_shows_and_hides(page):
    time = 1.5

    def switch(layers, visible):
        for layer in layers:
            path = f"['starnav', ...'{layer}'.split('/')]"
            page.evaluate(f"viewer.set_property({path}, 'visible', {visible})")

    before = picture(page, time)
    for layer in set(LAYERS) - {"frontiers/stuck", "velocities", "zones/slow", "zones/keep_out"}:
        above = ["trail", "path"] if layer == "roadmap/edges" else []  # the robot drives along it
        switch(above, "false")
        shown = picture(page, time)
        switch([layer], "false")
        hidden = picture(page, time)
        switch([layer, *above], "true")
        changed = np.abs(shown - hidden).max(axis=2) > 0.05
        assert changed[:, int(PANEL_WIDTH) :].sum() > 5, layer
    assert np.array_equal(picture(page, time), before)


@pytest.mark.slow
def test_caption_clock_and_legend_are_read(page):
    picture(page, 2.0)
    text = page.inner_text("#starnav-panel") + page.inner_text("#starnav-bar")
    for part in (CAPTION.heading, *CAPTION.lines, "t = 2.0 s"):
        assert part in text
    assert all(layer.label in text for layer in LAYERS.values())


@pytest.mark.slow
@pytest.mark.parametrize("view", VIEWS)
def test_each_view_shows_the_robot_where_its_camera_looks(page, view):
    page.get_by_role("button", name=view).click()
    for time in (0.0, 3.0):
        image = picture(page, time)
        place = np.array([SPEED * time, 0.0, 0.0])
        lid = place + [0.0, 0.0, 0.2]
        position, target = POSES[view]
        if view == "follow":
            position, target = position + place, target + place
        assert np.hypot(*(magenta(image) - projected(lid, position, target))) < 12.0
    page.get_by_role("button", name="top").click()


@pytest.mark.slow
def test_the_following_camera_may_be_turned_by_hand_and_follows_on(page):
    page.evaluate("starnav.look('follow'); starnav.show(1.0)")
    stand = "viewer.camera.position.clone().sub(viewer.controls.target).toArray()"
    preset = np.array(page.evaluate(stand))
    page.mouse.move(600, 300)
    page.mouse.down()
    page.mouse.move(640, 330)
    page.mouse.up()
    before, turned = magenta(picture(page, 1.0)), np.array(page.evaluate(stand))
    after = magenta(picture(page, 3.0))
    assert np.abs(turned - preset).max() > 0.5
    assert np.array(page.evaluate(stand)) == pytest.approx(turned)
    page.evaluate("starnav.look('top')")
    assert np.hypot(*(after - before)) < 3.0


def seconds(page):
    page.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
    return float(page.inner_text("#starnav-clock").removeprefix("t = ").removesuffix(" s"))


@pytest.mark.slow
def test_the_button_plays_pauses_and_starts_again_at_the_end(page):
    page.evaluate("starnav.show(1.0)")
    page.click("#starnav-play")
    page.wait_for_function("viewer.animator.time > 1.05")
    page.click("#starnav-play")
    now = seconds(page)
    page.wait_for_timeout(200)
    assert 1.0 < now < 3.5 and seconds(page) == pytest.approx(now, abs=0.11)
    page.evaluate(f"starnav.show({DURATION})")
    page.click("#starnav-play")
    page.wait_for_function("viewer.animator.time < 3.5 && viewer.animator.time > 0.05")
    page.click("#starnav-play")


@pytest.mark.slow
def test_the_time_bar_seeks(page):
    page.evaluate("starnav.show(0.5); viewer.animator.play()")
    box = page.locator("#starnav-time").bounding_box()
    page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    page.wait_for_function("viewer.animator.time > 1.8")
    assert seconds(page) == pytest.approx(0.5 * DURATION, abs=0.15)
    assert np.hypot(*(magenta(picture(page, 0.5 * DURATION)) - pixel(0.5 * SPEED * DURATION, 0.0))) < 5.0


SHOWN = """(layer) => {
  const found = [];
  const walk = (node, visible) => {
    visible = visible && node.object.visible;
    if (visible && node.object.geometry) found.push(node.object);
    Object.values(node.children).forEach(child => walk(child, visible));
  };
  viewer.scene.updateMatrixWorld(true);
  walk(viewer.scene_tree.find(['starnav', ...layer.split('/')]), true);
  return found.map(o => ({
    opacity: o.material.opacity, vertices: Array.from(o.geometry.attributes.position.array),
  }));
}"""


@pytest.mark.slow
def test_path_and_short_term_goal_never_come_apart(page):
    page.evaluate("starnav.show(0)")
    seen = 0
    for k in range(round(DURATION / 0.1) + 1):
        page.evaluate(f"starnav.show(0.1 * {k})")
        paths, goals = page.evaluate(SHOWN, "path"), page.evaluate(SHOWN, "short_term_goal")
        assert len(paths) == len(goals) <= 1, k
        if paths:
            rim = np.reshape(paths[0]["vertices"], (-1, 3))[:, :2]
            goal = np.reshape(goals[0]["vertices"], (-1, 3))[:, :2].mean(axis=0)
            beside = rim[np.hypot(*(rim - goal).T).argsort()[:2]]  # the corners on both sides of a way point
            assert np.hypot(*(beside.mean(axis=0) - goal)) < 0.05, k
            seen += 1
    assert seen > 20


BOXES = """() => Object.fromEntries(['meshcat-pane', 'starnav-panel', 'starnav-bar', 'starnav-play', 'starnav-time',
  'starnav-scale'].map(id => [id, document.getElementById(id).getBoundingClientRect().toJSON()]))"""


@pytest.mark.slow
@pytest.mark.parametrize("width", [1600, 1100, 420])
def test_nothing_covers_the_scene_which_is_seen_as_a_whole(page, width):
    page.set_viewport_size({"width": width, "height": 800})
    page.wait_for_function("document.querySelector('canvas').offsetWidth === viewer.dom_element.offsetWidth")
    page.wait_for_timeout(300)
    boxes = page.evaluate(BOXES)
    scene = boxes.pop("meshcat-pane")
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert scene["width"] > 0.6 * width and scene["height"] >= 400
    for name, box in boxes.items():
        apart = box["left"] >= scene["right"] or box["right"] <= scene["left"] or box["top"] >= scene["bottom"]
        assert apart or box["bottom"] <= scene["top"], name
        assert box["width"] > 30 or name == "starnav-scale"
        assert box["right"] <= width and box["bottom"] <= 800 and box["height"] > 0
    covered = page.evaluate(
        "([x, y]) => document.elementFromPoint(x, y).tagName", [scene["right"] - 20, scene["top"] + 10]
    )
    assert covered == "CANVAS"
    robot = magenta(picture(page, 2.0))
    assert scene["left"] < robot[0] < scene["right"] and scene["top"] < robot[1] < scene["bottom"]
    corners = page.evaluate(
        """([x0, y0, x1, y1]) => [[x0, y0], [x0, y1], [x1, y0], [x1, y1]].map(([x, y]) => {
          const p = viewer.camera.position.clone().set(x, 0, -y).project(viewer.camera);
          return Math.max(Math.abs(p.x), Math.abs(p.y));
        })""",
        EXTENT,
    )
    assert 0.85 < max(corners) < 1.0
    page.set_viewport_size({"width": 1100, "height": 800})
    page.wait_for_timeout(300)


@pytest.mark.slow
def test_the_legend_folds_and_its_rows_hide_and_show(page):
    legend = page.locator("#starnav-legend")
    assert legend.get_attribute("open") is not None and "robot" in legend.inner_text()
    page.click("#starnav-legend summary")
    assert not page.locator("#starnav-legend table").is_visible()
    page.click("#starnav-legend summary")
    page.evaluate("starnav.show(2)")
    row = page.locator("#starnav-legend tr", has_text="laser scan")
    assert page.evaluate(SHOWN, "scan")
    row.click()
    assert not page.evaluate(SHOWN, "scan")
    row.click()
    assert page.evaluate(SHOWN, "scan")


@pytest.mark.slow
@pytest.mark.parametrize("width", [1600, 1100, 420])
def test_meshcat_s_controls_unfold_inside_the_panel(page, width):
    page.set_viewport_size({"width": width, "height": 800})
    scene = page.locator("#starnav-controls").get_by_text("Scene", exact=True)
    assert not scene.is_visible()
    page.click("#starnav-controls summary")
    assert scene.is_visible()
    edges = (
        "[...document.querySelectorAll('#starnav-panel, #starnav-panel *')].map(x => x.getBoundingClientRect().right)"
    )
    panel, *parts = page.evaluate(edges)
    assert max(parts) <= panel
    page.click("#starnav-controls summary")
    page.set_viewport_size({"width": 1100, "height": 800})
    page.wait_for_timeout(300)


def test_the_file_is_small_and_alone_in_its_folder(recording):
    assert recording.stat().st_size < 4e6
    assert os.listdir(recording.parent) == ["posts.html"]
