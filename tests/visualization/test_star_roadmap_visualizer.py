import dataclasses
import gc
import math

import numpy as np
import pytest
import shapely
from pydrake.geometry import Meshcat
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_starnav import KeepOut, SpeedZone, World
from drake_starnav.planning.roadmap import refit_regions
from drake_starnav.planning.route import Route
from drake_starnav.scenario.schema import RecordingParameters
from drake_starnav.visualization.star_roadmap_visualizer import NODE_RADIUS, SCAN_POINTS, SPACING, StarRoadmapVisualizer
from tests.helpers.mounts import CORNERS, looks
from tests.helpers.recorded_drive import ROBOT, Replay, run_log
from tests.helpers.scans import MARGINS

POSTS = np.array([(2.0, 1.2, 0.4), (2.5, -1.0, 0.5), (4.5, 0.4, 0.4), (0.0, 2.5, 0.5), (-1.0, -2.0, 0.6)])
WORLD = World("posts", (0, 0, 0), (0, 0), cylinders=POSTS)
GOAL = np.array([8.0, 0.0])
SPEED = 0.5


class Script(list):
    """Stands in for Meshcat: keeps the calls and answers what is visible when."""

    def __getattr__(self, name):
        if not hasattr(Meshcat, name):
            raise AttributeError(name)
        return lambda *args: self.append((name, *args))

    def objects(self, layer):
        made = [call[1] for call in self if call[0] in ("SetTriangleMesh", "SetTriangleColorMesh", "SetObject")]
        return [path for path in made if path.startswith(f"/starnav/{layer}")]

    def track(self, path, key):
        """Keyframes of a property, by frame, in the order of the frames; the last of a frame counts."""
        frames = {}
        for name, *args in self:
            if name == "SetProperty" and args[:2] == [path, key] and len(args) == 4:
                frames[math.floor(20.0 * args[3])] = args[2]
        return sorted(frames.items())

    def visible(self, layer, frame):
        """Paths of the layer's objects that are on stage in a frame."""
        shown = []
        for path in self.objects(layer):
            track = self.track(path, "visible")
            assert track[0][0] == 0, f"{path} is not told whether it is visible from the start"
            if [value for k, value in track if k <= frame][-1]:
                shown.append(path)
        return shown

    def meshes(self, layer, frame):
        """Vertices (3, n) and faces (3, k) of the layer's objects that are on stage in a frame."""
        shown = set(self.visible(layer, frame))
        return [call[2:4] for call in self if call[0] == "SetTriangleMesh" and call[1] in shown]


def covered_area(mesh):
    """The sum of the areas of a mesh's triangles, m^2."""
    return shapely.area(shapely.polygons(mesh[0][:2, mesh[1]].transpose(2, 1, 0))).sum()


def connected(log, ports=None, parameters=None, **areas):
    """The script of a visualizer, and the diagram in which it shows a log."""
    script, builder = Script(), DiagramBuilder()
    replay = builder.AddSystem(Replay(log))
    recording = RecordingParameters(**(parameters or {}))
    visualizer = builder.AddSystem(StarRoadmapVisualizer(script, recording, ROBOT, **areas))
    for name in log[0] if ports is None else ports:
        builder.Connect(replay.GetOutputPort(name), visualizer.GetInputPort(name))
    return script, builder.Build()


def play(log, ports=None, parameters=None, **areas):
    """The calls to Meshcat of a run."""
    script, diagram = connected(log, ports, parameters, **areas)
    simulator = Simulator(diagram)
    gc.collect()
    simulator.AdvanceTo(0.05 * (len(log) - 1))
    return script


@pytest.fixture(scope="module")
def log():
    return run_log(WORLD, GOAL, SPEED, 3.0)


@pytest.fixture(scope="module")
def script(log):
    return play(log)


def test_regions_nodes_and_open_frontiers_are_those_of_the_roadmap(log, script):
    assert len(log[-1]["planner_state"].roadmap) > 2
    for frame in (0, 20, 45, 60):
        roadmap = log[frame]["planner_state"].roadmap
        assert len(script.visible("regions/newest", frame)) == 2  # area and outline
        known = shapely.union_all([shapely.Polygon(region.outline(120)).buffer(0.0) for region in roadmap.regions])
        assert sum(map(covered_area, script.meshes("regions/all", frame))) == pytest.approx(known.area, rel=0.01)
        nodes = np.vstack([vertices[:2].T for vertices, _ in script.meshes("roadmap/nodes", frame)])
        apart = np.hypot(*(nodes[:, None] - nodes[None]).T)
        assert ((apart < 2.01 * NODE_RADIUS) | (apart > (SPACING - 2.01) * NODE_RADIUS)).all()
        assert all(np.hypot(*(nodes - node).T).min() < (SPACING + 1.01) * NODE_RADIUS for node in roadmap.union.center)
        shown = set(script.visible("frontiers/extendable", frame))
        lines = [call[2] for call in script if call[0] == "SetTriangleMesh" and call[1] in shown]
        assert sum(vertices.shape[1] for vertices in lines) == 4 * len(
            log[frame]["planner_state"].frontiers(ROBOT.radius)
        )


def test_one_scan_one_path_and_one_certificate_at_a_time_and_none_after_the_run(script):
    for layer in ("scan", "path", "certificate"):
        assert all(len(script.visible(layer, frame)) == 1 for frame in range(61))
    assert max(call[4] for call in script if call[0] == "SetProperty" and len(call) == 5) < 3.0 + 1e-3


def test_scans_are_drawn_at_their_rate_and_thinned(log):
    slow = play(log, parameters={"scan_rate": 2.0})
    assert len(slow.objects("scan")) == 7  # at 0, 0.5 ... 3 s
    clouds = [call[2] for call in slow if call[0] == "SetObject" and call[1] in slow.objects("scan")]
    assert all(0 < cloud.size() <= SCAN_POINTS for cloud in clouds)


def test_a_rebuilt_roadmap_replaces_all_regions(log):
    last = log[-1]["planner_state"]
    less = dataclasses.replace(MARGINS, preferred=MARGINS.preferred - 0.01)
    narrow = refit_regions(last.roadmap, less, ROBOT.radius)
    after = {**log[-1], "planner_state": dataclasses.replace(last, roadmap=narrow)}
    script = play([*log, after, after])
    old, new = script.visible("regions", 60), script.visible("regions", 61)
    assert len(old) > 3 and len(new) == 3  # all together, area and outline of the newest
    assert not set(old) & set(new)


def test_a_goal_that_jumps_does_not_glide(log):
    rows = [{**row, "goal": GOAL if k < 10 else -GOAL} for k, row in enumerate(log[:21])]
    script = play(rows)
    (before,), (after,) = script.visible("goal", 9), script.visible("goal", 10)
    for path, x in ((before, GOAL[0]), (after, -GOAL[0])):
        (vertices,) = [call[2] for call in script if call[:2] == ("SetTriangleMesh", path)]
        assert vertices[0].mean() == pytest.approx(x)


def test_what_is_unconnected_is_not_drawn(log):
    script = play(log[:11], ports=("pose", "goal"))
    assert script.visible("goal", 5) == ["/starnav/goal/0001"]
    for layer in ("scan", "regions", "path", "certificate", "short_term_goal", "frontiers"):
        assert script.visible(layer, 5) == []


def test_no_path_no_short_term_goal(log):
    empty = dataclasses.replace(log[9]["planner_state"], route=Route())
    script = play([*log[:10], *[{**log[9], "planner_state": empty, "guidance": empty.guidance}] * 11])
    for layer in ("path", "short_term_goal", "frontiers/target"):
        assert len(script.visible(layer, 8)) == 1
        assert script.visible(layer, 18) == []


def test_the_trail_follows_the_robot(log, script):
    trail = [call for call in script if call[0] == "SetTriangleColorMesh"]
    x = np.concatenate([call[2][0] for call in trail])
    assert x.min() == pytest.approx(0.0)
    assert x.max() == pytest.approx(SPEED * 3.0)
    assert all(call[4].shape == call[2].shape for call in trail)


def test_a_second_initialization_starts_anew(log):
    (script, diagram), calls = connected(log), []
    for _ in range(2):
        Simulator(diagram).AdvanceTo(1.0)
        calls.append([(call[0], call[1]) for call in script])
        script.clear()
    assert calls[0] == calls[1]
    assert calls[0][0] == ("Delete", "/starnav")


def test_areas_of_certificates_are_drawn():
    square = np.array([(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)])
    zones = (KeepOut(square), SpeedZone(square + 3.0, 0.2), SpeedZone(square + 6.0, 0.1))
    script = play([{}] * 5, zones=zones)
    areas = {call[1]: call[2][:2].min(axis=1).tolist() for call in script if call[0] == "SetTriangleMesh"}
    drawn = [(name, areas[path]) for name in ("keep_out", "slow") for path in script.visible(f"zones/{name}", 4)]
    assert drawn == [("keep_out", [0.0, 0.0]), ("slow", [3.0, 3.0]), ("slow", [6.0, 6.0])]


def test_hits_of_every_lidar_are_drawn_where_they_are():
    pose = np.array((0.5, -0.2, 0.7))
    scans = dict(zip(("scan", "scan_2"), looks(WORLD, CORNERS, pose), strict=True))
    script = play([{"scan_pose": pose, **scans}], mounts=[lidar.mount for lidar in CORNERS])
    (points,) = [call[2].xyzs() for call in script if call[0] == "SetObject" and call[1] in script.objects("scan")]
    away = np.abs(np.hypot(*(points[:2].T[:, None] - POSTS[:, :2]).transpose(2, 0, 1)) - POSTS[:, 2]).min(axis=1)
    assert len(away) == sum(scan.hits.sum() for scan in scans.values()) and away.max() < 1e-5
