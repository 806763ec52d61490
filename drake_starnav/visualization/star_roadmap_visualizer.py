"""Draws what the robot sees and decides into Meshcat, live or as a recording."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
import shapely
from pydrake.common.value import Value
from pydrake.geometry import Meshcat
from pydrake.systems.framework import Context, DiagramBuilder, EventStatus, InputPort, LeafSystem

from drake_starnav.geometry.footprint import Footprint
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.mounts import ON_AXIS, Mount, align_with_robot
from drake_starnav.navigation import Navigation
from drake_starnav.planning.guidance import Guidance
from drake_starnav.planning.parameters import PlannerParameters
from drake_starnav.planning.roadmap import StarRoadmap
from drake_starnav.planning.state import PlannerState
from drake_starnav.robot import RobotParameters
from drake_starnav.safety import KeepOut, SpeedZone
from drake_starnav.safety.certificates import Certificate
from drake_starnav.scenario.schema import RecordingParameters, Scenario
from drake_starnav.surroundings import StarRegion
from drake_starnav.systems.connecting import connect_inputs
from drake_starnav.systems.star_perception import lidar_names
from drake_starnav.visualization import meshes
from drake_starnav.visualization.meshcat_stage import MeshcatStage
from drake_starnav.visualization.meshes import LAYERS, LINE_WIDTH
from drake_starnav.visualization.page import ROOT
from drake_starnav.worlds.moving_obstacles import MovingObstacles, moving_obstacle_states
from drake_starnav.worlds.world import World

SCAN_POINTS = 180
"""Points of a scan that are drawn at most."""
NODE_RADIUS, FRONTIER_RADIUS = 0.05, 0.07
"""Of a roadmap node and of a frontier point in a world of usual size, m."""
SPACING = 8.0
"""Nodes, and frontier points, nearer than this to one that is drawn are left out, in radii of a node."""
LEAST_AREA = 1e-4
"""What a region adds to the area of all regions is drawn if it is larger, m^2."""
PLANNER_PORTS = {"guidance": Guidance, "planner_state": PlannerState}
"""What of a planner is drawn, by the names of its ports and what they carry."""
FRAME_SLACK = 1e-6
"""Meshcat's frame at time t is floor(t * frames_per_second): this keeps rounding from losing a frame, s."""


class StarRoadmapVisualizer(LeafSystem):
    """Draws scan, star-shaped regions, roadmap, frontiers, path, goals, trail, certificate and footprint into Meshcat.

    ```
                     ┌───────────────────────┐
    pose ───────────>│                       │
    scan ───────────>│                       │
    scan_pose ──────>│                       │
    guidance ───────>│                       │
    planner_state ──>│ StarRoadmapVisualizer │
    goal ───────────>│                       │
    twist ──────────>│                       │
    certificate ────>│                       │
                     └───────────────────────┘
    ```

    Ports, all of them in the world frame W; what is left unconnected is not drawn:
        pose: vector of size 3, (x, y, yaw) of the robot now, m and rad.
        scan: abstract, `LaserScan`, in the sensor frame S. Further lidars have the ports scan_2, scan_3, ...
        scan_pose: vector of size 3, (x, y, yaw) of the robot when the scan was taken.
        guidance: abstract, `Guidance` of any planner: its path, which begins with the short-term goal.
        planner_state: abstract, `PlannerState`: roadmap and frontiers.
        goal: vector of size 2, m.
        twist: vector that is commanded, as the base's twists are; its speed colours the trail.
        certificate: abstract, any object whose `path`, of shape (n, 2) or (n, 3), is the certified motion, m.

    Each layer of `meshes.LAYERS` is one folder below `ROOT` in Meshcat's panel and can be switched there.

    As in Drake's `MeshcatVisualizer`, what has been drawn is remembered by this system and not by the Context;
    initialization forgets it and clears the `stage`. A publish depends on the inputs and on that memory alone.
    """

    def __init__(
        self,
        meshcat: Meshcat,
        parameters: RecordingParameters,
        robot: RobotParameters,
        keep: bool = True,
        mounts: Sequence[Mount] = (ON_AXIS,),
        world: World | None = None,
        zones: Sequence[Certificate] = (),
    ) -> None:
        """
        Args:
        meshcat, parameters: to draw into, and how.
        robot: defines the radius and the maximum speed that are drawn.
        keep: whether hidden objects stay in Meshcat, as a recording needs them.
        mounts: where each lidar is on the robot; there are as many ports for scans.
        world: whose size scales the marks, and whose obstacles that move get arrows; None for one of usual size.
        zones: certificates, of which `KeepOut` and `SpeedZone` are drawn.
        """
        super().__init__()
        self._parameters = parameters
        self._robot = robot
        extent = (0.0, 0.0, 0.0, 0.0) if world is None else world.extent
        scale = meshes.choose_mark_scale(extent, robot.radius)
        self.stage = MeshcatStage(meshcat, f"/{ROOT}", 1.0 / parameters.frames_per_second, keep=keep, scale=scale)
        self._bodies = BodyMarks(self.stage, MovingObstacles() if world is None else world.moving_obstacles, scale)
        state = PlannerState.initial(PlannerParameters(), robot.radius)
        origin, self._line = np.zeros(2), scale * LINE_WIDTH
        node, self._frontier = scale * NODE_RADIUS, scale * FRONTIER_RADIUS
        self._node = node
        self._marks = {
            "goal": meshes.make_goal_star(origin, robot.radius, extent),
            "short_term_goal": meshes.make_ring(origin, 2.2 * node, 3.6 * node, LAYERS["short_term_goal"].height),
            "frontiers/target": meshes.make_ring(origin, 4.3 * node, 5.6 * node, LAYERS["frontiers/target"].height),
        }
        self._zones = [zone for zone in zones if isinstance(zone, meshes.ZONES)]
        self._nothing = state.roadmap
        self._drawn = _Drawn(self._nothing, self._zones)
        self.DeclareVectorInputPort("pose", 3)
        self._mounts = dict(zip(lidar_names("scan", len(mounts)), mounts, strict=True))
        for scan in self._mounts:
            self.DeclareAbstractInputPort(scan, Value[object](LaserScan.nothing()))
        self.DeclareVectorInputPort("scan_pose", 3)
        self.DeclareAbstractInputPort("guidance", Value[object](state.guidance))
        self.DeclareAbstractInputPort("planner_state", Value[object](state))
        self.DeclareVectorInputPort("goal", 2)
        self.DeclareVectorInputPort("twist", len(robot.drive.components))
        self.DeclareAbstractInputPort("certificate", Value[object](SimpleNamespace(path=np.zeros((0, 2)))))
        self.DeclareInitializationPublishEvent(self._clear)
        self.DeclarePeriodicPublishEvent(1.0 / parameters.frames_per_second, 0.0, self._publish)

    @staticmethod
    def AddToBuilder(
        builder: DiagramBuilder,
        navigation: Navigation,
        meshcat: Meshcat,
        scenario: Scenario | None = None,
        keep: bool = True,
    ) -> "StarRoadmapVisualizer":
        """Add a visualizer named `star_roadmap_visualizer`, and connect what a navigation in the builder has.

        `scenario` says how to draw, and what robot; None for that of the station. `keep` is as in the construction.
        """
        station, scenario = navigation.station, scenario or navigation.station.scenario
        zones = getattr(navigation.shield, "own_certificates", ())
        settings = scenario.recording, scenario.robot, keep, station.mounts, navigation.world, zones
        visualizer = builder.AddNamedSystem("star_roadmap_visualizer", StarRoadmapVisualizer(meshcat, *settings))
        names = (lidar_names(name, len(station.mounts)) for name in ("scan", "lidar"))
        sources = {
            **{scan: station.GetOutputPort(f"{lidar}.scan") for scan, lidar in zip(*names, strict=True)},
            **{name: navigation.localization(name) for name in ("pose", "scan_pose")},
            **{name: navigation.planned(name, kind) for name, kind in PLANNER_PORTS.items()},
            "goal": None if navigation.goal is None else navigation.goal_position,
            "twist": navigation.twist_command,
            "certificate": navigation.certificate,
        }
        sources = {name: port for name, port in sources.items() if port is not None}
        connect_inputs(builder, visualizer, sources, "star_roadmap_visualizer")
        return visualizer

    def _clear(self, context: Context) -> EventStatus:
        self.stage.clear()
        self._bodies.clear()
        self._drawn = _Drawn(self._nothing, self._zones)
        return EventStatus.Succeeded()

    def _publish(self, context: Context) -> EventStatus:
        time = context.get_time() + FRAME_SLACK
        pose, twist, state = (self._read_input(name, context) for name in ("pose", "twist", "planner_state"))
        self._draw_zones(time)
        self._mark("goal", self._read_input("goal", context), time)
        if state is not None:
            self._draw_frontiers(state, time)
            self._draw_roadmap(state.roadmap, time)
            self._mark("frontiers/target", None if state.route.exit is None else state.route.exit[0], time)
        self._bodies.draw_velocities(time)
        if pose is not None:
            self._bodies.draw_robot(pose, self._robot.shape, time)
            speed = 0.0 if twist is None else float(self._robot.drive.body_rates(twist)[0])
            self._drawn.trail.append((pose[0], pose[1], speed))
        # With half a frame of tolerance: publishes are as far apart as frames, up to rounding.
        if time + 0.5 / self._parameters.frames_per_second >= self._drawn.next_scan_time:
            self._drawn.next_scan_time = time + 1.0 / self._parameters.scan_rate
            scans = [(self._read_input(name, context), mount) for name, mount in self._mounts.items()]
            self._draw_scans(scans, self._read_input("scan_pose", context), time)
            self._draw_path(pose, self._read_input("guidance", context), time)
            self._draw_certificate(self._read_input("certificate", context), time)
            self._draw_trail(time)
        return EventStatus.Succeeded()

    def _draw_zones(self, time: float) -> None:
        """Draw the zones, once."""
        zones, self._drawn.undrawn_zones = self._drawn.undrawn_zones, []
        for zone in zones:
            layer = meshes.name_zone_layer(zone)
            self.stage.add(layer, meshes.make_area(shapely.Polygon(zone.polygon), LAYERS[layer].height), time)

    def _read_input(self, name: str, context: Context) -> Any:
        port: InputPort = self.GetInputPort(name)
        return port.Eval(context) if port.HasValue(context) else None

    def _mark(self, layer: str, place: np.ndarray | None, time: float) -> None:
        """Show the mark of a layer at a place of shape (2,), W, m, and nowhere else; None hides it."""
        if not np.array_equal(place, self._drawn.marked.get(layer)):  # type: ignore[arg-type]
            mark = self._marks[layer]
            mesh = meshes.NOTHING if place is None else meshes.Mesh(mark.vertices + (*place, 0.0), mark.faces)
            self.stage.swap(layer, mesh, time)
            self._drawn.marked[layer] = None if place is None else np.array(place)

    def _draw_roadmap(self, roadmap: StarRoadmap, time: float) -> None:
        """Draw regions, nodes and edges: what is new, or all if the roadmap was rebuilt."""
        drawn_state, last = self._drawn, self._drawn.roadmap
        if roadmap is last:
            return
        drawn_state.roadmap = roadmap
        known_count, edges = len(last), len(last.edges)
        if len(roadmap) < known_count or any(a is not b for a, b in zip(last.regions, roadmap.regions, strict=False)):
            for path in drawn_state.growing:  # other regions from the same scans
                self.stage.remove(path, time)
            drawn_state.growing.clear()
            drawn_state.nodes, drawn_state.area = np.zeros((0, 2)), shapely.Polygon()
            known_count = edges = 0
        self._draw_regions(roadmap.regions[known_count:], time)
        nodes = roadmap.union.center
        self._draw_nodes(nodes[known_count:], time)
        lines = meshes.make_segments(nodes[roadmap.edges[edges:]], 0.25 * self._line, LAYERS["roadmap/edges"].height)
        self._grow(self.stage.add("roadmap/edges", lines, time))

    def _draw_regions(self, regions: Sequence[StarRegion], time: float) -> None:
        """Add regions to the faint area of all; the newest is bright."""
        if not regions:
            return
        region_areas = [shapely.Polygon(region.outline(120)).buffer(0.0) for region in regions]
        added_area = shapely.union_all(region_areas).difference(self._drawn.area, grid_size=1e-4)
        added_parts = shapely.get_parts(added_area)
        parts = [part for part in added_parts if part.geom_type == "Polygon" and part.area > LEAST_AREA]
        self._drawn.area = shapely.union_all([self._drawn.area, *region_areas], grid_size=1e-4)
        layer = LAYERS["regions/all"]
        self._grow(self.stage.add("regions/all", meshes.make_area(shapely.MultiPolygon(parts), layer.height), time))
        region_rim, height = regions[-1].outline(120), LAYERS["regions/newest"].height
        newest = (
            meshes.make_fan(regions[-1].center, region_rim, height),
            meshes.make_ribbon(region_rim, 0.5 * self._line, height, closed=True),
        )
        for key, mesh, opacity in zip(("area", "rim"), newest, (None, meshes.RIM_OPACITY), strict=True):
            self.stage.swap("regions/newest", mesh, time, opacity, key)

    def _draw_nodes(self, nodes: np.ndarray, time: float) -> None:
        """Draw those nodes, W, m, shape (n, 2), that are apart from all that are drawn."""
        is_apart = _apart_from(self._drawn.nodes, nodes, SPACING * self._node)
        self._drawn.nodes = np.vstack((self._drawn.nodes, is_apart))
        discs = meshes.make_discs(is_apart, self._node, LAYERS["roadmap/nodes"].height)
        self._grow(self.stage.add("roadmap/nodes", discs, time))

    def _draw_frontiers(self, state: PlannerState, time: float) -> None:
        """Draw the frontiers with their points, and the dead ends, if they may have changed."""
        if state.roadmap is self._drawn.roadmap:
            return
        frontier_lines = state.frontiers(self._robot.shape.cover_radius)
        line_mesh = meshes.make_segments(frontier_lines, 0.5 * self._line, LAYERS["frontiers/extendable"].height)
        self.stage.swap("frontiers/extendable", line_mesh, time)
        frontier_points = _apart_from(np.zeros((0, 2)), _find_middles(frontier_lines), SPACING * self._node)
        point_mesh = meshes.make_discs(frontier_points, self._frontier, LAYERS["frontiers/points"].height)
        self.stage.swap("frontiers/points", point_mesh, time)
        failed_places = state.roadmap.closures.failed_places
        cross_mesh = meshes.make_crosses(failed_places, 2.7 * self._node, LAYERS["frontiers/stuck"].height)
        self.stage.swap("frontiers/stuck", cross_mesh, time)

    def _grow(self, path: str | None) -> None:
        """Remember an added object that remains for as long as the roadmap only grows."""
        if path:
            self._drawn.growing.append(path)

    def _draw_path(self, pose: np.ndarray | None, guidance: Guidance | None, time: float) -> None:
        if pose is None or guidance is None:
            return
        path = guidance.path
        points = np.vstack((pose[:2], path)) if len(path) else np.zeros((0, 2))
        if np.array_equal(points, self._drawn.path):
            return
        self._drawn.path = points
        self._mark("short_term_goal", path[0] if len(path) else None, time)  # at once, or they would come apart
        self.stage.swap("path", meshes.make_ribbon(points, self._line, LAYERS["path"].height), time)

    def _draw_scans(self, scans: list[tuple[LaserScan | None, Mount]], pose: np.ndarray | None, time: float) -> None:
        seen_scans = [(scan, mount) for scan, mount in scans if scan is not None]
        if not seen_scans or pose is None or seen_scans[0][0] is self._drawn.scan:
            return
        self._drawn.scan = seen_scans[0][0]
        hits = [align_with_robot(scan, mount).points(mount.find_lidar_pose(pose)) for scan, mount in seen_scans]
        points = np.vstack(hits)
        point_step = math.ceil(max(len(points), 1) / SCAN_POINTS)
        self.stage.swap_points("scan", points[::point_step], time)

    def _draw_certificate(self, certificate: Any, time: float) -> None:
        if certificate is None or certificate is self._drawn.certificate:
            return
        self._drawn.certificate = certificate
        path = np.asarray(certificate.path)
        if len(path):
            kept_indices = np.unique(np.linspace(0, len(path) - 1, min(8, len(path))).round().astype(int))
            path = path[kept_indices]
        mesh = meshes.sweep_area(path, self._robot.shape, LAYERS["certificate"].height)
        self.stage.swap("certificate", mesh, time)

    def _draw_trail(self, time: float) -> None:
        trail = np.array(self._drawn.trail)
        if len(trail) < 2:
            return
        if np.hypot(*(trail[1:, :2] - trail[0, :2]).T).max() < 0.5 * self._line:
            self._drawn.trail = [self._drawn.trail[0]]  # as good as standing
            return
        # One quad per step, so that each shows its own speed.
        end_points = np.stack((trail[:-1, :2], trail[1:, :2]), axis=1)
        has_moved = np.hypot(*(end_points[:, 1] - end_points[:, 0]).T) > meshes.SAME_POINT
        mesh = meshes.make_segments(end_points[has_moved], self._line, LAYERS["trail"].height)
        step_colors = np.repeat(meshes.compute_speed_colors(trail[1:, 2][has_moved], self._robot.max_speed), 4, axis=0)
        self.stage.add("trail", mesh, time, colors=step_colors)
        self._drawn.trail = self._drawn.trail[-1:]


def _apart_from(drawn_points: np.ndarray, points: np.ndarray, spacing: float) -> np.ndarray:
    """Those points, shape (n, 2), that are farther than `spacing` from all `drawn_points` and from one another, m."""
    drawn_count = len(drawn_points)
    for point in points:
        if not len(drawn_points) or np.hypot(*(drawn_points - point).T).min() > spacing:
            drawn_points = np.vstack((drawn_points, point))
    return drawn_points[drawn_count:]


def _find_middles(lines: np.ndarray) -> np.ndarray:
    """The middles of polylines, whose segments, shape (n, 2, 2), follow one another; shape (m, 2)."""
    chain_starts = np.flatnonzero(np.any(lines[1:, 0] != lines[:-1, 1], axis=1)) + 1
    chains = [shapely.LineString([*part[:, 0], part[-1, 1]]) for part in np.split(lines, chain_starts) if len(part)]
    return shapely.get_coordinates(shapely.line_interpolate_point(chains, 0.5, normalized=True))


@dataclass
class _Drawn:
    """The snapshots drawn last, and the objects that will change."""

    roadmap: StarRoadmap
    undrawn_zones: list[KeepOut | SpeedZone]
    scan: LaserScan | None = None
    certificate: Any = None
    path: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    trail: list[tuple[float, float, float]] = field(default_factory=list)
    marked: dict[str, np.ndarray | None] = field(default_factory=dict)
    growing: list[str] = field(default_factory=list)
    nodes: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    area: shapely.Geometry = field(default_factory=shapely.Polygon)
    next_scan_time: float = 0.0


LEAST_ARROW_SPEED = 0.02
"""An obstacle slower than this has no arrow, m/s."""


class BodyMarks:
    """Draws into a stage; each mark is an object that moves with its body, and drawn anew only where it changes."""

    def __init__(self, stage: MeshcatStage, obstacles: MovingObstacles, scale: float) -> None:
        """`obstacles`: those that move; `scale`: of the world's marks, see `meshes.choose_mark_scale`."""
        self._stage, self._obstacles, self._scale = stage, obstacles, scale
        self.clear()

    def clear(self) -> None:
        """Forget what has been drawn."""
        self._shape: Footprint | None = None
        self._speeds = np.zeros(len(self._obstacles))

    def draw_robot(self, pose: np.ndarray, shape: Footprint, time: float) -> None:
        """The rim and the front of a footprint at a pose (x, y, yaw), W, from a time on."""
        for layer in ("footprint", "front"):
            self._stage.move(layer, "robot", pose, time)
        if shape is self._shape:
            return
        self._shape = shape
        width = 0.5 * self._scale * meshes.LINE_WIDTH
        self._stage.swap("footprint", meshes.make_rim(shape, min(width, 0.2 * shape.cover_radius)), time, key="robot")
        self._stage.swap("front", meshes.make_front(shape, 2.0 * width), time, key="robot")

    def draw_velocities(self, time: float) -> None:
        """Arrows from the middles of obstacles to where they will be in 1 s at their velocities at a time, s."""
        positions, velocities = (row[0] for row in moving_obstacle_states(self._obstacles, np.array([time])))
        for k, ((x, y), (vx, vy)) in enumerate(zip(positions, velocities, strict=True)):
            speed = math.hypot(vx, vy) if math.hypot(vx, vy) > LEAST_ARROW_SPEED else 0.0
            if speed > 0.0:
                self._stage.move("velocities", f"{k}", np.array((x, y, math.atan2(vy, vx))), time)
            if abs(speed - self._speeds[k]) > 0.1 * self._speeds[k]:
                width = 0.7 * self._scale * meshes.LINE_WIDTH
                arrow = meshes.make_arrow(speed, width) if speed > 0.0 else meshes.NOTHING
                self._stage.swap("velocities", arrow, time, key=f"{k}")
                self._speeds[k] = speed
