"""Record robots that have driven in one scene, each with its outline, colour and trail."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from pydrake.geometry import Box, Cylinder, Meshcat, MeshcatVisualizer, MeshcatVisualizerParams, Rgba, Role
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from drake_starnav.geometry.trajectory import Motion
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.schema import RecordingParameters
from drake_starnav.station.model_world import floor_geometries
from drake_starnav.station.world_geometry import OBSTACLE_HEIGHT, add_still_obstacles, upright_prism
from drake_starnav.visualization import meshes
from drake_starnav.visualization.collision_shapes import show_collision_shapes
from drake_starnav.visualization.meshcat_stage import MeshcatStage, quiet_meshcat
from drake_starnav.visualization.meshes import (
    DECK_COLOR,
    HEADING_COLOR,
    LIDAR_COLOR,
    LINE_WIDTH,
    Color,
    Layer,
    Mesh,
)
from drake_starnav.visualization.page import Cameras, Caption
from drake_starnav.visualization.recorder import (
    WORLD_PREFIX,
    finish_recording,
    set_look,
)
from drake_starnav.visualization.scene_timeline import RecordedRun, RobotTrack, SceneTimeline, Solid
from drake_starnav.visualization.star_roadmap_visualizer import FRAME_SLACK
from drake_starnav.visualization.timeline import Broadcast, Timeline, Track
from drake_starnav.worlds.footprints import cylinder_vertices
from drake_starnav.worlds.moving_obstacles import moving_obstacle_states
from drake_starnav.worlds.world import World

COLORS: tuple[Color, ...] = (
    (0.00, 0.45, 0.70), (0.84, 0.37, 0.00), (0.00, 0.62, 0.45), (0.80, 0.47, 0.65), (0.90, 0.62, 0.00),
    (0.34, 0.71, 0.91), (0.30, 0.30, 0.30),
)  # fmt: skip
"""Colours of the robots in order, distinguishable for colour-blind readers (Okabe and Ito, 2008)."""
TRAIL_PERIOD = 0.2
"""Period at which trails grow, s."""
TRAIL, ROBOT_PATH = "trail", "/robots"
HULL_HEIGHT = 0.13
"""Height of a displayed robot, m."""
STACKED = 0.02
"""Height step between robots, m: where several coincide, the first one is on top."""
DECK = 0.55
"""Radius of the deck as a share of the hull's; less than the shipped robot's, to show more of its colour."""


def trail_layer(name: str, said: str, number: int) -> tuple[str, Layer]:
    """The layer of a robot's trail, with its name, for `record_tracks`.

    Args:
        name: of the robot.
        said: about it in the legend.
        number: of the robot, from 0, which decides its colour.
    """
    return f"{TRAIL}/{name}", Layer(f"{name}: {said}", COLORS[number % len(COLORS)], "robot", 0.1 - 0.005 * number)


def track_of(robot: RobotParameters, motion: Motion, number: int) -> RobotTrack:
    """The track of the robot with a number, from 0, which decides its colour."""
    return RobotTrack(motion, robot.shape, COLORS[number % len(COLORS)], DECK)


def record_tracks(
    robots: Mapping[str, RobotTrack],
    goals: Mapping[str, Sequence[Mesh]],
    world: World,
    caption: Caption,
    parameters: RecordingParameters,
    html: Path,
    view: str = "top",
) -> RecordedRun:
    """Record robots that have driven in one scene: each stays at the pose where its motion ends.

    Args:
        robots: their motions and colours, by name.
        goals: by the layers that they are drawn in.
        world: around them.
        caption: its layers hold that of each robot's trail, as of `trail_layer`.
        parameters: of the recording.
        html: the file to write.
        view: camera preset that it opens with.
    """
    layers = dict(caption.layers or {})
    del layers["robot"]  # there are several, each with a row of its own
    caption = replace(caption, layers=layers)
    paths = {method: f"{ROBOT_PATH}/{method}" for method in robots}
    cameras = Cameras(world.extent, view, next(iter(paths.values())), world.start[:2])
    meshcat, timeline = quiet_meshcat(), Timeline()
    set_look(meshcat)
    scene = _publish_world(meshcat, world)
    stage = MeshcatStage(Broadcast(meshcat, timeline), "/starnav", 1.0 / parameters.frames_per_second, layers)
    for k, (method, robot) in enumerate(robots.items()):
        _add_robot(meshcat, paths[method], robot, STACKED * (len(robots) - k))
    meshcat.StartRecording(parameters.frames_per_second, set_visualizations_while_recording=False)
    for layer, places in goals.items():
        for place in places:
            stage.add(layer, place, 0.0)
    recorded = RecordedRun(caption, world.extent, scene, timeline, tuple(robots.values()))
    _play_moving_obstacles(meshcat, scene, world, recorded.duration, parameters)
    for method, robot in robots.items():
        trail = f"{TRAIL}/{method}"
        _play(meshcat, stage, robot.motion, paths[method], (trail, layers[trail].height), parameters)
    finish_recording(meshcat, html, caption, cameras)
    return recorded


def _play(
    meshcat: Meshcat,
    stage: MeshcatStage,
    motion: Motion,
    path: str,
    trail: tuple[str, float],
    parameters: RecordingParameters,
) -> None:
    """Keyframes of one robot at a path in Meshcat, and of its trail: a layer and its height, m."""
    rate, (layer, height) = parameters.frames_per_second, trail
    times = np.append(np.arange(0.0, motion.duration, 1.0 / rate), motion.duration)
    every = max(round(TRAIL_PERIOD * rate), 1)
    poses = np.array([motion.at(float(time)) for time in times])
    for k, (time, (x, y, yaw)) in enumerate(zip(times, poses, strict=True)):
        X_WB = RigidTransform(RotationMatrix.MakeZRotation(yaw), [x, y, 0.0])
        meshcat.SetTransform(path, X_WB, time + FRAME_SLACK)
        if k > 0 and (k % every == 0 or k == len(times) - 1):
            points = poses[(k - 1) // every * every : k + 1, :2]
            stage.add(layer, meshes.ribbon(points, LINE_WIDTH, height), time + FRAME_SLACK)


def _play_moving_obstacles(
    meshcat: Meshcat, scene: SceneTimeline, world: World, duration: float, parameters: RecordingParameters
) -> None:
    """Keyframes of the moving obstacles."""
    times = np.arange(0.0, duration + 1e-9, 1.0 / parameters.frames_per_second)
    positions, _ = moving_obstacle_states(world.moving_obstacles, times)
    for k, radius in enumerate(world.moving_obstacles.radii):
        path = f"{WORLD_PREFIX}/moving_obstacle_{k}"
        poses, color = Track(), meshes.MOVING_OBSTACLES.color
        meshcat.SetObject(path, Cylinder(radius, OBSTACLE_HEIGHT), Rgba(*color))
        scene.solids.append(Solid(cylinder_vertices(radius, OBSTACLE_HEIGHT), None, color, poses))
        for time, (x, y) in zip(times, positions[:, k], strict=True):
            X_WM = RigidTransform([x, y, 0.5 * OBSTACLE_HEIGHT])
            meshcat.SetTransform(path, X_WM, time + FRAME_SLACK)
            poses.set(X_WM.GetAsMatrix34(), time)


def _publish_world(meshcat: Meshcat, world: World) -> SceneTimeline:
    """Show the obstacles that stand."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    add_still_obstacles(plant, world)
    plant.Finalize()
    show_collision_shapes(plant, scene_graph, floor_geometries(plant, scene_graph))
    looks = MeshcatVisualizerParams(role=Role.kIllustration, prefix=WORLD_PREFIX)
    MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat, looks)
    scene = SceneTimeline(scene_graph)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    diagram.ForcedPublish(context)
    scene.note(scene_graph.get_query_output_port().Eval(scene_graph.GetMyContextFromRoot(context)), 0.0)
    return scene


def _add_robot(meshcat: Meshcat, path: str, robot: RobotTrack, above: float) -> None:
    """A hull of its colour with a light deck, a bar ahead and a lidar, `above` the floor, m."""
    shape, radius, top = robot.shape, robot.shape.radius, above + HULL_HEIGHT
    hull = Cylinder(radius, HULL_HEIGHT) if shape.is_disc else upright_prism(shape.outline, HULL_HEIGHT, path)
    parts = {
        "hull": (hull, [0.0, 0.0, top - 0.5 * HULL_HEIGHT], robot.color),
        "deck": (Cylinder(robot.deck * radius, 0.004), [0.0, 0.0, top], DECK_COLOR),
        "heading": (Box(0.8 * radius, 0.2 * radius, 0.008), [0.4 * radius, 0.0, top], HEADING_COLOR),
        "lidar": (Cylinder(0.24 * radius, 0.016), [0.0, 0.0, top], LIDAR_COLOR),
    }
    if not shape.is_disc:
        del parts["deck"]
    for name, (part, position, rgb) in parts.items():
        meshcat.SetObject(f"{path}/{name}", part, Rgba(*rgb))
        meshcat.SetTransform(f"{path}/{name}", RigidTransform(position))
