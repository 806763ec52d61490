"""Moments of a recorded run from straight above, by Matplotlib: vector graphics for papers, and pictures."""

import io
import re
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from matplotlib import rc_context
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import PathPatch, Rectangle
from matplotlib.path import Path as Outline
from matplotlib.ticker import MaxNLocator, MultipleLocator
from PIL import Image

from drake_starnav.errors import StarnavError, shown
from drake_starnav.station.model_world import FLOOR_TOLERANCE
from drake_starnav.station.world_geometry import WALL_THICKNESS
from drake_starnav.utils.files import replace_file
from drake_starnav.visualization.meshes import Layer, find_seen_color
from drake_starnav.visualization.page import ROOT, around_robot
from drake_starnav.visualization.star_roadmap_visualizer import FRAME_SLACK
from drake_starnav.visualization.timeline import RecordedRun, SceneTimeline, Shape
from drake_starnav.visualization.world_figure import EMBEDDED_FONTS, MOST_OUTLINES, WIDTH, make_figure, render_figure

TEXT_SIZE = 9.0
NARROW = 6.0
"""Narrower figures, inches, have the legend below, as a column of a paper (3.5) has no room beside the scene."""
LEAST_WIDTH, MOST_WIDTH = 2.0, 50.0
"""Of a figure, inches; what is beyond was meant in another unit."""
LONG_NUMBER = re.compile(rb"(\d\.\d\d)\d+")
"""Of an SVG file: a hundredth of a point is as much as anyone sees."""
SOLID_ORDER, ON_TOP = 100.0, 300.0
"""Drawing order; flat layers have the order of their height in cm, solid shapes that of their top and SOLID_ORDER."""
SEAM = 0.5
"""Width of rims that close the seams between the faces of an opaque line, points."""
MARKERS = {
    "disc": ("o", 9.0), "dot": ("o", 4.5), "arrow": (">", 8.0), "outline": ("o", 9.0), "front": (">", 8.0),
    "ring": ("o", 9.0), "cross": ("x", 7.0), "star": ("*", 13.0), "robot": ("o", 10.0),
}  # fmt: skip
"""Of the legend's symbols that are points: Matplotlib's marker and its size, points."""


def draw_moment_figure(
    run: RecordedRun, time: float, view: str = "top", title: str = "", width: float = WIDTH
) -> Figure:
    """A moment of a run, at a time, s, from above, with axes in metres, `width` inches wide.

    The legend stands on the right, or below a figure narrower than `NARROW`. The run's caption says which layers
    are shown; view `follow` shows what is around the first robot.
    """
    walls = 1.5 * WALL_THICKNESS * np.array([-1.0, -1.0, 1.0, 1.0])
    extent = around_robot(run.motions[0].at(time)) if view == "follow" else np.add(run.extent, walls)
    width_m, height_m = extent[2] - extent[0], extent[3] - extent[1]
    handles = [_make_legend_handle(layer) for name, layer in run.caption.legend.items() if run.caption.shows(name)]
    is_narrow = width < NARROW
    scene_height = (0.9 if is_narrow else 0.67) * width * height_m / width_m  # inches
    legend_height = 0.22 * len(handles)  # in one column, inches
    figure = make_figure(max(scene_height + 0.9 + legend_height * is_narrow, legend_height + 0.2), width)
    axes = figure.add_subplot(xlim=extent[0::2], ylim=extent[1::2], anchor="NW")
    axes.set_title(title, size=TEXT_SIZE, loc="left", pad=4.0, parse_math=False)
    _label_axes(axes, max(width_m, height_m))
    _draw_scene(axes, run, time)
    place = "outside lower center" if is_narrow else "outside right upper"
    for text in figure.legend(handles=handles, loc=place, labelspacing=0.6, frameon=False).get_texts():
        text.set_parse_math(False)
    return figure


def _label_axes(axes: Axes, length: float) -> None:
    """Let axes have one scale, and equal steps for a length, m."""
    axes.set_aspect("equal")
    axes.set_xlabel("x in m")
    axes.set_ylabel("y in m")
    step = np.diff(MaxNLocator(10, steps=(1, 2, 5, 10)).tick_values(0.0, length))[0]
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MultipleLocator(step))


def write_figure(path: Path, run: RecordedRun, time: float, width: float = WIDTH) -> None:
    """Write `draw_moment_figure` as SVG or PDF, by the name's end; the same run gives the same file.

    Raises:
        StarnavError: the width is not a sensible one in inches.
    """
    if not LEAST_WIDTH <= width <= MOST_WIDTH:
        raise StarnavError(f"width of {path} is {shown(width)} in; allowed: {LEAST_WIDTH:g} to {MOST_WIDTH:g} inches")
    date_key = {".svg": "Date", ".pdf": "CreationDate"}[path.suffix]
    figure_file = io.BytesIO()
    with rc_context({**EMBEDDED_FONTS, "svg.hashsalt": "starnav", "font.size": TEXT_SIZE}):
        figure = draw_moment_figure(run, time, width=width)
        figure.savefig(figure_file, format=path.suffix[1:], dpi=200, metadata={date_key: None})
    file_content = figure_file.getvalue()
    if path.suffix == ".svg":
        file_content = LONG_NUMBER.sub(rb"\1", file_content)
    with replace_file(path) as temporary:
        temporary.write_bytes(file_content)


def draw_moment(run: RecordedRun, time: float, view: str = "top", width: int = 1100) -> Image.Image:
    """`draw_moment_figure` with a title as pixels, of a width in pixels."""
    title = ", ".join((run.caption.heading, *run.caption.lines, f"t = {time:.1f} s"))
    with rc_context({"font.size": TEXT_SIZE}):
        figure = draw_moment_figure(run, time, view, title)
        return Image.fromarray(render_figure(figure, dpi=width / figure.get_figwidth()))


def _draw_scene(axes: Axes, run: RecordedRun, time: float) -> None:
    """Draw a moment of a run, a time in s, into axes in metres of W: solid shapes and layers."""
    _draw_solids(axes, run.scene, time)
    for name, shape in run.visible(time + FRAME_SLACK).items():
        if run.caption.shows(name.removeprefix(f"/{ROOT}/")):
            _draw_shape(axes, shape, time)


def _make_legend_handle(layer: Layer) -> Artist:
    handle_look: dict[str, Any] = {"label": layer.label, "color": layer.color}
    if layer.symbol in ("area", "region"):
        rim_width = 1.0 if layer.symbol == "region" else 0.0
        handle_look = {"facecolor": find_seen_color(layer), "edgecolor": layer.color, "linewidth": rim_width}
        return Rectangle((0.0, 0.0), 1.0, 1.0, label=layer.label, **handle_look)
    if layer.symbol in ("line", "gradient"):
        return Line2D([], [], linewidth=3.0, **handle_look)
    marker, size = MARKERS[layer.symbol]
    face_color, edge_width = ("none", 2.5) if layer.symbol in ("ring", "cross", "outline") else (layer.color, 0.0)
    handle_look |= {"marker": marker, "markersize": size, "markerfacecolor": face_color, "markeredgewidth": edge_width}
    return Line2D([], [], linestyle="none", **handle_look)


def _draw_solids(axes: Axes, scene: SceneTimeline, time: float) -> None:
    """Draw solid shapes as they hide one another from above: what has one colour and height is drawn together."""
    outlines_by_look: dict[tuple[tuple[float, ...], float], list[np.ndarray]] = {}
    for solid in scene.solids:
        outlines, top_height = solid.project_from_above(time)
        drawing_order = min(SOLID_ORDER + 100.0 * top_height, ON_TOP - 1.0) if top_height > FLOOR_TOLERANCE else 0.0
        outlines_by_look.setdefault((solid.color, round(drawing_order, 3)), []).extend(outlines)
    for (color, drawing_order), outlines in outlines_by_look.items():
        # a hairline hides the seams between the parts of a wall
        shapes = PolyCollection(outlines, facecolor=color, edgecolor=color, linewidth=0.2, zorder=drawing_order)
        shapes.set_rasterized(len(outlines) > MOST_OUTLINES)
        axes.add_collection(shapes, autolim=False)


def _draw_shape(axes: Axes, shape: Shape, time: float) -> None:
    drawing_order = ON_TOP * shape.on_top + 100.0 * shape.height
    points = shape.points
    if shape.faces is None:
        look = {"color": shape.colors[0], "markersize": shape.size, "markeredgewidth": 0.0, "zorder": drawing_order}
        axes.add_line(Line2D(*points.T, linestyle="none", marker="s", **look))
        return
    look = {"alpha": shape.opacity, "linewidth": SEAM if shape.opacity >= 1.0 else 0.0, "joinstyle": "round"}
    X_WF = np.eye(3, 4) if shape.poses is None else shape.poses.at(time)
    for color, area in shape.areas.items():
        polygons = shapely.get_parts(area.normalize())
        polygon_rings = [ring for polygon in polygons for ring in (polygon.exterior, *polygon.interiors)]
        outlines = [shapely.get_coordinates(ring) @ X_WF[:2, :2].T + X_WF[:2, 3] for ring in polygon_rings]
        path = Outline.make_compound_path(*(Outline(outline, closed=True) for outline in outlines))
        axes.add_artist(PathPatch(path, color=color, zorder=drawing_order, **look))
