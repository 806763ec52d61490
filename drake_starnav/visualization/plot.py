"""Draw moments of a recorded run with Matplotlib, as a browser shows them from above."""

import math
from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle, PathPatch, Polygon, Rectangle
from matplotlib.path import Path
from PIL import Image

from drake_starnav.errors import StarnavError
from drake_starnav.station.world_geometry import OBSTACLE_COLOR, WALL_COLOR, WALL_THICKNESS
from drake_starnav.visualization.camera import (
    BAR_HEIGHT,
    PAGE,
    PANEL_WIDTH,
    around_robot,
    check_view,
    floor_to_page,
    scale_length,
)
from drake_starnav.visualization.film import Actor, Film
from drake_starnav.visualization.meshes import (
    DECK_COLOR,
    HEADING_COLOR,
    LIDAR_COLOR,
    MOVING_OBSTACLES,
    SPEED_COLORS,
    Layer,
)
from drake_starnav.visualization.page import ROOT, Caption
from drake_starnav.visualization.star_roadmap_visualizer import FRAME_SLACK
from drake_starnav.visualization.timeline import Shape
from drake_starnav.worlds.moving_obstacles import MovingObstacles, moving_obstacle_states
from drake_starnav.worlds.world import World

TEXT_COLOR = "#222222"
DPI = 72.0
"""One point is one pixel of the page."""
OBSTACLE_ORDER, ROBOT_ORDER, ON_TOP, PANEL_ORDER = 100.0, 200.0, 300.0, 1000.0
"""Drawing order; flat layers have the order of their height in cm."""


class PlotCamera:
    """Takes pictures of a film from above without a browser."""

    def __init__(self, film: Film, view: str = "top", width: int = int(PAGE[0])) -> None:
        """
        Args:
            film: the run.
            view: `top` or `follow`, both looking straight down.
            width: of the pictures, pixels.

        Raises:
            StarnavError: unknown view, or one that needs a browser.
        """
        check_view(view)
        if view == "oblique":
            raise StarnavError("camera view is 'oblique', which needs Chromium and playwright; allowed: top, follow")
        self._film, self._view, self._width = film, view, width

    def __enter__(self) -> "PlotCamera":
        return self

    def __exit__(self, *error: object) -> None:
        pass

    def picture(self, time: float) -> Image.Image:
        """The page at a time of the run, s."""
        figure = Figure(figsize=(PAGE[0] / DPI, PAGE[1] / DPI), dpi=DPI * self._width / PAGE[0])
        canvas = FigureCanvasAgg(figure)
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), xlim=(0.0, PAGE[0]), ylim=(PAGE[1], 0.0), frame_on=False)
        axes.set_axis_off()
        followed = self._film.actors[0].motion.at(time)
        extent = around_robot(followed) if self._view == "follow" else self._film.world.extent
        matrix, offset = floor_to_page(extent)

        def to_page(points: np.ndarray) -> np.ndarray:
            return np.asarray(points, dtype=float)[..., :2] @ matrix.T + offset

        scale = math.sqrt(abs(np.linalg.det(matrix)))
        _draw_world(axes, self._film.world, to_page, scale)
        _draw_moving_obstacles(axes, self._film.world.moving_obstacles, time, to_page, scale)
        for name, shape in self._film.timeline.visible(time + FRAME_SLACK).items():
            if self._film.caption.shows(name.removeprefix(f"/{ROOT}/")):
                _draw_shape(axes, shape, time, to_page)
        for actor in reversed(self._film.actors):  # the first on top
            _draw_robot(axes, actor, time, to_page, scale)
        _draw_panel(axes, self._film.caption, time)
        _draw_bar(axes, time, scale)
        canvas.draw()
        return Image.fromarray(np.array(canvas.buffer_rgba())[..., :3])


ToPage = Callable[[np.ndarray], np.ndarray]


def _draw_world(axes: Axes, world: World, to_page: ToPage, scale: float) -> None:
    for x, y, radius in np.vstack((world.cylinders, world.spheres)):
        disc = Circle(to_page(np.array([x, y])), scale * radius, facecolor=OBSTACLE_COLOR[:3], zorder=OBSTACLE_ORDER)
        axes.add_artist(disc)
    for polygon in world.polygons:
        axes.add_artist(Polygon(to_page(polygon), facecolor=OBSTACLE_COLOR[:3], zorder=OBSTACLE_ORDER))
    if world.bounds is not None:
        x0, y0, x1, y1 = world.bounds
        t = 0.5 * WALL_THICKNESS
        corners = np.array([(x0 - t, y0 - t), (x1 + t, y0 - t), (x1 + t, y1 + t), (x0 - t, y1 + t)])
        wall = Polygon(
            to_page(corners),
            fill=False,
            edgecolor=WALL_COLOR[:3],
            linewidth=scale * WALL_THICKNESS,
            joinstyle="miter",
            zorder=OBSTACLE_ORDER,
        )
        axes.add_artist(wall)


def _draw_moving_obstacles(
    axes: Axes, moving_obstacles: MovingObstacles, time: float, to_page: ToPage, scale: float
) -> None:
    positions, _ = moving_obstacle_states(moving_obstacles, np.array([time]))
    for place, radius in zip(to_page(positions[0]), moving_obstacles.radii, strict=True):
        axes.add_artist(Circle(place, scale * radius, facecolor=MOVING_OBSTACLES.color, zorder=OBSTACLE_ORDER))


def _draw_shape(axes: Axes, shape: Shape, time: float, to_page: ToPage) -> None:
    order = ON_TOP if shape.on_top else 100.0 * shape.height
    points = to_page(shape.points + shape.value("position", time, np.zeros(2)))
    if shape.faces is None:
        axes.scatter(*points.T, s=shape.size**2, c=shape.colors, marker="s", linewidths=0.0, zorder=order)
    elif len(shape.colors) == 1:
        loops = [Path(points[[*loop, loop[0]]], closed=True) for loop in shape.loops]
        opacity = shape.value("opacity", time, 1.0)
        axes.add_artist(
            PathPatch(Path.make_compound_path(*loops), color=shape.colors[0], alpha=opacity, lw=0.0, zorder=order)
        )
    else:
        colors = shape.colors[shape.faces].mean(axis=1)
        triangles = PolyCollection(points[shape.faces], facecolors=colors, edgecolors="face", lw=0.3, zorder=order)
        axes.add_collection(triangles, autolim=False)


def _draw_robot(axes: Axes, actor: Actor, time: float, to_page: ToPage, scale: float) -> None:
    """Hull, deck, the bar that shows the heading, and the lidar, as in the shipped robot."""
    x, y, yaw = actor.motion.at(time)
    place = to_page(np.array([x, y]))
    for share, color in ((1.0, actor.color), (actor.deck, DECK_COLOR)):
        axes.add_artist(Circle(place, share * scale * actor.radius, facecolor=color, zorder=ROBOT_ORDER))
    tip = np.array([x, y]) + 0.8 * actor.radius * np.array([math.cos(yaw), math.sin(yaw)])
    ends = np.array([place, to_page(tip)])
    axes.plot(
        *ends.T, color=HEADING_COLOR, linewidth=0.2 * scale * actor.radius, solid_capstyle="butt", zorder=ROBOT_ORDER
    )
    axes.add_artist(Circle(place, 0.24 * scale * actor.radius, facecolor=LIDAR_COLOR, zorder=ROBOT_ORDER))


def _draw_panel(axes: Axes, caption: Caption, time: float) -> None:
    axes.add_artist(Rectangle((0.0, 0.0), PANEL_WIDTH, PAGE[1], color="white", linewidth=0.0, zorder=PANEL_ORDER))
    text = {"zorder": PANEL_ORDER, "verticalalignment": "center", "color": TEXT_COLOR, "parse_math": False}
    axes.text(12.0, 21.0, caption.heading, size=16.0, weight="bold", **text)
    for k, line in enumerate(caption.lines):
        axes.text(12.0, 45.0 + 18.0 * k, line, size=12.0, **text)
    top = 45.0 + 18.0 * len(caption.lines) + 15.0
    for k, layer in enumerate(layer for name, layer in caption.legend.items() if caption.shows(name)):
        y = top + 21.0 * k
        _draw_symbol(axes, layer, 24.0, y)
        axes.text(43.0, y, layer.label.replace(" (newest bright)", ""), size=12.0, **text)


def _draw_bar(axes: Axes, time: float, scale: float) -> None:
    """The clock and a bar of a round length."""
    length = scale_length(scale)
    top, right = PAGE[1] - BAR_HEIGHT, PAGE[0] - 12.0
    left, y = right - scale * length, top + 0.6 * BAR_HEIGHT
    look = {"zorder": PANEL_ORDER, "color": TEXT_COLOR}
    axes.add_artist(Rectangle((0.0, top), PAGE[0], BAR_HEIGHT, color="white", linewidth=0.0, zorder=PANEL_ORDER))
    axes.plot((left, left, right, right), (y - 5.0, y, y, y - 5.0), linewidth=1.5, **look)
    text = {**look, "size": 12.0, "verticalalignment": "center"}
    words = f"{length:g} m" if length >= 1.0 else f"{100.0 * length:.0f} cm"
    axes.text(0.5 * (left + right), y - 8.0, words, horizontalalignment="center", **text)
    axes.text(left - 80.0, y - 4.0, f"t = {time:.1f} s", **text)


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
