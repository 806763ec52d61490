"""The log of a drive on a robot -> the same recording as of a simulated run: its scene is the robot alone."""

import functools
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from pydrake.common.value import Value
from pydrake.geometry import GeometryId, SceneGraph
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem, OutputPort
from pydrake.systems.rendering import MultibodyPositionToGeometryPose

from drake_starnav.errors import StarnavError
from drake_starnav.navigation import Navigation
from drake_starnav.runtime import Navigator, read_log
from drake_starnav.station.navigation_station import Station
from drake_starnav.station.planar_localization import PLANAR
from drake_starnav.station.robot_model import add_robot
from drake_starnav.station.world_geometry import add_ground
from drake_starnav.systems.release import declare_value, declare_vector, release
from drake_starnav.systems.star_perception import lidar_names
from drake_starnav.worlds.world import World

if TYPE_CHECKING:
    from drake_starnav.visualization.recorder import Recorder
    from drake_starnav.visualization.timeline import RecordedRun

BORDER = 2.5
"""Around the places where the robot was, m."""


class NavigatorView(LeafSystem):
    """What a navigator knows and commands, as ports of a system that is drawn; `update_values` takes what they show.

    Of a `RobotInterface` it has what a `Station` asks of it to be drawn.
    """

    def __init__(
        self, navigator: Navigator, plant: MultibodyPlant, model: ModelInstanceIndex, ground: GeometryId
    ) -> None:
        super().__init__()
        self._navigator, self._plant, self._plant_context = navigator, plant, plant.CreateDefaultContext()
        self._base = plant.GetBodyByName("base_link", model)
        self.base_frame = plant.GetBodyFrameIdOrThrow(self._base.index())
        self._height = plant.EvalBodyPoseInWorld(self._plant_context, self._base).translation()[2]
        self.scenario, self.mounts, self.model, self.floor = navigator.scenario, navigator.mounts, model, [ground]
        self._sources = _list_shown_ports(navigator.navigation, len(navigator.mounts))
        self.values: dict[str, Any] = {}
        self.update_values()
        for name, value in self.values.items():
            read = functools.partial(lambda name, view, context: view.values[name], name)
            if isinstance(value, np.ndarray):
                declare_vector(self, name, len(value), read)
            else:
                declare_value(self, name, Value[object](value).get_value(), read)

    def update_values(self) -> None:
        """Show what the navigator knows now."""
        for name, port in self._sources.items():
            value = self._navigator.value(port)
            self.values[name] = np.array(value) if isinstance(value, np.ndarray) else value
        self.values["positions"] = self._make_positions(*self.values["localization.pose"])

    def _make_positions(self, x: float, y: float, yaw: float) -> np.ndarray:
        """Of the plant, with the robot there, m and rad."""
        if self._plant.num_positions() == PLANAR:
            return np.array((x, y, yaw))
        X_WB = RigidTransform(RotationMatrix.MakeZRotation(yaw), [x, y, self._height])
        self._plant.SetFreeBodyPose(self._plant_context, self._base, X_WB)
        return self._plant.GetPositions(self._plant_context)


def _list_shown_ports(navigation: Navigation, lidar_count: int) -> dict[str, OutputPort]:
    """The ports of a navigation that are drawn, as far as it has them, by the names that they get."""
    ports = {
        "localization.pose": navigation.localization("pose"),
        "localization.scan_pose": navigation.localization("scan_pose"),
        "goal": navigation.goal_position,
        "twist_command": navigation.twist_command,
        "certificate": navigation.certificate,
        "planner_state": navigation.planned("planner_state"),
        "guidance": navigation.planned("guidance"),
    }
    names = [f"{lidar}.scan" for lidar in lidar_names("lidar", lidar_count)]
    ports |= {name: navigation.station.GetOutputPort(name) for name in names}
    return {name: port for name, port in ports.items() if port is not None}


def record_log(path: Path, html: Path, *, view: str = "top", shown: frozenset[str] | None = None) -> "RecordedRun":
    """Navigate again by a log, and record what the robot saw, knew and decided; arguments as in `Recorder`.

    Raises:
        StarnavError: the file is no log, or the robot was nowhere.
    """
    from drake_starnav.visualization.recorder import Recorder  # late: it loads Meshcat

    world, log = _make_world_around(path), read_log(path)
    navigator, builder, recorder = log.make_navigator(), DiagramBuilder(), Recorder(html, view, shown)
    navigator_view = _add_scene(builder, navigator, world, recorder)
    diagram = builder.Build()
    simulator, begin, command = Simulator(diagram), math.nan, None
    for inputs, *_ in log.ticks:
        command = navigator.step(*inputs)
        begin = inputs[0] if math.isnan(begin) else begin
        navigator_view.update_values()
        if inputs[0] - begin > simulator.get_context().get_time():
            simulator.AdvanceTo(inputs[0] - begin)
    assert command is not None
    recorder.finish((f"log {path.name}", f"{command.status} after {simulator.get_context().get_time():.1f} s"))
    release(diagram)
    assert recorder.recorded is not None
    return recorder.recorded


def _add_scene(builder: DiagramBuilder, navigator: Navigator, world: World, recorder: "Recorder") -> NavigatorView:
    """Add the robot of a navigator in a world, what the navigator knows, and what records both."""
    scene_graph, plant = builder.AddNamedSystem("scene_graph", SceneGraph()), MultibodyPlant(0.01)
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    model = add_robot(plant, scene_graph, navigator.scenario.robot, world.start)
    ground = add_ground(plant, world.extent)
    plant.Finalize()
    view = builder.AddNamedSystem("navigator_view", NavigatorView(navigator, plant, model, ground))
    pose_system = builder.AddSystem(MultibodyPositionToGeometryPose(plant))
    builder.Connect(view.GetOutputPort("positions"), pose_system.get_input_port())
    builder.Connect(pose_system.get_output_port(), scene_graph.get_source_pose_port(plant.get_source_id()))
    station = Station(plant, scene_graph, cast(Any, view), ground, [], world)
    recorder.add_to(builder, Navigation(world, station, view, None, view, shield=view), navigator.scenario)
    return view


def _make_world_around(path: Path) -> World:
    """An empty world about where a robot was, from its first pose to its last goal."""
    poses: list[tuple[float, float, float]] = []
    goal: tuple[float, ...] | None = None
    for tick in read_log(path).ticks:
        poses += [(row.x, row.y, row.yaw) for row in tick.inputs[2] if row is not None and all(map(math.isfinite, row))]
        goal = tick.inputs[3] or goal
    if not poses:
        raise StarnavError(f"{path} has no pose of the robot; allowed: the log of a drive")
    goal = poses[-1] if goal is None or not all(map(math.isfinite, goal)) else goal
    places = np.array([*poses, (*goal[:2], 0.0)])[:, :2]
    (x0, y0), (x1, y1) = (places.min(axis=0) - BORDER).tolist(), (places.max(axis=0) + BORDER).tolist()
    return World(path.stem, poses[0], (float(goal[0]), float(goal[1])), bounds=(x0, y0, x1, y1))
