"""Draws moments of a recorded run with Matplotlib, from straight above."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.patches import Circle, PathPatch, Polygon, Rectangle
from matplotlib.path import Path

from drake_starnav.station.model_world import FLOOR_TOLERANCE
from drake_starnav.visualization.film import Actor, Film
from drake_starnav.visualization.meshes import (
    DECK_COLOR,
    HEADING_COLOR,
    LIDAR_COLOR,
    SPEED_COLORS,
    Layer,
)
from drake_starnav.visualization.page import ROOT, Caption
from drake_starnav.visualization.scene_timeline import SceneTimeline
from drake_starnav.visualization.star_roadmap_visualizer import FRAME_SLACK
from drake_starnav.visualization.timeline import Shape
from drake_starnav.worlds.world import ROBOT_HEIGHT

TEXT_COLOR = "#222222"
SOLID_ORDER, ON_TOP, PANEL_ORDER = 100.0, 300.0, 1000.0
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
ROW_HEIGHT = 21.0
"""Of the legend, points."""


def draw_scene(axes: Axes, film: Film, time: float) -> None:
    """Draw a moment of a run, a time in s, into axes in metres of W: solid shapes, layers, robots."""
    _draw_solids(axes, film.scene, time)
    for name, shape in film.timeline.visible(time + FRAME_SLACK).items():
        if film.caption.shows(name.removeprefix(f"/{ROOT}/")):
            _draw_shape(axes, shape, time)
    for actor in reversed(film.actors):  # the first on top
        _draw_robot(axes, actor, time)


def draw_legend(axes: Axes, caption: Caption, x: float, top: float, size: float = 12.0) -> None:
    """Draw the shown rows of the legend into axes whose units are points, the y axis pointing down.

    Args:
        axes, caption: to draw into, and what.
        x, top: left edge and middle of the first row.
        size: of the text.
    """
    rows = [layer for name, layer in caption.legend.items() if caption.shows(name)]
    for k, layer in enumerate(rows):
        y = top + ROW_HEIGHT * k
        _draw_symbol(axes, layer, x + 12.0, y)
        axes.text(
            x + 31.0, y, layer.label.replace(" (newest bright)", ""), size=size, zorder=PANEL_ORDER,
            verticalalignment="center", color=TEXT_COLOR, parse_math=False,
        )  # fmt: skip


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
        color = shape.colors[0] if len(shape.colors) == 1 else _shade(shape.colors[loop].mean(axis=0))
        kinds.setdefault(tuple(color), []).append(Path(points[[*loop, loop[0]]], closed=True))
    for color, paths in kinds.items():
        area, opacity = Path.make_compound_path(*paths), shape.value("opacity", time, 1.0)
        seam = SEAM if opacity >= 1.0 else 0.0
        axes.add_artist(PathPatch(area, color=color, alpha=opacity, linewidth=seam, joinstyle="round", zorder=order))


def _shade(color: np.ndarray) -> np.ndarray:
    return np.round(SHADES * color) / SHADES


def _draw_robot(axes: Axes, actor: Actor, time: float) -> None:
    """Hull, deck, the bar that shows the heading, and the lidar, as in the shipped robot."""
    x, y, yaw = actor.motion.at(time)
    for share, color in ((1.0, actor.color), (actor.deck, DECK_COLOR)):
        axes.add_artist(Circle((x, y), share * actor.radius, facecolor=color, zorder=ROBOT_ORDER))
    ahead, left = np.array([math.cos(yaw), math.sin(yaw)]), np.array([-math.sin(yaw), math.cos(yaw)])
    corners = [(0.0, -0.1), (0.8, -0.1), (0.8, 0.1), (0.0, 0.1)]
    bar = np.array([x, y]) + actor.radius * np.array([a * ahead + b * left for a, b in corners])
    axes.add_artist(Polygon(bar, facecolor=HEADING_COLOR, zorder=ROBOT_ORDER))
    axes.add_artist(Circle((x, y), 0.24 * actor.radius, facecolor=LIDAR_COLOR, zorder=ROBOT_ORDER))


def _draw_symbol(axes: Axes, layer: Layer, x: float, y: float) -> None:
    """The layer's symbol in the legend, about a point of the page."""
    if layer.symbol == "area":
        color = (*layer.color, 0.45)
        axes.add_artist(
            Rectangle((x - 9.0, y - 5.0), 18.0, 10.0, facecolor=color, edgecolor=layer.color, zorder=PANEL_ORDER)
        )
    elif layer.symbol == "robot":
        for radius, part in ((6.5, layer.color), (4.5, DECK_COLOR)):
            axes.add_artist(Circle((x, y), radius, facecolor=part, zorder=PANEL_ORDER))
        axes.plot((x, x + 5.0), (y, y), color=HEADING_COLOR, linewidth=2.6, solid_capstyle="butt", zorder=PANEL_ORDER)
    elif layer.symbol in ("line", "gradient"):
        colors = SPEED_COLORS if layer.symbol == "gradient" else np.array([layer.color])
        at = np.linspace(x - 10.0, x + 10.0, len(colors) + 1)
        for left, right, color in zip(at[:-1], at[1:], colors, strict=True):
            axes.plot((left, right), (y, y), color=color, linewidth=3.0, solid_capstyle="butt", zorder=PANEL_ORDER)
    else:
        marker, size = {
            "disc": ("o", 9.0), "square": ("s", 6.0), "dot": ("o", 4.5), "ring": ("o", 10.0), "cross": ("x", 8.0),
            "star": ("*", 13.0),
        }[layer.symbol]  # fmt: skip
        face = "none" if layer.symbol == "ring" else layer.color
        width = 2.5 if layer.symbol in ("ring", "cross") else 0.0
        axes.plot(
            x, y, marker=marker, markersize=size, markerfacecolor=face, markeredgecolor=layer.color,
            markeredgewidth=width, zorder=PANEL_ORDER,
        )  # fmt: skip
