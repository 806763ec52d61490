"""Records a run of a navigation diagram: the look of the scene, the page, the file."""

import dataclasses
import math
import os
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
from pydrake.geometry import FrameId, Meshcat
from pydrake.systems.framework import DiagramBuilder

from drake_starnav.errors import StarnavError, check_kind
from drake_starnav.geometry.trajectory import Motion
from drake_starnav.navigation import Navigation
from drake_starnav.scenario.schema import Scenario
from drake_starnav.station.navigation_station import StationInterface, simulated
from drake_starnav.utils.files import write_text
from drake_starnav.visualization.meshcat_stage import WORLD_PREFIX, add_scene, start_quiet_meshcat
from drake_starnav.visualization.meshes import DECK_COLOR, ROBOT, Layer, add_scene_layers, list_layers_of_run
from drake_starnav.visualization.page import ROOT, Cameras, Caption, add_panel, check_view
from drake_starnav.visualization.star_roadmap_visualizer import StarRoadmapVisualizer
from drake_starnav.visualization.timeline import RecordedRun, SceneRecorder, SceneTimeline
from drake_starnav.worlds.world import World


class Recorder:
    """Records one run of a diagram, from its first moment: its scene, and what the robot sees and decides.

    `recorded` is what is needed to draw pictures of the run, once it has ended.
    """

    def __init__(self, html: str | os.PathLike, view: str = "top", shown: frozenset[str] | None = None) -> None:
        """
        Args:
            html: the file to write.
            view: camera preset that it opens with, one of `page.VIEWS`, or `own` for the camera of your own Meshcat;
                others are a `StarnavError`.
            shown: layers that are shown at first, of `meshes.select_layers`; None for all.
        """
        check_view(view)
        self._html, self._view, self._shown = html, view, shown
        self.recorded: RecordedRun | None = None

    @classmethod
    def AddToBuilder(
        cls,
        builder: DiagramBuilder,
        navigation: Navigation,
        html: str | os.PathLike,
        scenario: Scenario | None = None,
        view: str = "top",
        meshcat: Meshcat | None = None,
    ) -> "Recorder":
        """Add a recorder; arguments are those of its construction and of `add_to`."""
        recorder = cls(html, view)
        recorder.add_to(builder, navigation, scenario, meshcat)
        return recorder

    def add_to(
        self,
        builder: DiagramBuilder,
        navigation: Navigation,
        scenario: Scenario | None = None,
        meshcat: Meshcat | None = None,
    ) -> None:
        """Add visualizers, and let Meshcat record what they and others draw into it.

        Args:
            navigation: what `add_navigation` put into the same builder, or a `Navigation` of whichever systems exist.
            scenario: whose name and parameters `recording` and `robot` are used; None: the world's name, and defaults.
            meshcat: of your own, whose objects, other visualizers and camera enter the page; None for one that nobody
                else sees.
        """
        check_kind(navigation, Navigation, "navigation", "as from add_navigation")
        scenario = scenario or Scenario(navigation.world.name, None)
        self._meshcat = meshcat or start_quiet_meshcat()
        self._navigation, self._scenario = navigation, scenario
        self._shapes = add_visualizers(builder, navigation, scenario, self._meshcat).stage.shapes
        station = simulated(navigation.station)
        self._scene = SceneTimeline(station.scene_graph, find_robot_frames(station))
        scene_recorder = SceneRecorder(self._scene, period=1.0 / scenario.recording.frames_per_second)
        scene_recorder = builder.AddNamedSystem("scene_recorder", scene_recorder)
        builder.Connect(station.geometry_query, scene_recorder.get_input_port())
        frame_rate, is_live = scenario.recording.frames_per_second, meshcat is not None
        self._meshcat.StartRecording(frame_rate, set_visualizations_while_recording=is_live)

    def finish(self, lines: tuple[str, ...] = (), motion: Motion | None = None) -> None:
        """End the recording and write it, or raise a `StarnavError`.

        Args:
            lines: of the caption, below the scenario's name.
            motion: of the robot; None for the one that was recorded.
        """
        world, station = self._navigation.world, simulated(self._navigation.station)
        base_poses = self._scene.frames[station.robot_interface.base_frame]
        if not base_poses.times:
            raise StarnavError("the diagram was not simulated, and nothing is recorded; allowed: after AdvanceTo")
        layers = list_layers_of_run(self._scenario.robot.max_speed, world, make_robot_layer(self._scene, station))
        layers = select_drawn_layers(layers, self._shapes, world)
        caption = Caption(self._scenario.name, lines, layers, self._shown)
        cameras = Cameras(world.extent, self._view, find_robot_path(station), world.start[:2])
        finish_recording(self._meshcat, self._html, caption, cameras)
        if motion is None:
            X_WB = np.array(base_poses.values)
            yaw = np.arctan2(X_WB[:, 1, 0], X_WB[:, 0, 0])
            motion = Motion(np.array(base_poses.times), np.column_stack((X_WB[:, :2, 3], yaw)))
        self.recorded = RecordedRun(caption, world.extent, self._scene, self._shapes, (motion,))

    def save(
        self,
        path: str | os.PathLike,
        time: float = math.inf,
        view: str = "top",
        width: float | None = None,
        speed: float = 2.0,
        rate: int = 10,
    ) -> None:
        """Write a picture of the finished run from above, by the end of its name, without a browser.

        Args:
            path: PNG, SVG or PDF for a still; GIF or MP4 for a clip.
            time: of a still, s; by default the end.
            view: `top` or `follow`, of PNG, GIF and MP4.
            width: inches for SVG and PDF, e.g. 3.5 for a column of a paper (default: 11), otherwise pixels (1100).
            speed, rate: of a clip, times real time, and pictures a second.

        Raises:
            StarnavError: the run has not been finished, or the file cannot be written.
        """
        from drake_starnav.visualization import pictures  # Matplotlib is an extra

        file, suffixes = Path(path), pictures.STILLS + pictures.CLIPS
        if file.suffix not in suffixes:
            raise StarnavError(f"picture {path}; allowed: a name that ends in {', '.join(suffixes)}")
        if self.recorded is None:
            raise StarnavError("the recorder has recorded no run yet; allowed: after finish")
        if file.suffix in pictures.STILLS:
            pictures.write_still(file, self.recorded, time, view, width)
        else:
            pictures.write_clips([file], self.recorded, view, round(width or pictures.PIXELS), speed, rate)


def add_visualizers(
    builder: DiagramBuilder, navigation: Navigation, scenario: Scenario, meshcat: Meshcat, keep: bool = True
) -> StarRoadmapVisualizer:
    """Add what draws the scene, and what draws into Meshcat what the robot sees and decides; returns the second.

    `keep`: whether what is no longer shown stays in Meshcat, as a recording needs it; the rest is as of
    `Recorder.add_to`.
    """
    station = simulated(navigation.station)
    period = 1.0 / scenario.recording.frames_per_second
    scene = station.plant, station.scene_graph, meshcat, station.floor, station.geometry_query
    add_scene(builder, *scene, find_robot_frames(station), publish_period=period)
    return StarRoadmapVisualizer.AddToBuilder(builder, navigation, meshcat, scenario, keep)


def select_drawn_layers(layers: Mapping[str, Layer], shapes: Iterable[str], world: World) -> dict[str, Layer]:
    """Return those rows of a legend of which something was drawn, by the paths of `shapes`, and those of the scene."""
    drawn_paths, in_scene = {path.removeprefix(f"/{ROOT}/") for path in shapes}, add_scene_layers({}, world)
    return {k: v for k, v in layers.items() if k in in_scene or any(path.startswith(f"{k}/") for path in drawn_paths)}


def make_robot_layer(scene: SceneTimeline, station: StationInterface) -> Layer:
    """The row of the legend for a robot, in the colour of its largest part in a scene."""
    robot_poses = [scene.frames[frame] for frame in find_robot_frames(station) if frame in scene.frames]
    robot_parts = [part for part in scene.solids if any(part.poses is poses for poses in robot_poses)]
    largest_part = max(robot_parts, key=lambda part: np.ptp(part.vertices, axis=0).prod(), default=None)
    color = ROBOT.color if largest_part is None else largest_part.color
    has_deck = any(np.allclose(part.color, DECK_COLOR) for part in robot_parts)
    return dataclasses.replace(ROBOT, color=color, symbol="robot" if has_deck else "disc")


def find_robot_frames(station: StationInterface) -> list[FrameId]:
    """The frames of the robot's links."""
    return [station.plant.GetBodyFrameIdOrThrow(i) for i in station.plant.GetBodyIndices(station.robot_model)]


def find_robot_path(station: StationInterface) -> str:
    """Where in Meshcat the robot's base is."""
    base = station.plant.GetBodyByName("base_link", station.robot_model)
    name = station.scene_graph.model_inspector().GetName(station.plant.GetBodyFrameIdOrThrow(base.index()))
    return f"{WORLD_PREFIX}/{name.replace('::', '/')}"


def finish_recording(meshcat: Meshcat, path: str | os.PathLike, caption: Caption, cameras: Cameras) -> None:
    """End the recording and write it as one HTML file that needs no network, or raise a `StarnavError`."""
    meshcat.StopRecording()
    meshcat.PublishRecording()
    write_text(Path(path), add_panel(meshcat.StaticHtml(), caption, cameras))
