"""The layers of a recording with their colours, and flat triangle meshes for them."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely

from drake_starnav.errors import shown
from drake_starnav.geometry.footprint import Footprint, find_covered_area
from drake_starnav.parameters import unknown_name
from drake_starnav.safety import KeepOut, SpeedZone
from drake_starnav.worlds.moving_obstacles import MOVING_OBSTACLE_COLOR
from drake_starnav.worlds.world import World

SAME_POINT = 1e-6
"""Points of a polyline nearer than this count once, m."""
Color = tuple[float, float, float]
ZONES = KeepOut, SpeedZone
"""Certificates that are areas."""


@dataclass(frozen=True)
class Layer:
    """One kind of object in a recording, which Meshcat's panel shows or hides as a whole.

    Attributes:
        label: its meaning, for the legend.
        color: red, green, blue, 0 to 1.
        symbol: in the legend: area, region, line, disc, dot, ring, cross, star, arrow, outline, front, robot, gradient.
        height: above the floor, m; higher layers hide lower ones.
        opacity: 0 to 1; below 1 it hides nothing.
        size: of its points, if it has any, pixels at any distance.
        on_top: whether nothing solid hides it: a hit lies on the surface of an obstacle.
    """

    label: str
    color: Color
    symbol: str
    height: float
    opacity: float = 1.0
    size: float = 0.0
    on_top: bool = False


LINE_WIDTH = 0.07
"""Of path and trail where marks have their usual size, m; outlines and frontiers are half as wide, edges a quarter."""
USUAL_RADIUS, USUAL_SIZE = 0.25, 40.0
"""Radius of robots, m, below which marks are smaller, and extent of worlds, in radii, beyond which they are larger."""
SHELL_COLOR: Color = (0.13, 0.32, 0.58)
"""Colour of the shipped robot's hull; the others are of the parts on it."""
DECK_COLOR: Color = (0.90, 0.92, 0.95)
HEADING_COLOR: Color = (0.98, 0.60, 0.10)
LIDAR_COLOR: Color = (0.12, 0.12, 0.14)
# Colours after those for colour-blind readers (Okabe and Ito, 2008), most of them darker; symbols differ as well.
LAYERS = {
    "zones/slow": Layer("area to be slow in", (0.90, 0.75, 0.10), "area", 0.01, 0.3),
    "zones/keep_out": Layer("area to stay out of", (0.80, 0.10, 0.10), "area", 0.015, 0.3),
    "regions/all": Layer("star-shaped regions, all together", (0.60, 0.80, 0.93), "area", 0.02, 0.3),
    "regions/newest": Layer("newest region", (0.27, 0.65, 0.88), "region", 0.025, 0.4),
    "certificate": Layer("certified braking motion", (0.00, 0.62, 0.45), "area", 0.03, 0.55),
    "roadmap/edges": Layer("roadmap edge", (0.45, 0.45, 0.45), "line", 0.04),
    "trail": Layer("trail", (0.50, 0.01, 0.66), "gradient", 0.06),
    "roadmap/nodes": Layer("roadmap node", (0.15, 0.15, 0.15), "disc", 0.065),
    "path": Layer("path", (0.00, 0.32, 0.75), "line", 0.07),
    "frontiers/extendable": Layer("frontier, may lead on", (0.90, 0.60, 0.00), "line", 0.08),
    "frontiers/points": Layer("frontier point", (0.90, 0.60, 0.00), "disc", 0.09),
    "frontiers/stuck": Layer("dead end, closed", (0.65, 0.20, 0.50), "cross", 0.10),
    "frontiers/target": Layer("frontier point it heads for", (0.75, 0.42, 0.00), "ring", 0.11),
    "short_term_goal": Layer("short-term goal", (0.00, 0.32, 0.75), "ring", 0.12),
    "goal": Layer("goal", (0.00, 0.50, 0.36), "star", 0.13),
    "scan": Layer("laser scan", (0.84, 0.25, 0.00), "dot", 0.14, size=4.0, on_top=True),
    "velocities": Layer("way of an obstacle in 1 s", (0.55, 0.10, 0.40), "arrow", 0.15, on_top=True),
    "footprint": Layer("robot's footprint", (0.04, 0.06, 0.16), "outline", 0.16, on_top=True),
    "front": Layer("robot's front", HEADING_COLOR, "front", 0.17, on_top=True),
}
"""By name in Meshcat's panel, lowest first."""

RIM_OPACITY = 0.9
"""Of the outline of a region."""
ROBOT = Layer("robot", SHELL_COLOR, "robot", 1.0)
"""It is part of the scene, as are the obstacles that move; see `add_scene_layers`."""
MOVING_OBSTACLES = Layer("obstacle that moves", MOVING_OBSTACLE_COLOR, "disc", 0.5)

SPEED_COLORS = np.array([(0.05, 0.03, 0.53), (0.49, 0.01, 0.66), (0.80, 0.28, 0.47), (0.97, 0.58, 0.25)])
"""Colours of the trail from standing to full speed (the lower four fifths of the map "plasma")."""


def find_seen_color(layer: Layer) -> Color:
    """Return the colour in which a layer is seen: an area on white, above the regions that are lower than it."""
    regions = [LAYERS[name] for name in ("regions/all", "regions/newest")] if layer.opacity < 1.0 else []
    blended_color = np.ones(3)
    for each in (*(region for region in regions if region.height < layer.height), layer):
        blended_color += each.opacity * (np.array(each.color) - blended_color)
    return float(blended_color[0]), float(blended_color[1]), float(blended_color[2])


def name_zone_layer(zone: KeepOut | SpeedZone) -> str:
    """The layer of an area."""
    return "zones/keep_out" if isinstance(zone, KeepOut) else "zones/slow"


def list_layers_of_run(max_speed: float, world: World, robot: Layer = ROBOT) -> dict[str, Layer]:
    """The layers of a run's legend, whose trail names its speeds, in m/s; `robot`: how it is drawn."""
    trail = replace(LAYERS["trail"], label=f"trail, 0 to {max_speed:g} m/s")
    return add_scene_layers({**LAYERS, "trail": trail}, world) | {"robot": robot}


def choose_mark_scale(extent: Sequence[float], radius: float) -> float:
    """By how much marks are larger in a world of that box (x_min, y_min, x_max, y_max), m, of a robot's radius, m.

    They grow with the root of the world's size, and shrink with a robot that they would hide.
    """
    world_size, robot_size = max(np.subtract(extent[2:], extent[:2])), min(radius, USUAL_RADIUS)
    return robot_size / USUAL_RADIUS * math.sqrt(max(1.0, world_size / (USUAL_SIZE * robot_size)))


def add_scene_layers(layers: dict[str, Layer], world: World) -> dict[str, Layer]:
    """The layers of a legend, with the robot, and with the moving obstacles if the world has any."""
    moving = {"moving_obstacles": MOVING_OBSTACLES} if len(world.moving_obstacles) else {}
    return {**layers, **moving, "robot": ROBOT}


def select_layers(names: str, layers: Iterable[str]) -> frozenset[str]:
    """Those layers that a list such as "trail,scan,frontiers" names, one by one or by folder, and what is no layer.

    Raises:
        StarnavError: no layer has such a name.
    """
    layers, chosen = list(layers), {"robot", "moving_obstacles"}
    for name in names.split(","):
        found_layers = [layer for layer in layers if f"{layer}/".startswith(f"{name}/")]
        if not name or not found_layers:
            raise unknown_name(f"layer {shown(name)}", name, dict.fromkeys(x.partition("/")[0] for x in layers))
        chosen.update(found_layers)
    return frozenset(chosen)


@dataclass(frozen=True)
class Mesh:
    """Flat triangles seen from above: vertices, shape (n, 3), W, m, and faces, shape (k, 3), indices of vertices."""

    vertices: np.ndarray
    faces: np.ndarray

    def __len__(self) -> int:
        return len(self.faces)


NOTHING = Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32))


def make_area(shape: shapely.Geometry, z: float) -> Mesh:
    """The polygons of a shape, W, m, at a height, m."""
    triangle_corners = shapely.get_coordinates(shapely.get_parts(shapely.constrained_delaunay_triangles(shape)))
    points, faces = np.unique(triangle_corners.reshape(-1, 4, 2)[:, :3].reshape(-1, 2), axis=0, return_inverse=True)
    return Mesh(_raise_points(points, z), faces.reshape(-1, 3).astype(np.int32))


def make_fan(center: np.ndarray, rim: np.ndarray, z: float) -> Mesh:
    """Triangles from a centre (2,) to each edge of a closed rim (n, 2), counter-clockwise, W, m, at a height, m."""
    rim_indices = np.arange(len(rim))
    faces = np.column_stack((np.zeros_like(rim_indices), rim_indices + 1, (rim_indices + 1) % len(rim) + 1))
    return Mesh(_raise_points(np.vstack((center, rim)), z), faces.astype(np.int32))


def make_ribbon(points: np.ndarray, width: float, z: float, closed: bool = False) -> Mesh:
    """A band of a width, m, along a polyline (n, 2), W, m, mitred at its corners; empty for less than two distinct
    points.

    `closed`: whether the last point joins the first.
    """
    line_kind = shapely.LinearRing if closed else shapely.LineString
    line = line_kind(points if len(points) > 1 + closed else [])
    with np.errstate(divide="ignore", invalid="ignore"):  # where points of the line coincide
        line_band = line.buffer(0.5 * width, cap_style="flat", join_style="mitre", mitre_limit=1.7)
    return make_area(line_band, z)


def make_segments(end_points: np.ndarray, width: float, z: float) -> Mesh:
    """Separate straight ribbons, of four vertices each; `end_points` has shape (n, 2, 2), W, m."""
    start, end = end_points[:, 0], end_points[:, 1]
    x, y = (end - start).T
    left_side = np.column_stack((-y, x)) / np.maximum(np.hypot(x, y), SAME_POINT)[:, None] * (0.5 * width)
    corners = np.stack((start + left_side, end + left_side, start - left_side, end - left_side), axis=1)
    faces = np.array([(0, 2, 1), (1, 2, 3)]) + 4 * np.arange(len(end_points))[:, None, None]
    return Mesh(_raise_points(corners.reshape(-1, 2), z), faces.reshape(-1, 3).astype(np.int32))


def make_discs(centers: np.ndarray, radius: float, z: float) -> Mesh:
    """Regular polygons of twelve corners about centres of shape (n, 2), W, m."""
    return make_area(shapely.MultiPoint(centers).buffer(radius, quad_segs=3), z)


def make_ring(center: np.ndarray, inner: float, outer: float, z: float) -> Mesh:
    """The area between two circles of radii `inner` and `outer` (m) about a centre (2,), W."""
    center_point = shapely.Point(center)
    return make_area(center_point.buffer(outer, quad_segs=5) - center_point.buffer(inner, quad_segs=5), z)


def make_crosses(centers: np.ndarray, size: float, z: float) -> Mesh:
    """Diagonal crosses of a half diagonal `size` (m) about centres of shape (n, 2), W, m."""
    cross_arms = size * math.sqrt(0.5) * np.array([[(-1.0, -1.0), (1.0, 1.0)], [(-1.0, 1.0), (1.0, -1.0)]])
    return make_segments((np.reshape(centers, (-1, 1, 1, 2)) + cross_arms).reshape(-1, 2, 2), 0.45 * size, z)


def make_five_pointed_star(center: np.ndarray, radius: float, z: float) -> Mesh:
    """A star with its first point along y, about a centre of shape (2,), W, m."""
    spoke_lengths = radius * np.where(np.arange(10) % 2, 0.45, 1.0)
    spoke_angles = 0.5 * math.pi + math.pi / 5.0 * np.arange(10)
    rim_points = spoke_lengths[:, None] * np.column_stack((np.cos(spoke_angles), np.sin(spoke_angles)))
    return make_fan(center, np.asarray(center) + rim_points, z)


def make_goal_star(place: Sequence[float] | np.ndarray, radius: float, extent: Sequence[float]) -> Mesh:
    """The mark of a goal (x, y, ...), W, m: a little smaller than a robot of the radius, m, larger in a large world."""
    mark_size = 0.9 * max(radius, USUAL_RADIUS) * choose_mark_scale(extent, radius)
    return make_five_pointed_star(np.array(place[:2]), mark_size, LAYERS["goal"].height)


def make_rim(shape: Footprint, width: float) -> Mesh:
    """The outer `width`, m, of what a footprint covers, in the robot's frame."""
    whole_area = find_covered_area(shape, np.zeros(3))
    return make_area(whole_area - whole_area.buffer(-width), LAYERS["footprint"].height)


def make_front(shape: Footprint, least: float) -> Mesh:
    """A triangle that points ahead to the front of a footprint, in the robot's frame; at least so long, m."""
    front_x = float(shape.outline[:, 0].max())
    length = max(0.45 * shape.cover_radius, least)
    tip_corners = np.array([(front_x, 0.0), (front_x - length, 0.5 * length), (front_x - length, -0.5 * length)])
    return Mesh(_raise_points(tip_corners, LAYERS["front"].height), np.array([(0, 1, 2)], np.int32))


def make_arrow(length: float, width: float) -> Mesh:
    """An arrow from the origin along x, of a length and a width of its shaft, m."""
    head_length = min(3.0 * width, length)
    shaft_length, half_width = length - head_length, 0.5 * width
    lower_line = [(0.0, -half_width), (shaft_length, -half_width), (shaft_length, -0.5 * head_length), (length, 0.0)]
    corners = np.array([*lower_line, *((x, -y) for x, y in lower_line[2::-1])])
    return make_area(shapely.Polygon(corners).buffer(0.0), LAYERS["velocities"].height)


def sweep_area(poses: np.ndarray, shape: Footprint, z: float) -> Mesh:
    """The area that a footprint covers at some poses (x, y, yaw), shape (n, 3), W, m and rad; a disc's between them,
    too."""
    if shape.is_disc:
        center_line = poses[:, :2] if len(poses) > 1 else np.repeat(poses[:, :2], 2, axis=0)
        return make_area(shapely.LineString(center_line).buffer(shape.radius, quad_segs=5), z)
    return make_area(shapely.union_all([find_covered_area(shape, pose) for pose in poses]), z)


def compute_speed_colors(speeds: np.ndarray, max_speed: float) -> np.ndarray:
    """Colours of the trail at speeds of shape (n,), m/s; shape (n, 3), red, green, blue, 0 to 1."""
    speed_shares = np.clip(np.abs(speeds) / max_speed, 0.0, 1.0)
    color_shares = np.linspace(0.0, 1.0, len(SPEED_COLORS))
    return np.column_stack([np.interp(speed_shares, color_shares, channel) for channel in SPEED_COLORS.T])


def _raise_points(points: np.ndarray, z: float) -> np.ndarray:
    return np.column_stack((points, np.full(len(points), z)))
