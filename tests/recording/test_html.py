"""A recording opened in a real browser: it needs no network, lasts as long as the run, and shows what happened."""

import io
import math
import os
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.image import imread
from pydrake.common.value import Value
from pydrake.geometry import (
    Cylinder,
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    MakePhongIllustrationProperties,
    Meshcat,
    MeshcatParams,
    MeshcatVisualizer,
    MeshcatVisualizerParams,
    Role,
    SceneGraph,
)
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from drake_starnav.drawing import LAYERS, RecordingParameters
from drake_starnav.errors import StarnavError
from drake_starnav.recording import (
    FIELD_OF_VIEW,
    PAGE,
    PANEL_WIDTH,
    VIEWS,
    camera_pose,
    finish_recording,
    frame_camera,
    start_recording,
    write_html,
)
from drake_starnav.roadmap import Observation, PlannerParameters, PlannerState, plan_step
from drake_starnav.robot import RobotParameters
from drake_starnav.scan import LaserScan
from drake_starnav.stars import scan_region
from drake_starnav.systems.star_roadmap_visualizer import StarRoadmapVisualizer

CHROMIUM = Path("/usr/bin/chromium")
FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
ROBOT, PLANNER = RobotParameters(), PlannerParameters()
POSTS = np.array([(1.5, 1.0, 0.3), (2.5, -1.0, 0.4), (4.0, 1.3, 0.3), (5.0, -1.2, 0.4)])
EXTENT = (-1.0, -2.5, 7.0, 2.5)
DURATION, SPEED, PERIOD = 4.0, 0.8, 0.05
MAGENTA = (1.0, 0.0, 1.0)  # the robot's, like nothing else in the picture
CAPTION = "posts <four> · star · seed 3 · timeout"


def scan_at(pose, time, range_max=4.0, beams=180):
    bearings = -math.pi + 2.0 * math.pi / beams * np.arange(beams)
    ray = np.column_stack((np.cos(bearings), np.sin(bearings)))
    offset = POSTS[:, :2] - pose[:2]
    along = ray @ offset.T
    half = POSTS[:, 2] ** 2 - np.sum(offset**2, axis=1) + along**2
    distance = np.where((half >= 0.0) & (along > 0.0), along - np.sqrt(np.maximum(half, 0.0)), np.inf).min(axis=1)
    distance[distance >= range_max] = np.inf
    return LaserScan(time, -math.pi, 2.0 * math.pi / beams, 0.0, range_max, distance)


class Drive(LeafSystem):
    """A robot that drives along x at constant speed, and what its planner makes of it."""

    def __init__(self, frame):
        super().__init__()
        self._log = []
        state = PlannerState.initial(PLANNER, ROBOT.radius)
        for k in range(round(DURATION / PERIOD) + 1):
            pose = np.array([SPEED * PERIOD * k, 0.0, 0.0])
            scan = scan_at(pose, PERIOD * k)
            seen = Observation(scan_region(scan, pose, ROBOT.radius, PLANNER), scan, pose)
            state = plan_step(state, seen, pose[:2], np.array([6.0, 0.0]), PERIOD * k, PLANNER, ROBOT.radius)
            braking = SimpleNamespace(path=pose + np.array([(0.0, 0.0, 0.0), (0.3, 0.0, 0.0)]))
            self._log.append((pose, scan, state, braking))
        for name in ("pose", "scan_pose"):
            self.DeclareVectorOutputPort(name, 3, lambda c, out: out.SetFromVector(self._row(c)[0]))
        self.DeclareVectorOutputPort("goal", 2, lambda c, out: out.SetFromVector([6.0, 0.0]))
        self.DeclareVectorOutputPort("twist", 2, lambda c, out: out.SetFromVector([SPEED, 0.0]))
        for k, name in ((1, "scan"), (2, "roadmap"), (3, "certificate")):
            self.DeclareAbstractOutputPort(
                name, lambda k=k: Value[object](self._log[0][k]), lambda c, out, k=k: out.set_value(self._row(c)[k])
            )
        self._frame = frame
        self.DeclareAbstractOutputPort("geometry_pose", lambda: Value[FramePoseVector](), self._calc_geometry_pose)

    def _row(self, context):
        return self._log[int(context.get_time() / PERIOD + 1e-6)]

    def _calc_geometry_pose(self, context, output):
        poses = FramePoseVector()
        poses.set_value(self._frame, RigidTransform([*self._row(context)[0][:2], 0.0]))
        output.set_value(poses)


def record(path, view="top"):
    builder = DiagramBuilder()
    graph = builder.AddSystem(SceneGraph())
    source = graph.RegisterSource("test")
    frame = graph.RegisterFrame(source, GeometryFrame("robot"))

    def shape(radius, height, X, color, name):
        instance = GeometryInstance(X, Cylinder(radius, height), name)
        instance.set_illustration_properties(MakePhongIllustrationProperties([*color, 1.0]))
        return instance

    hull = shape(ROBOT.radius, 0.2, RigidTransform([0.0, 0.0, 0.1]), MAGENTA, "hull")
    graph.RegisterGeometry(source, frame, hull)
    for k, (x, y, radius) in enumerate(POSTS):
        post = shape(radius, 0.6, RigidTransform([x, y, 0.3]), (0.5, 0.5, 0.5), f"post {k}")
        graph.RegisterAnchoredGeometry(source, post)
    drive = builder.AddSystem(Drive(frame))
    builder.Connect(drive.GetOutputPort("geometry_pose"), graph.get_source_pose_port(source))
    meshcat = Meshcat(MeshcatParams(host="localhost", show_stats_plot=False))
    parameters = RecordingParameters()
    MeshcatVisualizer.AddToBuilder(
        builder,
        graph,
        meshcat,
        MeshcatVisualizerParams(publish_period=1.0 / parameters.frames_per_second, role=Role.kIllustration),
    )
    visualizer = builder.AddSystem(StarRoadmapVisualizer(meshcat, parameters, ROBOT))
    for k in range(visualizer.num_input_ports()):
        port = visualizer.get_input_port(k)
        builder.Connect(drive.GetOutputPort(port.get_name()), port)
    start_recording(meshcat, parameters, EXTENT, view)
    simulator = Simulator(builder.Build())
    simulator.Initialize()
    simulator.AdvanceTo(DURATION)
    finish_recording(meshcat, path, CAPTION)


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("recording") / "posts.html"
    record(path)
    return path


@pytest.fixture(scope="module")
def page(recording):
    api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    if not os.access(CHROMIUM, os.X_OK):
        pytest.skip(f"no browser at {CHROMIUM}: apt-get install chromium")
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=str(CHROMIUM), headless=True, args=FLAGS)
        page = browser.new_page(viewport={"width": int(PAGE[0]), "height": int(PAGE[1])})
        page.requests, page.complaints = [], []
        page.on("request", lambda request: page.requests.append(request.url))
        page.on("console", lambda message: message.type == "error" and page.complaints.append(message.text))
        page.on("pageerror", lambda error: page.complaints.append(str(error)))
        page.goto(recording.as_uri())
        page.wait_for_function("typeof viewer !== 'undefined' && viewer.animator.duration > 0", timeout=60000)
        yield page
        browser.close()


def picture(page, time):
    """The page's pixels at a time of the recording, shape (height, width, 3), 0 to 1."""
    page.evaluate(f"viewer.animator.pause(); viewer.animator.seek({time}); viewer.render()")
    return imread(io.BytesIO(page.screenshot()))[..., :3]


def pixel(x, y):
    """Column and row where the top view shows a point of the floor."""
    position, target = camera_pose(EXTENT)
    scale = 0.5 * PAGE[1] / math.tan(math.radians(0.5 * FIELD_OF_VIEW)) / np.linalg.norm(position - target)
    return np.array([0.5 * PAGE[0] + scale * (x - target[0]), 0.5 * PAGE[1] - scale * (y - target[1])])


def test_no_error_and_no_network(page):
    assert page.complaints == []
    assert [url[:80] for url in page.requests if not url.startswith(("file:", "data:", "blob:"))] == []


def test_the_animation_lasts_as_long_as_the_run(page):
    assert page.evaluate("viewer.animator.duration") == pytest.approx(DURATION, abs=1e-3)


@pytest.mark.parametrize("time", [0.0, 1.5, 4.0])
def test_the_robot_is_where_it_was(page, time):
    image = picture(page, time)
    rows, columns = np.nonzero((image[..., 0] > 0.6) & (image[..., 2] > 0.6) & (image[..., 1] < 0.3))
    assert len(rows) > 200
    assert np.hypot(*(np.array([columns.mean(), rows.mean()]) - pixel(SPEED * time, 0.0))) < 5.0


def test_each_layer_shows_and_hides(page):
    time = 1.5
    shown = picture(page, time)
    for layer in set(LAYERS) - {"frontiers/stuck"}:
        switch = f"viewer.set_property(['starnav', ...'{layer}'.split('/')], 'visible', %s)"
        page.evaluate(switch % "false")
        hidden = picture(page, time)
        page.evaluate(switch % "true")
        changed = np.abs(shown - hidden).max(axis=2) > 0.05
        assert changed[:, int(PANEL_WIDTH) :].sum() > 5, layer
    assert np.array_equal(picture(page, time), shown)


def test_hidden_scans_stay_hidden_while_the_recording_moves_on(page):
    def red(image):
        near = np.abs(image[:, int(PANEL_WIDTH) :] - LAYERS["scan"].color).max(axis=2) < 0.08
        return near.sum()

    assert red(picture(page, 1.0)) > 50
    page.evaluate("viewer.set_property(['starnav', 'scan'], 'visible', false)")
    assert red(picture(page, 1.0)) == red(picture(page, 3.0)) == 0
    page.evaluate("viewer.set_property(['starnav', 'scan'], 'visible', true)")
    assert red(picture(page, 3.0)) > 50


def test_caption_clock_and_legend_are_read(page):
    picture(page, 2.0)
    text = page.inner_text("#starnav-panel")
    for part in ("posts <four>", "star", "seed 3", "timeout", "t = 2.0 s"):
        assert part in text
    assert all(layer.label in text for layer in LAYERS.values())


def test_the_file_is_small_and_alone_in_its_folder(recording):
    assert recording.stat().st_size < 4e6
    assert os.listdir(recording.parent) == ["posts.html"]


def test_a_folder_that_does_not_exist_is_named(tmp_path):
    meshcat = Meshcat(MeshcatParams(host="localhost", show_stats_plot=False))
    with pytest.raises(StarnavError, match=r"recording .*nowhere.run\.html cannot be written"):
        write_html(meshcat, tmp_path / "nowhere" / "run.html", CAPTION)
    (tmp_path / "taken").mkdir()
    with pytest.raises(StarnavError, match="cannot be written"):
        write_html(meshcat, tmp_path / "taken", CAPTION)
    assert os.listdir(tmp_path) == ["taken"]


def test_an_unknown_view_is_named():
    meshcat = Meshcat(MeshcatParams(host="localhost", show_stats_plot=False))
    with pytest.raises(StarnavError, match="camera view is 'side'; allowed: one of top, oblique"):
        frame_camera(meshcat, EXTENT, "side")


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("extent", [(-1.0, -2.5, 7.0, 2.5), (0.0, 0.0, 5.0, 30.0), (-4.0, -4.0, 4.0, 4.0)])
def test_the_camera_sees_all_of_the_extent_beside_the_panel(extent, view):
    position, target = camera_pose(extent, view)
    ahead = (target - position) / np.linalg.norm(target - position)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, ahead)
    scale = 0.5 * PAGE[1] / math.tan(math.radians(0.5 * FIELD_OF_VIEW))
    x0, y0, x1, y1 = extent
    offset = np.array([(x0, y0, 0.0), (x0, y1, 0.0), (x1, y0, 0.0), (x1, y1, 0.0)]) - position
    column = 0.5 * PAGE[0] + scale * (offset @ right) / (offset @ ahead)
    row = 0.5 * PAGE[1] - scale * (offset @ up) / (offset @ ahead)
    assert column.min() > PANEL_WIDTH - 5.0 and column.max() < PAGE[0] + 5.0
    assert row.min() > 0.0 and row.max() < PAGE[1]
