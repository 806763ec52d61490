"""Draws moments of a recorded run with Matplotlib, from straight above."""

import math
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, PathPatch, Polygon, Rectangle
from matplotlib.path import Path

from drake_starnav.geometry.se2 import placed
from drake_starnav.station.model_world import FLOOR_TOLERANCE
from drake_starnav.visualization.meshes import (
    DECK_COLOR,
    HEADING_COLOR,
    LIDAR_COLOR,
    Layer,
)
from drake_starnav.visualization.page import ROOT, Caption
from drake_starnav.visualization.recorded_run import RecordedRun, RobotTrack
from drake_starnav.visualization.scene_timeline import SceneTimeline
from drake_starnav.visualization.star_roadmap_visualizer import FRAME_SLACK
from drake_starnav.visualization.timeline import Shape
from drake_starnav.worlds.world import ROBOT_HEIGHT

SOLID_ORDER, ON_TOP = 100.0, 300.0
"""Drawing order; flat layers have the order of their height in cm, solid shapes that of their top and SOLID_ORDER."""
ROBOT_ORDER = SOLID_ORDER + 100.0 * ROBOT_HEIGHT
DOTS = 0.58
"""Factor on the sizes of lone points: a figure is as much narrower than the page for which they are."""
SHADES = 16
"""A layer whose vertices have colours is drawn in so many shades of each channel."""
MOST_OUTLINES = 300
"""More obstacles are drawn as pixels in vector graphics, to keep them small."""
SEAM = 0.5
"""Width of rims that close the seams between the faces of an opaque line, points."""
MARKERS = {
    "disc": ("o", 9.0), "square": ("s", 6.0), "dot": ("o", 4.5), "ring": ("o", 9.0), "cross": ("x", 7.0),
    "star": ("*", 13.0), "robot": ("o", 10.0),
}  # fmt: skip
"""Of the legend's symbols that are points: Matplotlib's marker and its size, points."""


def draw_scene(axes: Axes, recorded: RecordedRun, time: float) -> None:
    """Draw a moment of a run, a time in s, into axes in metres of W: solid shapes, layers, robots."""
    _draw_solids(axes, recorded.scene, time)
    for name, shape in recorded.timeline.visible(time + FRAME_SLACK).items():
        if recorded.caption.shows(name.removeprefix(f"/{ROOT}/")):
            _draw_shape(axes, shape, time)
    for robot in reversed(recorded.robots):  # the first on top
        _draw_robot(axes, robot, time)


def legend_handles(caption: Caption) -> list[Artist]:
    """What Matplotlib's legend shows for the shown rows of a caption's."""
    return [_handle(layer) for name, layer in caption.legend.items() if caption.shows(name)]


def _handle(layer: Layer) -> Artist:
    look: dict[str, Any] = {"label": layer.label.replace(" (newest bright)", ""), "color": layer.color}
    if layer.symbol == "area":
        return Rectangle((0.0, 0.0), 1.0, 1.0, alpha=0.45, **look)
    if layer.symbol in ("line", "gradient"):
        return Line2D([], [], linewidth=3.0, **look)
    marker, size = MARKERS[layer.symbol]
    face, edge = ("none", 2.5) if layer.symbol in ("ring", "cross", "robot") else (layer.color, 0.0)
    look |= {"marker": marker, "markersize": size, "markerfacecolor": face, "markeredgewidth": edge}
    return Line2D([], [], linestyle="none", **look)


def _draw_solids(axes: Axes, scene: SceneTimeline, time: float) -> None:
    """Draw solid shapes as they hide one another from above: what has one colour and height is drawn together."""
    kinds: dict[tuple[tuple[float, ...], float], list[np.ndarray]] = {}
    for solid in scene.solids:
        outlines, top = solid.seen_from_above(time)
        order = min(SOLID_ORDER + 100.0 * top, ON_TOP - 1.0) if top > FLOOR_TOLERANCE else 0.0
        kinds.setdefault((solid.color, round(order, 3)), []).extend(outlines)
    for (color, order), outlines in kinds.items():
        # a hairline hides the seams between the parts of a wall
        shapes = PolyCollection(outlines, facecolor=color, edgecolor=color, linewidth=0.2, zorder=order)
        shapes.set_rasterized(len(outlines) > MOST_OUTLINES)
        axes.add_collection(shapes, autolim=False)


def _draw_shape(axes: Axes, shape: Shape, time: float) -> None:
    order = ON_TOP if shape.on_top else 100.0 * shape.height
    points = shape.points + shape.value("position", time, np.zeros(2))
    if shape.faces is None:
        axes.scatter(*points.T, s=(DOTS * shape.size) ** 2, c=shape.colors, marker="s", linewidths=0.0, zorder=order)
        return
    # Where vertices have colours, rims of one shade are drawn together.
    kinds: dict[tuple[float, ...], list[Path]] = {}
    for loop in shape.loops:
        color = shape.colors[loop].mean(axis=0) if len(shape.colors) > 1 else shape.colors[0]
        color = np.round(SHADES * color) / SHADES if len(shape.colors) > 1 else color
        kinds.setdefault(tuple(color), []).append(Path(points[[*loop, loop[0]]], closed=True))
    for color, paths in kinds.items():
        area, opacity = Path.make_compound_path(*paths), shape.value("opacity", time, 1.0)
        seam = SEAM if opacity >= 1.0 else 0.0
        axes.add_artist(PathPatch(area, color=color, alpha=opacity, linewidth=seam, joinstyle="round", zorder=order))


def _draw_robot(axes: Axes, robot: RobotTrack, time: float) -> None:
    """Hull, deck, the bar that shows the heading, and the lidar, as in the shipped robot."""
    (x, y, yaw), radius, outline = robot.motion.at(time), robot.shape.radius, robot.shape.outline
    for share, color in ((1.0, robot.color), (robot.deck, DECK_COLOR)):
        middle = outline.mean(axis=0)
        corners = placed(np.array((x, y, yaw)), middle + share * (outline - middle))
        axes.add_artist(Polygon(corners, facecolor=color, zorder=ROBOT_ORDER))
    ahead, left = np.array([math.cos(yaw), math.sin(yaw)]), np.array([-math.sin(yaw), math.cos(yaw)])
    bar_corners = [(0.0, -0.1), (0.8, -0.1), (0.8, 0.1), (0.0, 0.1)]
    bar = np.array([x, y]) + radius * np.array([a * ahead + b * left for a, b in bar_corners])
    axes.add_artist(Polygon(bar, facecolor=HEADING_COLOR, zorder=ROBOT_ORDER))
    axes.add_artist(Circle((x, y), 0.24 * radius, facecolor=LIDAR_COLOR, zorder=ROBOT_ORDER))
