"""Record robots that have driven in one scene, each with its outline, colour and trail."""

from collections.abc import Mapping, Sequence
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
from pydrake.systems.framework import Diagram, DiagramBuilder

from drake_starnav.geometry.trajectory import Motion
from drake_starnav.navigation.robot import body_top, obstacle_top
from drake_starnav.scenario.schema import Scenario
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


class _Part(NamedTuple):
    """A shape, how far ahead its middle is and how far above the floor, m, and its colour."""

    shape: Shape
    ahead: float
    height: float
    color: meshes.Color


class _Body(NamedTuple):
    """What moves through a scene: its path in Meshcat, its motion, and its parts."""

    name: str
    motion: Motion
    parts: Sequence[_Part]


class RobotTrack(NamedTuple):
    """A robot that has driven: what it is, how it moved, the legend's words for it, and goals (x, y) of its own, m."""

    name: str
    scenario: Scenario
    motion: Motion
    description: str
    goals: Sequence[tuple[float, ...]] = ()

    @property
    def layer_name(self) -> str:
        """Of its trail."""
        return f"{TRAIL}/{self.name}"


def record_tracks(
    robots: Sequence[RobotTrack],
    world: World,
    heading: str,
    line: str,
    html: Path,
    view: str = "top",
    shown: frozenset[str] | None = None,
) -> RecordedRun:
    """Record robots that have driven in one scene: each stays at the pose where its motion ends.

    Args:
        robots: where none has goals of its own, the world's is shown.
        heading, line: of the caption.
        view: camera preset that it opens with.
        shown: layers that are shown at first; None for all.
    """
    layers = _list_layers(robots, world)
    rate, meshcat = robots[0].scenario.recording.frames_per_second, start_quiet_meshcat()
    stage = MeshcatStage(meshcat, f"/{ROOT}", 1.0 / rate, layers)
    meshcat.StartRecording(rate, set_visualizations_while_recording=False)
    bodies = [_make_robot_body(each, layers, 0.02 * (len(robots) - k)) for k, each in enumerate(robots)]  # first on top
    scene = _play_motions(meshcat, world, max(obstacle_top(each.scenario) for each in robots), bodies, rate)
    _draw_tracks(stage, robots, layers, world)
    caption = Caption(heading, (line,), layers, shown)
    cameras = Cameras(world.extent, view, f"{WORLD_PREFIX}/{bodies[0].name}", world.start[:2])
    finish_recording(meshcat, html, caption, cameras)
    return RecordedRun(caption, world.extent, scene, stage.shapes, tuple(body.motion for body in bodies))


def _list_layers(robots: Sequence[RobotTrack], world: World) -> dict[str, meshes.Layer]:
    """Return the rows of the legend, by name: the trails, and the goal of all if none has goals of its own."""
    trails = dict(make_trail_layer(each.name, each.description, k) for k, each in enumerate(robots))
    layers = {**trails, **meshes.add_scene_layers({}, world)}
    del layers["robot"]  # there are several, each with a row of its own
    return layers if any(each.goals for each in robots) else {**layers, "goal": meshes.LAYERS["goal"]}


def _draw_tracks(
    stage: MeshcatStage, robots: Sequence[RobotTrack], layers: dict[str, meshes.Layer], world: World
) -> None:
    """Draw the trails of robots, and the goals, that of all as large as the first robot."""
    own_goals = [(each.layer_name, goal, each) for each in robots for goal in each.goals]
    for name, goal, robot in own_goals or [("goal", world.goal, robots[0])]:
        stage.add(name, meshes.make_goal_star(goal, robot.scenario.robot.radius, world.extent), 0.0)
    for each in robots:
        _grow_trail(stage, each, layers[each.layer_name].height, world)


def _grow_trail(stage: MeshcatStage, robot: RobotTrack, height: float, world: World) -> None:
    """Let the trail of a robot grow, so high above the floor, m."""
    width = meshes.LINE_WIDTH * meshes.choose_mark_scale(world.extent, robot.scenario.robot.radius)
    recording, motion = robot.scenario.recording, robot.motion
    times = np.append(np.arange(0.0, motion.duration, 1.0 / recording.frames_per_second), motion.duration)
    piece = max(round(recording.frames_per_second / recording.scan_rate), 1)
    places = np.array([motion.at(float(time))[:2] for time in times])
    for k in range(1, len(times)):
        if k % piece == 0 or k == len(times) - 1:
            trail = meshes.make_ribbon(places[(k - 1) // piece * piece : k + 1], width, height)
            stage.add(robot.layer_name, trail, times[k] + FRAME_SLACK)


def _play_motions(meshcat: Meshcat, world: World, height: float, robots: Sequence[_Body], rate: int) -> SceneTimeline:
    """Show a world's obstacles, of a height, m, and how they and robots move, in frames of a rate, also in Meshcat."""
    times = np.arange(0.0, max(body.motion.duration for body in robots) + 1.0 / rate, 1.0 / rate)
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    add_still_obstacles(plant, world, height)
    plant.Finalize()
    source = scene_graph.RegisterSource("bodies")
    bodies = [*robots, *_make_moving_bodies(world.moving_obstacles, height, times)]
    motions = {_register_body(scene_graph, source, body): body.motion for body in bodies}
    add_scene(builder, plant, scene_graph, meshcat, find_floor_geometries(plant, scene_graph))
    return _move_bodies(builder.Build(), scene_graph, source, motions, times)


def _move_bodies(
    diagram: Diagram, scene_graph: SceneGraph, source: SourceId, motions: Mapping[FrameId, Motion], times: np.ndarray
) -> SceneTimeline:
    """Let the frames of a scene be where they are at each of the times, s, and let what shows the scene show it."""
    scene, context = SceneTimeline(scene_graph), diagram.CreateDefaultContext()
    scene_context, poses = scene_graph.GetMyContextFromRoot(context), FramePoseVector()
    for time in times.tolist():
        for frame, motion in motions.items():
            x, y, yaw = motion.at(time)
            poses.set_value(frame, RigidTransform(RotationMatrix.MakeZRotation(yaw), [x, y, 0.0]))
        context.SetTime(time + FRAME_SLACK)
        scene_graph.get_source_pose_port(source).FixValue(scene_context, poses)
        diagram.ForcedPublish(context)
        scene.note(scene_graph.get_query_output_port().Eval(scene_context), time)
    return scene


def _make_moving_bodies(obstacles: MovingObstacles, height: float, times: np.ndarray) -> list[_Body]:
    positions, _ = moving_obstacle_states(obstacles, times)
    paths, color = np.insert(positions, 2, 0.0, axis=2).swapaxes(0, 1), meshes.MOVING_OBSTACLES.color
    return [
        _Body(f"moving_obstacle_{k}", Motion(times, path), [_Part(Cylinder(radius, height), 0.0, 0.5 * height, color)])
        for k, (radius, path) in enumerate(zip(obstacles.radii, paths, strict=True))
    ]


def _register_body(scene_graph: SceneGraph, source: SourceId, body: _Body) -> FrameId:
    """Let a scene show a body; returns the frame that moves it."""
    frame = scene_graph.RegisterFrame(source, GeometryFrame(body.name))
    for k, part in enumerate(body.parts):
        instance = GeometryInstance(RigidTransform([part.ahead, 0.0, part.height]), part.shape, f"{body.name}_{k}")
        instance.set_illustration_properties(MakePhongIllustrationProperties([*part.color, 1.0]))
        scene_graph.RegisterGeometry(source, frame, instance)
    return frame


def _make_robot_body(robot: RobotTrack, layers: dict[str, meshes.Layer], floor: float) -> _Body:
    """A hull in its trail's colour, as high as the robot, with a light deck, a bar ahead and a lidar, on a floor, m."""
    shape, height = robot.scenario.robot.shape, body_top(robot.scenario)
    radius, top = shape.radius, floor + height
    hulls = [make_upright_prism(part, height, robot.name) for part in shape.parts] or [Cylinder(radius, height)]
    parts = [_Part(hull, 0.0, top - 0.5 * height, layers[robot.layer_name].color) for hull in hulls]
    if shape.is_disc:
        parts.append(_Part(Cylinder(0.55 * radius, 0.004), 0.0, top, meshes.DECK_COLOR))
    parts.append(_Part(Box(0.8 * radius, 0.2 * radius, 0.008), 0.4 * radius, top, meshes.HEADING_COLOR))
    parts.append(_Part(Cylinder(0.24 * radius, 0.016), 0.0, top, meshes.LIDAR_COLOR))
    return _Body(f"robots/{robot.name}", robot.motion, parts)
