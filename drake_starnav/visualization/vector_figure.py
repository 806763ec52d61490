"""Moments of a recorded run as vector graphics with axes in metres, for papers."""

import io
import re
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, MultipleLocator

from drake_starnav.station.world_geometry import WALL_THICKNESS
from drake_starnav.utils.files import replacing
from drake_starnav.visualization.camera import SCENE
from drake_starnav.visualization.film import Film
from drake_starnav.visualization.scene_plot import ROW_HEIGHT, draw_legend, draw_scene

WIDTH, SYMBOLS, BORDER, MARGIN = 504.0, 24.0, 46.0, 12.0
"""Of the scene, the legend's symbols, the border with the axes' numbers, and that elsewhere, points of 1/72 inch."""
POINT = 72.0
"""Points an inch."""
DPI = 200
"""Of what is drawn as pixels."""
TEXT_SIZE = 9.0
LONG_NUMBER = re.compile(rb"(\d\.\d\d)\d+")
"""Of an SVG file: a hundredth of a point is as much as anyone sees."""


def moment_figure(film: Film, time: float) -> Figure:
    """A moment of a run from above, with axes in metres and a legend on the right.

    Args:
        film: the run; its caption says which layers are shown.
        time: of the run, s.
    """
    x0, y0, x1, y1 = np.add(film.extent, 1.5 * WALL_THICKNESS * np.array([-1.0, -1.0, 1.0, 1.0]))
    rows = sum(map(film.caption.shows, film.caption.legend))
    height = WIDTH * (y1 - y0) / (x1 - x0)
    size = BORDER + WIDTH + MARGIN + SYMBOLS, MARGIN + max(height + BORDER, ROW_HEIGHT * rows)
    figure = Figure(figsize=(size[0] / POINT, size[1] / POINT))
    top = 1.0 - (MARGIN + height) / size[1]
    axes = figure.add_axes((BORDER / size[0], top, WIDTH / size[0], height / size[1]), xlim=(x0, x1), ylim=(y0, y1))
    axes.set_aspect("equal")
    axes.set_xlabel("x in m")
    axes.set_ylabel("y in m")
    step = np.diff(MaxNLocator(10, steps=(1, 2, 5, 10)).tick_values(0.0, max(x1 - x0, y1 - y0)))[0]
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MultipleLocator(step))
    draw_scene(axes, film, time, lambda points: np.asarray(points)[..., :2], 1.0, WIDTH / SCENE[0])
    place = (BORDER + WIDTH + MARGIN) / size[0], 0.0, SYMBOLS / size[0], 1.0
    legend = figure.add_axes(place, xlim=(0.0, SYMBOLS), ylim=(size[1], 0.0))  # text beside it makes the figure wider
    legend.set_axis_off()
    draw_legend(legend, film.caption, 0.0, MARGIN + 0.5 * ROW_HEIGHT, size=TEXT_SIZE)
    return figure


def write_figure(path: Path, film: Film, time: float) -> None:
    """Write `moment_figure` as SVG or PDF, by the name's end; the same run gives the same file."""
    dated = {".svg": "Date", ".pdf": "CreationDate"}[path.suffix]
    file = io.BytesIO()
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "starnav", "font.size": TEXT_SIZE}):
        figure = moment_figure(film, time)
        figure.savefig(file, format=path.suffix[1:], dpi=DPI, bbox_inches="tight", metadata={dated: None})
    content = file.getvalue()
    if path.suffix == ".svg":
        content = LONG_NUMBER.sub(rb"\1", content)
    with replacing(path) as temporary:
        temporary.write_bytes(content)
