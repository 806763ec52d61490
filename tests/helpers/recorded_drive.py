"""A recording of a robot that drives past posts at constant speed, and of what its planner makes of it."""

import dataclasses
from types import SimpleNamespace

import numpy as np
from pydrake.common.value import Value
from pydrake.geometry import (
    Box,
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

from drake_starnav.planning import PlannerInput, PlannerParameters, PlannerState, plan_step
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.schema import RecordingParameters
from drake_starnav.surroundings import Observation, make_scan_region
from drake_starnav.visualization.meshcat_stage import WORLD_PREFIX, apply_look, start_quiet_meshcat
from drake_starnav.visualization.meshes import LAYERS
from drake_starnav.visualization.meshes import ROBOT as ROBOT_ROW
from drake_starnav.visualization.page import VIEWS, Cameras, Caption, around_robot
from drake_starnav.visualization.recorder import finish_recording
from drake_starnav.visualization.star_roadmap_visualizer import StarRoadmapVisualizer
from drake_starnav.worlds.world import World
from tests.helpers.camera import camera_pose
from tests.helpers.scans import MARGINS, cast

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


def run_log(world, goal, speed, duration, period=PERIOD):
    """What the systems of a robot that drives along x past a world's posts would say, one row per period."""
    state, log = PlannerState.initial(PLANNER, ROBOT.radius), []
    for k in range(round(duration / period) + 1):
        pose, time = np.array([speed * period * k, 0.0, 0.0]), period * k
        scan = dataclasses.replace(cast(world, pose, beams=180, range_max=4.0), time=time)
        seen = Observation(make_scan_region(scan, pose, ROBOT.radius, MARGINS), scan, pose)
        state = plan_step(state, PlannerInput(seen, pose[:2], goal, time, PLANNER, MARGINS, ROBOT.radius))
        braking = SimpleNamespace(path=pose + np.linspace(0.0, 0.3, 30)[:, None] * np.array([1.0, 0.0, 0.0]))
        row = {"pose": pose, "scan_pose": pose, "goal": goal, "twist": np.array([speed, 0.0]), "scan": scan}
        log.append({**row, "guidance": state.guidance, "planner_state": state, "certificate": braking})
    return log


class Replay(LeafSystem):
    """Outputs the rows of a log; with a frame, also where it is in a scene."""

    def __init__(self, log, frame=None, period=PERIOD):
        super().__init__()

        def at(context):
            return log[min(int(context.get_time() / period + 1e-6), len(log) - 1)]

        for name, first in log[0].items():
            if isinstance(first, np.ndarray):
                show = lambda c, out, name=name: out.SetFromVector(at(c)[name])  # noqa: E731
                self.DeclareVectorOutputPort(name, len(first), show)
            else:
                self.DeclareAbstractOutputPort(
                    name, lambda first=first: Value[object](first), lambda c, out, name=name: out.set_value(at(c)[name])
                )

        def place(context, output):
            poses = FramePoseVector()
            poses.set_value(frame, RigidTransform([*at(context)["pose"][:2], 0.0]))
            output.set_value(poses)

        if frame is not None:
            self.DeclareAbstractOutputPort("geometry_pose", lambda: Value[FramePoseVector](), place)


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
    wall = GeometryInstance(RigidTransform([3.0, -2.0, 1.25]), Box(4.0, 0.1, 2.5), "wall before the robot, from aside")
    wall.set_illustration_properties(MakePhongIllustrationProperties([0.5, 0.5, 0.5, 1.0]))
    graph.RegisterAnchoredGeometry(source, wall)
    world = World("posts", (0, 0, 0), (0, 0), cylinders=POSTS)
    drive = builder.AddSystem(Replay(run_log(world, np.array([6.0, 0.0]), SPEED, DURATION), frame))
    builder.Connect(drive.GetOutputPort("geometry_pose"), graph.get_source_pose_port(source))
    meshcat = start_quiet_meshcat()
    apply_look(meshcat)
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
