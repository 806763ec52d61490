"""Moments of a recorded run from straight above, by Matplotlib: vector graphics for papers, and pictures."""

import io
import re
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, MultipleLocator
from PIL import Image

from drake_starnav.errors import StarnavError
from drake_starnav.station.world_geometry import WALL_THICKNESS
from drake_starnav.utils.files import replacing
from drake_starnav.visualization.camera import PAGE, around_robot, check_view
from drake_starnav.visualization.recorded_run import RecordedRun
from drake_starnav.visualization.scene_plot import draw_scene, legend_handles
from drake_starnav.visualization.world_figure import figure_pixels

WIDTH, LEGEND, BORDER, MARGIN = 504.0, 190.0, 46.0, 18.0
"""Of the scene, the legend, the border with the axes' numbers, and that elsewhere, points of 1/72 inch."""
ROW_HEIGHT = 15.0
"""Of the legend, points."""
POINT = 72.0
"""Points an inch."""
DPI = 200
"""Of what is drawn as pixels."""
TEXT_SIZE = 9.0
LONG_NUMBER = re.compile(rb"(\d\.\d\d)\d+")
"""Of an SVG file: a hundredth of a point is as much as anyone sees."""


def moment_figure(recorded: RecordedRun, time: float, view: str = "top", title: str = "") -> Figure:
    """A moment of a run, at a time, s, from above, with axes in metres and a legend on the right.

    The run's caption says which layers are shown; view `follow` shows what is around the first robot.
    """
    walls = 1.5 * WALL_THICKNESS * np.array([-1.0, -1.0, 1.0, 1.0])
    extent = around_robot(recorded.robots[0].motion.at(time)) if view == "follow" else np.add(recorded.extent, walls)
    x0, y0, x1, y1 = extent
    handles = legend_handles(recorded.caption)
    height = WIDTH * (y1 - y0) / (x1 - x0)
    size = BORDER + WIDTH + MARGIN + LEGEND, MARGIN + max(height + BORDER, ROW_HEIGHT * len(handles))
    figure = Figure(figsize=(size[0] / POINT, size[1] / POINT))
    top = 1.0 - (MARGIN + height) / size[1]
    axes = figure.add_axes((BORDER / size[0], top, WIDTH / size[0], height / size[1]), xlim=(x0, x1), ylim=(y0, y1))
    axes.set_aspect("equal")
    axes.set_xlabel("x in m")
    axes.set_ylabel("y in m")
    axes.set_title(title, size=TEXT_SIZE, loc="left", pad=4.0, parse_math=False)
    step = np.diff(MaxNLocator(10, steps=(1, 2, 5, 10)).tick_values(0.0, max(x1 - x0, y1 - y0)))[0]
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MultipleLocator(step))
    draw_scene(axes, recorded, time)
    place = {"loc": "upper left", "bbox_to_anchor": (1.0, 1.0), "frameon": False}  # a longer text makes a file wider
    legend = axes.legend(handles=handles, fontsize=TEXT_SIZE, labelspacing=0.6, **place)
    for text in legend.get_texts():
        text.set_parse_math(False)
    return figure


def write_figure(path: Path, recorded: RecordedRun, time: float) -> None:
    """Write `moment_figure` as SVG or PDF, by the name's end; the same run gives the same file."""
    dated = {".svg": "Date", ".pdf": "CreationDate"}[path.suffix]
    file = io.BytesIO()
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "starnav", "font.size": TEXT_SIZE}):
        figure = moment_figure(recorded, time)
        figure.savefig(file, format=path.suffix[1:], dpi=DPI, bbox_inches="tight", metadata={dated: None})
    content = file.getvalue()
    if path.suffix == ".svg":
        content = LONG_NUMBER.sub(rb"\1", content)
    with replacing(path) as temporary:
        temporary.write_bytes(content)


class PlotCamera:
    """Takes pictures of a recorded run from above without a browser: `moment_figure` with a title."""

    def __init__(self, recorded: RecordedRun, view: str = "top", width: int = int(PAGE[0])) -> None:
        """Of a run, from the view `top` or `follow`, both looking straight down, for pictures of a width in pixels.

        Raises:
            StarnavError: unknown view, or one that needs a browser.
        """
        check_view(view)
        if view == "oblique":
            raise StarnavError("camera view is 'oblique', which needs Chromium and playwright; allowed: top, follow")
        self._run, self._view, self._width = recorded, view, width

    def __enter__(self) -> "PlotCamera":
        return self

    def __exit__(self, *error: object) -> None:
        pass

    def picture(self, time: float) -> Image.Image:
        """The figure at a time of the run, s."""
        caption = self._run.caption
        title = ", ".join((caption.heading, *caption.lines, f"t = {time:.1f} s"))
        with rc_context({"font.size": TEXT_SIZE}):
            figure = moment_figure(self._run, time, self._view, title)
            return Image.fromarray(figure_pixels(figure, dpi=self._width / figure.get_figwidth()))
