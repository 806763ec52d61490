"""Record robots that have driven in one scene, each with its outline, colour and trail."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pydrake.geometry import Box, Cylinder, Meshcat, Rgba, Shape
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from drake_starnav.geometry.trajectory import Motion
from drake_starnav.navigation.robot import body_top, obstacle_top
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.schema import RecordingParameters, Scenario
from drake_starnav.station.model_world import floor_geometries
from drake_starnav.station.world_geometry import add_still_obstacles, upright_prism
from drake_starnav.visualization import meshes
from drake_starnav.visualization.meshcat_stage import WORLD_PREFIX, MeshcatStage, add_scene, quiet_meshcat
from drake_starnav.visualization.page import ROOT, Cameras, Caption
from drake_starnav.visualization.recorder import finish_recording
from drake_starnav.visualization.star_roadmap_visualizer import FRAME_SLACK
from drake_starnav.visualization.timeline import DECK, RecordedRun, RobotTrack, SceneTimeline, Solid, Track
from drake_starnav.worlds.footprints import cylinder_vertices
from drake_starnav.worlds.moving_obstacles import moving_obstacle_states
from drake_starnav.worlds.world import World

COLORS: tuple[meshes.Color, ...] = (
    (0.00, 0.45, 0.70), (0.84, 0.37, 0.00), (0.00, 0.62, 0.45), (0.80, 0.47, 0.65), (0.90, 0.62, 0.00),
    (0.34, 0.71, 0.91), (0.30, 0.30, 0.30),
)  # fmt: skip
"""Colours of the robots in order, distinguishable for colour-blind readers (Okabe and Ito, 2008)."""
TRAIL, ROBOT_PATH = "trail", "/robots"
STACKED = 0.02
"""Height step between robots, m: where several coincide, the first one is on top."""


def trail_layer(name: str, said: str, number: int) -> tuple[str, meshes.Layer]:
    """Name and layer of the trail of a robot, whose number, from 0, decides its colour; `said` is about it."""
    color, height = COLORS[number % len(COLORS)], 0.1 - 0.005 * number
    return f"{TRAIL}/{name}", meshes.Layer(f"{name}: {said}", color, "robot", height)


class Driven(NamedTuple):
    """A robot that has driven: its name, what it is, how it moved, the legend's words for it, and the goals (x, y), W,
    m, that are its own."""

    name: str
    robot: RobotParameters
    motion: Motion
    said: str
    goals: Sequence[tuple[float, ...]] = ()


def record_tracks(
    scenario: Scenario,
    driven: Sequence[Driven],
    world: World,
    line: str,
    html: Path,
    view: str = "top",
    shown: frozenset[str] | None = None,
) -> RecordedRun:
    """Record robots that have driven in one scene: each stays at the pose where its motion ends.

    Args:
        scenario: with the name and the parameters of the recording.
        driven: the robots; where none has goals of its own, the world's is shown.
        view: camera preset that it opens with.
        shown: layers that are shown at first; None for all.
    """
    names, trails = zip(*(trail_layer(each.name, each.said, k) for k, each in enumerate(driven)), strict=True)
    layers, parameters = dict(zip(names, trails, strict=True)), scenario.recording
    layers |= {"goal": meshes.LAYERS["goal"]} if not any(each.goals for each in driven) else {}
    layers |= meshes.with_scene({}, world)
    del layers["robot"]  # there are several, each with a row of its own
    tracks = [
        RobotTrack(each.motion, each.robot.shape, trail.color) for each, trail in zip(driven, trails, strict=True)
    ]
    paths = [f"{ROBOT_PATH}/{each.name}" for each in driven]
    caption = Caption(scenario.name, (line,), layers, shown)
    of_one = [dataclasses.replace(scenario, robot=each.robot, robots=()) for each in driven]
    height, meshcat = max(map(obstacle_top, of_one)), quiet_meshcat()
    scene = _publish_world(meshcat, world, height)
    stage = MeshcatStage(meshcat, f"/{ROOT}", 1.0 / parameters.frames_per_second, layers)
    for k, (path, track) in enumerate(zip(paths, tracks, strict=True)):
        _add_robot(meshcat, path, track, body_top(of_one[k]), STACKED * (len(tracks) - k))
    meshcat.StartRecording(parameters.frames_per_second, set_visualizations_while_recording=False)
    for layer, each in zip(names, driven, strict=True):
        for place in each.goals:
            stage.add(layer, meshes.goal_star(place, each.robot.radius, world.extent), 0.0)
    if "goal" in layers:
        stage.add("goal", meshes.goal_star(world.goal, driven[0].robot.radius, world.extent), 0.0)
    recorded = RecordedRun(caption, world.extent, scene, stage.shapes, tuple(tracks))
    times = np.arange(0.0, recorded.duration + 1e-9, 1.0 / parameters.frames_per_second)
    _play_moving_obstacles(meshcat, scene, world, height, times)
    for path, track, name in zip(paths, tracks, names, strict=True):
        width = meshes.LINE_WIDTH * meshes.mark_scale(world.extent, track.shape.radius)
        _play(meshcat, stage, track.motion, path, (name, layers[name].height, width), parameters)
    finish_recording(meshcat, html, caption, Cameras(world.extent, view, paths[0], world.start[:2]))
    return recorded


def _play(
    meshcat: Meshcat,
    stage: MeshcatStage,
    motion: Motion,
    path: str,
    trail: tuple[str, float, float],
    parameters: RecordingParameters,
) -> None:
    """Keyframes of one robot at a path in Meshcat, and of its trail: a layer, its height and its width, m."""
    rate, (layer, height, width) = parameters.frames_per_second, trail
    times = np.append(np.arange(0.0, motion.duration, 1.0 / rate), motion.duration)
    every = max(round(rate / parameters.scan_rate), 1)
    poses = np.array([motion.at(float(time)) for time in times])
    for k, (time, (x, y, yaw)) in enumerate(zip(times, poses, strict=True)):
        X_WB = RigidTransform(RotationMatrix.MakeZRotation(yaw), [x, y, 0.0])
        meshcat.SetTransform(path, X_WB, time + FRAME_SLACK)
        if k > 0 and (k % every == 0 or k == len(times) - 1):
            points = poses[(k - 1) // every * every : k + 1, :2]
            stage.add(layer, meshes.ribbon(points, width, height), time + FRAME_SLACK)


def _play_moving_obstacles(
    meshcat: Meshcat, scene: SceneTimeline, world: World, height: float, times: np.ndarray
) -> None:
    positions, _ = moving_obstacle_states(world.moving_obstacles, times)
    for k, radius in enumerate(world.moving_obstacles.radii):
        path = f"{WORLD_PREFIX}/moving_obstacle_{k}"
        poses, color = Track(), meshes.MOVING_OBSTACLES.color
        meshcat.SetObject(path, Cylinder(radius, height), Rgba(*color))
        scene.solids.append(Solid(cylinder_vertices(radius, height), None, color, poses))
        for time, (x, y) in zip(times, positions[:, k], strict=True):
            X_WM = RigidTransform([x, y, 0.5 * height])
            meshcat.SetTransform(path, X_WM, time + FRAME_SLACK)
            poses.set(X_WM.GetAsMatrix34(), time)


def _publish_world(meshcat: Meshcat, world: World, height: float) -> SceneTimeline:
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    add_still_obstacles(plant, world, height)
    plant.Finalize()
    add_scene(builder, plant, scene_graph, meshcat, floor_geometries(plant, scene_graph))
    scene = SceneTimeline(scene_graph)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    diagram.ForcedPublish(context)
    scene.note(scene_graph.get_query_output_port().Eval(scene_graph.GetMyContextFromRoot(context)), 0.0)
    return scene


def _add_robot(meshcat: Meshcat, path: str, robot: RobotTrack, height: float, above: float) -> None:
    """A hull of its colour and height with a light deck, a bar ahead and a lidar, `above` the floor, m."""
    shape, radius, top = robot.shape, robot.shape.radius, above + height
    color, middle = robot.color or meshes.SHELL_COLOR, [0.0, 0.0, top - 0.5 * height]
    hulls = [upright_prism(part, height, path) for part in shape.parts] or [Cylinder(radius, height)]
    parts: dict[str, tuple[Shape, list[float], meshes.Color]] = {
        **{f"hull_{k}": (hull, middle, color) for k, hull in enumerate(hulls)},
        "deck": (Cylinder(DECK * radius, 0.004), [0.0, 0.0, top], meshes.DECK_COLOR),
        "heading": (Box(0.8 * radius, 0.2 * radius, 0.008), [0.4 * radius, 0.0, top], meshes.HEADING_COLOR),
        "lidar": (Cylinder(0.24 * radius, 0.016), [0.0, 0.0, top], meshes.LIDAR_COLOR),
    }
    if not shape.is_disc:
        del parts["deck"]
    for name, (part, position, rgb) in parts.items():
        meshcat.SetObject(f"{path}/{name}", part, Rgba(*rgb))
        meshcat.SetTransform(f"{path}/{name}", RigidTransform(position))
