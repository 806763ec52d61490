"""Record robots that have driven in one scene, each with its outline, colour and trail."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pydrake.geometry import (
    Box,
    Cylinder,
    FrameId,
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    MakePhongIllustrationProperties,
    Meshcat,
    SceneGraph,
    Shape,
    SourceId,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from drake_starnav.geometry.trajectory import Motion
from drake_starnav.navigation.robot import body_top, obstacle_top
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.schema import RecordingParameters, Scenario
from drake_starnav.station.model_world import find_floor_geometries
from drake_starnav.station.world_geometry import add_still_obstacles, make_upright_prism
from drake_starnav.visualization import meshes
from drake_starnav.visualization.meshcat_stage import WORLD_PREFIX, MeshcatStage, add_scene, start_quiet_meshcat
from drake_starnav.visualization.page import ROOT, Cameras, Caption
from drake_starnav.visualization.recorder import finish_recording
from drake_starnav.visualization.star_roadmap_visualizer import FRAME_SLACK
from drake_starnav.visualization.timeline import RecordedRun, SceneTimeline
from drake_starnav.worlds.moving_obstacles import MovingObstacles, moving_obstacle_states
from drake_starnav.worlds.world import World

COLORS: tuple[meshes.Color, ...] = (
    (0.00, 0.45, 0.70), (0.84, 0.37, 0.00), (0.00, 0.62, 0.45), (0.80, 0.47, 0.65), (0.90, 0.62, 0.00),
    (0.34, 0.71, 0.91), (0.30, 0.30, 0.30),
)  # fmt: skip
"""Colours of the robots in order, distinguishable for colour-blind readers (Okabe and Ito, 2008)."""
TRAIL = "trail"


def make_trail_layer(name: str, description: str, number: int) -> tuple[str, meshes.Layer]:
    """Name and layer of the trail of a robot, whose number, from 0, decides its colour; `description` is about it."""
    color, height = COLORS[number % len(COLORS)], 0.1 - 0.005 * number
    return f"{TRAIL}/{name}", meshes.Layer(f"{name}: {description}", color, "robot", height)


_Part = tuple[Shape, float, float, meshes.Color]
"""A shape, how far ahead its middle is and how far above the floor, m, and its colour."""


class _Body(NamedTuple):
    """What moves through a scene: its path in Meshcat, its motion, and its parts."""

    name: str
    motion: Motion
    parts: Sequence[_Part]


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
    names, trails = zip(*(make_trail_layer(each.name, each.said, k) for k, each in enumerate(driven)), strict=True)
    layers, parameters = dict(zip(names, trails, strict=True)), scenario.recording
    layers |= {"goal": meshes.LAYERS["goal"]} if not any(each.goals for each in driven) else {}
    layers |= meshes.add_scene_layers({}, world)
    del layers["robot"]  # there are several, each with a row of its own
    caption, rate = Caption(scenario.name, (line,), layers, shown), parameters.frames_per_second
    scenarios = [dataclasses.replace(scenario, robot=each.robot, robots=()) for each in driven]
    bodies = [
        _make_robot_body(each, trail.color, body_top(own), 0.02 * (len(driven) - k))  # the first is on top
        for k, (each, own, trail) in enumerate(zip(driven, scenarios, trails, strict=True))
    ]
    meshcat, motions = start_quiet_meshcat(), tuple(each.motion for each in driven)
    times = np.arange(0.0, max(motion.duration for motion in motions) + 1.0 / rate, 1.0 / rate)
    stage = MeshcatStage(meshcat, f"/{ROOT}", 1.0 / rate, layers)
    meshcat.StartRecording(rate, set_visualizations_while_recording=False)
    scene = _play_motions(meshcat, world, max(map(obstacle_top, scenarios)), bodies, times)
    if "goal" in layers:
        stage.add("goal", meshes.make_goal_star(world.goal, driven[0].robot.radius, world.extent), 0.0)
    for each, name in zip(driven, names, strict=True):
        _add_goals_and_trail(stage, each, name, layers[name].height, world.extent, parameters)
    cameras = Cameras(world.extent, view, f"{WORLD_PREFIX}/{bodies[0].name}", world.start[:2])
    finish_recording(meshcat, html, caption, cameras)
    return RecordedRun(caption, world.extent, scene, stage.shapes, motions)


def _add_goals_and_trail(
    stage: MeshcatStage,
    driven: Driven,
    layer: str,
    height: float,
    extent: tuple[float, float, float, float],
    parameters: RecordingParameters,
) -> None:
    """Mark the goals of a robot in a world of that extent, and let its trail grow, so high above the floor, m."""
    for place in driven.goals:
        stage.add(layer, meshes.make_goal_star(place, driven.robot.radius, extent), 0.0)
    width = meshes.LINE_WIDTH * meshes.choose_mark_scale(extent, driven.robot.radius)
    rate, motion = parameters.frames_per_second, driven.motion
    times = np.append(np.arange(0.0, motion.duration, 1.0 / rate), motion.duration)
    every = max(round(rate / parameters.scan_rate), 1)
    places = np.array([motion.at(float(time))[:2] for time in times])
    for k in range(1, len(times)):
        if k % every == 0 or k == len(times) - 1:
            trail = meshes.make_ribbon(places[(k - 1) // every * every : k + 1], width, height)
            stage.add(layer, trail, times[k] + FRAME_SLACK)


def _play_motions(
    meshcat: Meshcat, world: World, height: float, bodies: Sequence[_Body], times: np.ndarray
) -> SceneTimeline:
    """Show a world's obstacles, of a height, m, and how they and bodies move at the times, s, also in Meshcat."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    add_still_obstacles(plant, world, height)
    plant.Finalize()
    source = scene_graph.RegisterSource("bodies")
    moving = _make_moving_bodies(world.moving_obstacles, height, times)
    motions = {_register_body(scene_graph, source, body): body.motion for body in (*bodies, *moving)}
    add_scene(builder, plant, scene_graph, meshcat, find_floor_geometries(plant, scene_graph))
    scene, diagram = SceneTimeline(scene_graph), builder.Build()
    context = diagram.CreateDefaultContext()
    scene_context = scene_graph.GetMyContextFromRoot(context)
    for time in times.tolist():
        context.SetTime(time + FRAME_SLACK)
        poses = FramePoseVector()
        for frame, motion in motions.items():
            x, y, yaw = motion.at(time)
            poses.set_value(frame, RigidTransform(RotationMatrix.MakeZRotation(yaw), [x, y, 0.0]))
        scene_graph.get_source_pose_port(source).FixValue(scene_context, poses)
        diagram.ForcedPublish(context)
        scene.note(scene_graph.get_query_output_port().Eval(scene_context), time)
    return scene


def _make_moving_bodies(obstacles: MovingObstacles, height: float, times: np.ndarray) -> list[_Body]:
    positions, _ = moving_obstacle_states(obstacles, times)
    paths, color = np.insert(positions, 2, 0.0, axis=2).swapaxes(0, 1), meshes.MOVING_OBSTACLES.color
    return [
        _Body(f"moving_obstacle_{k}", Motion(times, path), [(Cylinder(radius, height), 0.0, 0.5 * height, color)])
        for k, (radius, path) in enumerate(zip(obstacles.radii, paths, strict=True))
    ]


def _register_body(scene_graph: SceneGraph, source: SourceId, body: _Body) -> FrameId:
    """Let a scene show a body; returns the frame that moves it."""
    frame = scene_graph.RegisterFrame(source, GeometryFrame(body.name))
    for k, (shape, forward_axis, up, color) in enumerate(body.parts):
        part = GeometryInstance(RigidTransform([forward_axis, 0.0, up]), shape, f"{body.name}_{k}")
        part.set_illustration_properties(MakePhongIllustrationProperties([*color, 1.0]))
        scene_graph.RegisterGeometry(source, frame, part)
    return frame


def _make_robot_body(driven_robot: Driven, color: meshes.Color, height: float, above: float) -> _Body:
    """A hull of its colour and height with a light deck, a bar ahead and a lidar, `above` the floor, m."""
    shape, radius, top = driven_robot.robot.shape, driven_robot.robot.shape.radius, above + height
    hulls = [make_upright_prism(part, height, driven_robot.name) for part in shape.parts] or [Cylinder(radius, height)]
    parts = [(hull, 0.0, top - 0.5 * height, color) for hull in hulls]
    parts += [(Cylinder(0.55 * radius, 0.004), 0.0, top, meshes.DECK_COLOR)] if shape.is_disc else []
    parts += [(Box(0.8 * radius, 0.2 * radius, 0.008), 0.4 * radius, top, meshes.HEADING_COLOR)]
    parts += [(Cylinder(0.24 * radius, 0.016), 0.0, top, meshes.LIDAR_COLOR)]
    return _Body(f"robots/{driven_robot.name}", driven_robot.motion, parts)
