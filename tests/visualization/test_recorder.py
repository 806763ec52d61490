"""A recording opened in a real browser: it needs no network, lasts as long as the run, and shows what happened."""

import io
import math
import os
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
    MeshcatVisualizer,
    MeshcatVisualizerParams,
    Role,
    SceneGraph,
)
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import ConstantVectorSource

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.navigation import Navigation
from drake_starnav.planning import PlannerInput, PlannerParameters, PlannerState, plan_step
from drake_starnav.regions import Observation, scan_region
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.recording import RecordingParameters
from drake_starnav.station.navigation_station import NavigationStation, RobotInterface, plant_config
from drake_starnav.station.robot_model import add_robot
from drake_starnav.visualization.browser import BrowserCamera, browser_missing
from drake_starnav.visualization.camera import FIELD_OF_VIEW, PAGE, PANEL_WIDTH, VIEWS, around_robot, camera_pose
from drake_starnav.visualization.meshes import LAYERS
from drake_starnav.visualization.page import Cameras, Caption
from drake_starnav.visualization.recorder import (
    WORLD_PREFIX,
    Recorder,
    finish_recording,
    frame_camera,
    quiet_meshcat,
    robot_path,
    set_look,
    start_recording,
    write_html,
)
from drake_starnav.visualization.star_roadmap_visualizer import StarRoadmapVisualizer
from drake_starnav.worlds.world import World
from tests.helpers.camera import projected

ROBOT, PLANNER = RobotParameters(), PlannerParameters()
POSTS = np.array([(1.5, 1.0, 0.3), (2.5, -1.0, 0.4), (4.0, 1.3, 0.3), (5.0, -1.2, 0.4)])
EXTENT = (-1.0, -2.5, 7.0, 2.5)
DURATION, SPEED, PERIOD = 4.0, 0.8, 0.05
MAGENTA = (1.0, 0.0, 1.0)  # the robot's, like nothing else in the picture
CAPTION = Caption("posts <four>", ("method star, seed 3", "timeout </script> after 4.0 s"))
POSES = {view: camera_pose(around_robot([0.0, 0.0]) if view == "follow" else EXTENT, view) for view in VIEWS}
CAMERAS = Cameras(POSES, "top", f"{WORLD_PREFIX}/robot", (0.0, 0.0))


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
            state = plan_step(
                state, PlannerInput(seen, pose[:2], np.array([6.0, 0.0]), PERIOD * k, PLANNER, ROBOT.radius)
            )
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


def record(path):
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
    meshcat = quiet_meshcat()
    parameters = RecordingParameters()
    MeshcatVisualizer.AddToBuilder(
        builder,
        graph,
        meshcat,
        MeshcatVisualizerParams(
            publish_period=1.0 / parameters.frames_per_second, role=Role.kIllustration, prefix=WORLD_PREFIX
        ),
    )
    visualizer = builder.AddSystem(StarRoadmapVisualizer(meshcat, parameters, ROBOT))
    for k in range(visualizer.num_input_ports()):
        port = visualizer.get_input_port(k)
        builder.Connect(drive.GetOutputPort(port.get_name()), port)
    set_look(meshcat)
    frame_camera(meshcat, EXTENT)
    start_recording(meshcat, parameters)
    simulator = Simulator(builder.Build())
    simulator.Initialize()
    simulator.AdvanceTo(DURATION)
    finish_recording(meshcat, path, CAPTION, CAMERAS)


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
        page.wait_for_function("viewer.animator.duration > 0", timeout=60000)
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
    assert np.hypot(*(magenta(picture(page, time)) - pixel(SPEED * time, 0.0))) < 5.0


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
    for part in (CAPTION.heading, *CAPTION.lines, "t = 2.0 s"):
        assert part in text
    assert all(layer.label in text for layer in LAYERS.values())


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


def test_the_following_camera_may_be_turned_by_hand_and_follows_on(page):
    page.evaluate("starnav.look('follow'); starnav.show(1.0)")
    page.evaluate("viewer.camera.position.y += 2.0; viewer.controls.update(); starnav.show(1.0)")
    before = magenta(picture(page, 1.0))
    after = magenta(picture(page, 3.0))
    page.evaluate("starnav.look('top')")
    assert np.hypot(*(after - before)) < 3.0


def test_the_file_is_small_and_alone_in_its_folder(recording):
    assert recording.stat().st_size < 4e6
    assert os.listdir(recording.parent) == ["posts.html"]


def test_a_folder_that_cannot_be_made_is_named(tmp_path):
    (tmp_path / "nowhere").touch()
    meshcat = quiet_meshcat()
    with pytest.raises(StarnavError, match=r"cannot write .*nowhere.run\.html"):
        write_html(meshcat, tmp_path / "nowhere" / "run.html", CAPTION, CAMERAS)
    (tmp_path / "taken").mkdir()
    with pytest.raises(StarnavError, match="cannot write"):
        write_html(meshcat, tmp_path / "taken", CAPTION, CAMERAS)
    assert sorted(os.listdir(tmp_path)) == ["nowhere", "taken"]


def test_an_unknown_view_is_named():
    meshcat = quiet_meshcat()
    with pytest.raises(StarnavError, match="camera view is 'side'; allowed: one of top, follow, oblique"):
        frame_camera(meshcat, EXTENT, "side")


@pytest.mark.parametrize("own_plant", [False, True])
def test_any_diagram_with_a_robot_of_ours_is_recorded(own_plant: bool, tmp_path) -> None:
    world, builder = World("nothing planned", (0.0, 0.0, 0.0), (1.0, 0.0)), DiagramBuilder()
    lidar = LidarParameters(beams=36)
    if own_plant:
        plant, scene_graph = AddMultibodyPlant(plant_config(0.005), builder)
        model = add_robot(plant, scene_graph, ROBOT, world.start)
        plant.Finalize()
        station = builder.AddSystem(RobotInterface(plant, scene_graph, model, lidar))
        builder.Connect(scene_graph.get_query_output_port(), station.GetInputPort("geometry_query"))
        builder.Connect(plant.get_state_output_port(model), station.GetInputPort("multibody_state"))
        builder.Connect(station.GetOutputPort("desired_state"), plant.get_desired_state_input_port(model))
    else:
        station = builder.AddSystem(NavigationStation(world, ROBOT, lidar))
    still = builder.AddSystem(ConstantVectorSource([0.0, 0.0]))
    builder.Connect(still.get_output_port(), station.GetInputPort("drive.twist_command"))
    recorder = Recorder(tmp_path / "page.html")
    recorder.add_to(builder, Navigation(world, station))
    simulator = Simulator(builder.Build())
    recorder.start()
    simulator.AdvanceTo(0.2)
    recorder.finish()
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "nothing planned" in page and robot_path(station).rpartition("/")[2] == "base_link"
