"""Pictures of a recorded run by Matplotlib, as a browser shows it from above."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from PIL import Image

from drake_starnav.errors import StarnavError
from drake_starnav.visualization.camera import (
    BAR_HEIGHT,
    PAGE,
    PANEL_WIDTH,
    around_robot,
    check_view,
    floor_to_page,
    scale_length,
)
from drake_starnav.visualization.film import Film
from drake_starnav.visualization.page import Caption
from drake_starnav.visualization.scene_plot import PANEL_ORDER, TEXT_COLOR, draw_legend, draw_scene

DPI = 72.0
"""One point is one pixel of the page."""


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
        extent = around_robot(followed) if self._view == "follow" else self._film.extent
        matrix, offset = floor_to_page(extent)

        def to_page(points: np.ndarray) -> np.ndarray:
            return np.asarray(points, dtype=float)[..., :2] @ matrix.T + offset

        scale = math.sqrt(abs(np.linalg.det(matrix)))
        draw_scene(axes, self._film, time, to_page, scale)
        _draw_panel(axes, self._film.caption)
        _draw_bar(axes, time, scale)
        canvas.draw()
        return Image.fromarray(np.array(canvas.buffer_rgba())[..., :3])


def _draw_panel(axes: Axes, caption: Caption) -> None:
    axes.add_artist(Rectangle((0.0, 0.0), PANEL_WIDTH, PAGE[1], color="white", linewidth=0.0, zorder=PANEL_ORDER))
    text = {"zorder": PANEL_ORDER, "verticalalignment": "center", "color": TEXT_COLOR, "parse_math": False}
    axes.text(12.0, 21.0, caption.heading, size=16.0, weight="bold", **text)
    for k, line in enumerate(caption.lines):
        axes.text(12.0, 45.0 + 18.0 * k, line, size=12.0, **text)
    draw_legend(axes, caption, 12.0, 45.0 + 18.0 * len(caption.lines) + 15.0)


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
