"""A run that is watched while it happens: buttons start, pause and stop it, sliders move the goal."""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.geometry import Cylinder, Meshcat, Rgba
from pydrake.systems.analysis import SimulatorStatus
from pydrake.systems.framework import DiagramBuilder

from drake_starnav.navigation import Parts, add_navigation
from drake_starnav.navigation.robot import robot_world
from drake_starnav.planning import PlannerStatus
from drake_starnav.scenario.schema import Scenario
from drake_starnav.simulation.robots import add_robots, make_worlds_of_robots
from drake_starnav.station.lidar_mounts import find_collar_geometries
from drake_starnav.station.monitors import CollisionMonitor
from drake_starnav.station.navigation_station import StationInterface, add_station, simulated
from drake_starnav.station.plant import advance, evaluate_port, make_simulator
from drake_starnav.visualization.goal_sliders import SliderGoal, add_goal_sliders
from drake_starnav.visualization.meshcat_stage import MeshcatStage, add_scene, start_quiet_meshcat
from drake_starnav.visualization.meshes import LAYERS, Layer, add_scene_layers, list_layers_of_run, make_goal_star
from drake_starnav.visualization.page import ROOT, Cameras, Caption
from drake_starnav.visualization.recorder import (
    add_visualizers,
    find_robot_frames,
    find_robot_path,
    finish_recording,
    make_robot_layer,
    select_drawn_layers,
)
from drake_starnav.visualization.timeline import SceneTimeline
from drake_starnav.visualization.tracks import make_trail_layer

START, PAUSE, STOP = "start", "pause", "stop"
KEYS = {START: "KeyS", PAUSE: "Space", STOP: "Escape"}
"""Buttons and the keys that press them."""
POLL = 0.05
"""Polling period of the buttons, in simulated time or while nothing runs, s."""


class Controls:
    """The buttons in Meshcat's panel: whether the robot is to drive, and whether the run is to end."""

    def __init__(self, meshcat: Meshcat) -> None:
        self.running, self.stopped = False, False
        self._meshcat = meshcat
        for name, key in KEYS.items():
            meshcat.AddButton(name, key)
        self._clicks = self._count()

    def poll(self) -> None:
        """Apply the clicks since the last call."""
        click_counts = self._count()
        pressed_buttons = {name for name, count in click_counts.items() if count > self._clicks[name]}
        self._clicks = click_counts
        self.stopped = self.stopped or STOP in pressed_buttons
        if pressed_buttons & {START, PAUSE}:
            self.running = PAUSE not in pressed_buttons

    def _count(self) -> dict[str, int]:
        return {name: self._meshcat.GetButtonClicks(name) for name in KEYS}


class LiveRun:
    """A scenario in Drake's own Meshcat page.

    Attributes:
        meshcat: the scene; `meshcat.web_url()` is where to watch.
        controls: its buttons.
        simulator: of the diagram.
        progress_text: how far the drive has come, in words.
        outcome: why the run ended, in words; empty while it runs.
        collided: whether it ended because the robot touched an obstacle or a moving obstacle hit it.
    """

    def __init__(
        self,
        scenario: Scenario,
        *,
        method: str = "star",
        seed: int = 0,
        real_time_rate: float = 1.0,
        html: Path | None = None,
    ) -> None:
        """
        Args:
            method: its name, for the caption.
            seed: of the world and of the sensor's noise.
            real_time_rate: simulated time over real time at most; 0 for as fast as it goes.
            html: file for a recording, if any; the page then slows down as the recording grows.

        Raises:
            StarnavError: the world cannot be made.
        """
        self.meshcat = start_quiet_meshcat()
        self.controls = Controls(self.meshcat)
        self._scenario, self._seed, self._html = scenario, seed, html
        builder = DiagramBuilder()
        self._add_to(builder)
        world = self._world
        self.simulator = make_simulator(builder.Build(), settings=scenario.simulator_config)
        self.simulator.set_target_realtime_rate(real_time_rate)
        if html is not None:
            self.meshcat.StartRecording(scenario.recording.frames_per_second)  # and an open page follows
        self.simulator.Initialize()
        self.outcome, self.progress_text, self.collided = "", "", False
        self._cameras = Cameras(world.extent, "top", find_robot_path(self._followed), world.start[:2])
        x0, y0, x1, y1 = world.extent
        world_middle = np.array([0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.0])
        camera_offset = np.array([0.0, -0.01, 1.0]) * max(x1 - x0, y1 - y0)  # straight down, "up" would be undefined
        self.meshcat.SetCameraPose(world_middle + camera_offset, world_middle)
        self._line = f"method {method}, seed {seed}, live"

    def _add_to(self, builder: DiagramBuilder) -> None:
        """Make the world, and add all systems to a diagram."""
        scenario, seed = self._scenario, self._seed
        world = self._world = robot_world(scenario, seed)
        goal = SliderGoal(world.goal, add_goal_sliders(self.meshcat, world))
        self._followed = add_station(builder, world, scenario, continuous=True, seed=seed)
        self._navigation = add_navigation(builder, scenario, Parts(world, self._followed, goal), seed)
        CollisionMonitor.AddToBuilder(builder, self._followed)
        keeps_page = self._html is not None
        self._shapes = add_visualizers(builder, self._navigation, scenario, self.meshcat, keep=keeps_page).stage.shapes

    def _list_layers(self) -> dict[str, Layer]:
        """Return the layers that a legend may list."""
        robot = make_robot_layer(SceneTimeline(self._followed.scene_graph), self._followed)
        return list_layers_of_run(self._scenario.robot.max_speed, self._world, robot)

    @property
    def time(self) -> float:
        """Simulated, s."""
        return self.simulator.get_context().get_time()

    @property
    def pose(self) -> np.ndarray:
        """Where the robot is now: (x, y, yaw), W, m and rad."""
        return evaluate_port(self._navigation.localization("pose"), self.simulator.get_context())

    @property
    def goal(self) -> np.ndarray:
        """Where the robot is to go now, (x, y), W, m."""
        return evaluate_port(self._navigation.goal_position, self.simulator.get_context())

    def step(self) -> bool:
        """Poll the buttons, then drive on or wait for `POLL`; returns whether the run goes on."""
        was_running = self.controls.running
        self.controls.poll()
        if self.controls.stopped:
            self.outcome = f"stopped after {self.time:.1f} s"
        elif not self.controls.running:
            time.sleep(POLL)
        else:
            if not was_running:
                self.simulator.ResetStatistics()  # or it would catch up on the paused time
            status = advance(self.simulator, POLL * (round(self.time / POLL) + 1))  # where events end steps anyway
            if status.reason() != SimulatorStatus.ReturnReason.kReachedBoundaryTime:
                self.collided = True
                self.outcome = f"{status.message().rpartition(' at ')[0]} after {self.time:.1f} s"
            else:
                self.progress_text = self._describe_progress()
        return not self.outcome

    def run(self, quiet: bool = False) -> None:
        """Follow the buttons until the run ends, or until it is interrupted from the keyboard; tell how far it has
        come, unless it is to be quiet."""
        printed_text = ""
        try:
            while self.step():
                if not quiet and self.progress_text != printed_text:
                    printed_text = self.progress_text
                    print(f"{self.time:6.1f} s: {printed_text}")
        except KeyboardInterrupt:
            self.outcome = f"stopped after {self.time:.1f} s"
        if not quiet:
            print(self.outcome)

    def finish(self) -> None:
        """Write the recording, if requested, and remove the buttons from the page; a `StarnavError` if it cannot be
        written."""
        self.meshcat.DeleteAddedControls()
        if self._html is not None:
            layers = select_drawn_layers(self._list_layers(), self._shapes, self._world)
            caption = Caption(self._scenario.name, (self._line, self.outcome), layers)
            finish_recording(self.meshcat, self._html, caption, self._cameras)

    def _describe_progress(self) -> str:
        """Whether the goal has been reached or is unreachable, in words."""
        port = self._navigation.planned("status")
        status = None if port is None else evaluate_port(port, self.simulator.get_context())
        if np.hypot(*(self.pose[:2] - self.goal)) < self._scenario.simulation.goal_tolerance:
            return "reached the goal"
        status_texts = {PlannerStatus.UNREACHABLE: "found no way to the goal", PlannerStatus.BLOCKED: "blocked"}
        return "on its way" if status is None else status_texts.get(status, "on its way")


class LiveRobots(LiveRun):
    """A scenario of several robots in an open Meshcat page: each drives to its own goals."""

    def _add_to(self, builder: DiagramBuilder) -> None:
        scenario = self._scenario
        worlds = make_worlds_of_robots(scenario, self._seed)
        self._world = worlds[0]
        self._driven_robots = add_robots(builder, scenario, worlds, self._seed)
        stations = [simulated(each.navigation.station) for each in self._driven_robots]
        self._followed = stations[0]
        self._add_scene(builder, stations)
        self._mark_robots_and_goals(stations)

    def _add_scene(self, builder: DiagramBuilder, stations: Sequence[StationInterface]) -> None:
        """Show all robots, in a scene from which nothing is removed when the run begins."""
        plant, scene_graph = self._followed.plant, self._followed.scene_graph
        hidden_geometries = [*self._followed.floor, *find_collar_geometries(scene_graph)]
        links = [frame for station in stations for frame in find_robot_frames(station)]
        period = 1.0 / self._scenario.recording.frames_per_second
        looks: dict[str, Any] = {"publish_period": period, "delete_on_initialization_event": False}
        add_scene(builder, plant, scene_graph, self.meshcat, hidden_geometries, robot=links, **looks)

    def _mark_robots_and_goals(self, stations: Sequence[StationInterface]) -> None:
        """Give each robot a rim and its goals stars in its colour."""
        layers = self._list_layers()
        stage = MeshcatStage(self.meshcat, f"/{ROOT}", 1.0 / self._scenario.recording.frames_per_second, layers)
        self._shapes = stage.shapes
        for (name, layer), robot, station in zip(layers.items(), self._scenario.robots, stations, strict=False):
            for goal in robot.goals:
                stage.add(name, make_goal_star(goal, robot.robot.radius, self._world.extent), 0.0)
            rim = Cylinder(1.15 * robot.robot.radius, LAYERS["goal"].height)
            self.meshcat.SetObject(f"{find_robot_path(station)}/rim", rim, Rgba(*layer.color))

    def _list_layers(self) -> dict[str, Layer]:
        trails = (make_trail_layer(robot.name, "its goals", k) for k, robot in enumerate(self._scenario.robots))
        return add_scene_layers(dict(trails), self._world)

    def _describe_progress(self) -> str:
        context = self.simulator.get_context()
        arrived_count = sum(each.has_arrived(context) for each in self._driven_robots)
        return f"{arrived_count} of {len(self._driven_robots)} have reached their goals"
