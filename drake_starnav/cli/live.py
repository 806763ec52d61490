"""A run that is watched while it happens: buttons start, pause and stop it, sliders move the goal."""

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from pydrake.geometry import Meshcat, MeshcatParams
from pydrake.systems.analysis import Simulator, SimulatorStatus
from pydrake.systems.framework import DiagramBuilder

from drake_starnav.navigation import add_navigation
from drake_starnav.planning import PlannerStatus
from drake_starnav.scenario import Scenario
from drake_starnav.simulation import add_collision_monitor
from drake_starnav.station.model_world import make_world_with_footprints
from drake_starnav.visualization.camera import VIEWS, around_robot, camera_presets
from drake_starnav.visualization.page import Cameras, Caption
from drake_starnav.visualization.recorder import (
    add_visualizers,
    finish_recording,
    frame_camera,
    robot_path,
    set_look,
    start_recording,
)
from drake_starnav.visualization.slider_goal import SliderGoal, add_goal_sliders
from drake_starnav.worlds.world import World

START, PAUSE, STOP = "start", "pause", "stop"
KEYS = {START: "KeyS", PAUSE: "Space", STOP: "Escape"}
"""Buttons and the keys that press them; each of `camera.VIEWS` has a button as well."""
STEP = 0.05
"""Polling period of the buttons in simulated time, s."""
POLL = 0.05
"""Polling period of the buttons while nothing runs, s."""


class Controls:
    """The buttons in Meshcat's panel.

    Attributes:
        running: whether the robot is to drive.
        stopped: whether the run is to end.
        view: the last chosen camera preset.
    """

    def __init__(self, meshcat: Meshcat, world: World) -> None:
        self.running, self.stopped, self.view = False, False, "top"
        self._meshcat, self._world = meshcat, world
        for name in (*KEYS, *VIEWS):
            meshcat.AddButton(name, KEYS.get(name, ""))
        self._clicks = self._count()
        frame_camera(meshcat, world.extent, panel="right")

    def poll(self, pose: np.ndarray) -> None:
        """Apply the clicks since the last call.

        Args:
            pose: of the robot, (x, y, yaw), W, m and rad.
        """
        clicks = self._count()
        pressed = {name for name, count in clicks.items() if count > self._clicks[name]}
        self._clicks = clicks
        self.stopped = self.stopped or STOP in pressed
        if pressed & {START, PAUSE}:
            self.running = PAUSE not in pressed
        for view in pressed & set(VIEWS):
            self.view = view
        if pressed & set(VIEWS) or self.view == "follow":
            extent = around_robot(pose) if self.view == "follow" else self._world.extent
            frame_camera(self._meshcat, extent, self.view, panel="right")

    def _count(self) -> dict[str, int]:
        return {name: self._meshcat.GetButtonClicks(name) for name in (*KEYS, *VIEWS)}


class LiveRun:
    """A scenario in an open Meshcat page.

    Attributes:
        meshcat: the page; its address is `meshcat.web_url()`.
        controls: its buttons.
        simulator: of the diagram.
        outcome: why the run ended, in words; empty while it runs.
        collided: whether it ended because the robot touched an obstacle or a moving obstacle hit it.
    """

    def __init__(
        self,
        scenario: Scenario,
        *,
        seed: int = 0,
        real_time_rate: float = 1.0,
        html: Path | None = None,
        say: Callable[[str], None] = print,
    ) -> None:
        """
        Args:
            scenario: the parameters.
            seed: of the world and of the sensor's noise.
            real_time_rate: simulated time over real time at most; 0 for as fast as it goes.
            html: file for a recording, if any; the page then slows down as the recording grows.
            say: called with each event as a text.

        Raises:
            StarnavError: the world cannot be made.
        """
        world = make_world_with_footprints(scenario.world, seed, scenario.robot.radius)
        self.meshcat = Meshcat(MeshcatParams(host="localhost"))
        set_look(self.meshcat)
        self.controls = Controls(self.meshcat, world)
        builder = DiagramBuilder()
        goal = SliderGoal(world.goal, add_goal_sliders(self.meshcat, world))
        self._navigation = add_navigation(builder, scenario, seed=seed, world=world, goal=goal)
        add_collision_monitor(builder, self._navigation)
        add_visualizers(builder, self._navigation, scenario, self.meshcat, keep=html is not None)
        self.simulator = Simulator(builder.Build())
        self.simulator.set_target_realtime_rate(real_time_rate)
        if html is not None:
            start_recording(self.meshcat, scenario.recording, live=True)
        self.simulator.Initialize()
        self.outcome, self.collided = "", False
        self._scenario, self._html, self._say = scenario, html, say
        self._said = ""

    @property
    def time(self) -> float:
        """Simulated, s."""
        return self.simulator.get_context().get_time()

    @property
    def pose(self) -> np.ndarray:
        """Of the robot now, (x, y, yaw), W, m and rad."""
        port = self._navigation.localization("pose")
        return port.Eval(port.get_system().GetMyContextFromRoot(self.simulator.get_context()))

    @property
    def goal(self) -> np.ndarray:
        """Where the robot is to go now, (x, y), W, m."""
        system = self._navigation.goal
        return system.get_output_port().Eval(system.GetMyContextFromRoot(self.simulator.get_context()))

    def step(self) -> bool:
        """Poll the buttons, then drive on for `STEP` or wait for `POLL`.

        Returns:
            whether the run goes on.
        """
        was_running = self.controls.running
        self.controls.poll(self.pose)
        if self.controls.stopped:
            self._end(f"stopped after {self.time:.1f} s")
        elif not self.controls.running:
            time.sleep(POLL)
        else:
            if not was_running:
                self.simulator.ResetStatistics()  # or it would catch up on the paused time
            status = self.simulator.AdvanceTo(self.time + STEP)
            if status.reason() != SimulatorStatus.ReturnReason.kReachedBoundaryTime:
                self.collided = True
                self._end(f"{status.message().split()[0]} after {self.time:.1f} s")
            else:
                self._tell()
        return not self.outcome

    def run(self) -> None:
        """Follow the buttons until the run ends, or until it is interrupted from the keyboard."""
        try:
            while self.step():
                pass
        except KeyboardInterrupt:
            self._end(f"stopped after {self.time:.1f} s")

    def finish(self, method: str, seed: int) -> None:
        """Write the recording, if requested, and remove the buttons from the page.

        Raises:
            StarnavError: the file cannot be written.
        """
        self.meshcat.DeleteAddedControls()
        if self._html is not None:
            world, station = self._navigation.world, self._navigation.station
            caption = Caption(self._scenario.name, (f"method {method}, seed {seed}, live", self.outcome))
            cameras = Cameras(camera_presets(world), "top", robot_path(station), world.start[:2])
            finish_recording(self.meshcat, self._html, caption, cameras)

    def _end(self, outcome: str) -> None:
        self.outcome = outcome
        self._say(outcome)

    def _tell(self) -> None:
        """Report whether the goal has been reached or is unreachable, if that has changed."""
        planner, status = self._navigation.planner, None
        if planner is not None:
            status = planner.GetOutputPort("status").Eval(planner.GetMyContextFromRoot(self.simulator.get_context()))
        now = "on its way"
        if np.hypot(*(self.pose[:2] - self.goal)) < self._scenario.simulation.goal_tolerance:
            now = "reached the goal"
        elif status is PlannerStatus.UNREACHABLE:
            now = "found no way to the goal"
        if now != self._said:
            self._say(f"{self.time:6.1f} s: {now}")
        self._said = now
