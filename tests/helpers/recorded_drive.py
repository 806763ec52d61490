"""A recording of a robot that drives past posts at constant speed, and of what its planner makes of it."""

import math
from types import SimpleNamespace

import numpy as np
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
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.planning import PlannerInput, PlannerParameters, PlannerState, plan_step
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.schema import RecordingParameters
from drake_starnav.surroundings import Observation, scan_region
from drake_starnav.visualization.meshcat_stage import WORLD_PREFIX, quiet_meshcat
from drake_starnav.visualization.meshes import LAYERS
from drake_starnav.visualization.meshes import ROBOT as ROBOT_ROW
from drake_starnav.visualization.page import VIEWS, Cameras, Caption, around_robot
from drake_starnav.visualization.recorder import (
    finish_recording,
)
from drake_starnav.visualization.star_roadmap_visualizer import StarRoadmapVisualizer
from tests.helpers.camera import camera_pose
from tests.helpers.scans import MARGINS

ROBOT, PLANNER = RobotParameters(), PlannerParameters()
POSTS = np.array([(1.5, 1.0, 0.3), (2.5, -1.0, 0.4), (4.0, 1.3, 0.3), (5.0, -1.2, 0.4)])
EXTENT = (-1.0, -2.5, 7.0, 2.5)
DURATION, SPEED, PERIOD = 4.0, 0.8, 0.05
MAGENTA = (1.0, 0.0, 1.0)  # the robot's, like nothing else in the picture
CAPTION = Caption(
    "posts <four>", ("method star, seed 3", "timeout </script> after 4.0 s"), {**LAYERS, "robot": ROBOT_ROW}
)
POSES = {view: camera_pose(around_robot([0.0, 0.0]) if view == "follow" else EXTENT, view) for view in VIEWS}
CAMERAS = Cameras(EXTENT, "top", f"{WORLD_PREFIX}/robot", (0.0, 0.0))


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
            seen = Observation(scan_region(scan, pose, ROBOT.radius, MARGINS), scan, pose)
            state = plan_step(
                state, PlannerInput(seen, pose[:2], np.array([6.0, 0.0]), PERIOD * k, PLANNER, MARGINS, ROBOT.radius)
            )
            braking = SimpleNamespace(path=pose + np.array([(0.0, 0.0, 0.0), (0.3, 0.0, 0.0)]))
            self._log.append((pose, scan, state, braking))
        for name in ("pose", "scan_pose"):
            self.DeclareVectorOutputPort(name, 3, lambda c, out: out.SetFromVector(self._row(c)[0]))
        self.DeclareVectorOutputPort("goal", 2, lambda c, out: out.SetFromVector([6.0, 0.0]))
        self.DeclareVectorOutputPort("twist", 2, lambda c, out: out.SetFromVector([SPEED, 0.0]))
        for k, name in ((1, "scan"), (2, "planner_state"), (3, "certificate")):
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
        if drive.HasOutputPort(port.get_name()):
            builder.Connect(drive.GetOutputPort(port.get_name()), port)
    meshcat.StartRecording(parameters.frames_per_second, set_visualizations_while_recording=False)
    simulator = Simulator(builder.Build())
    simulator.Initialize()
    simulator.AdvanceTo(DURATION)
    finish_recording(meshcat, path, CAPTION, CAMERAS)
