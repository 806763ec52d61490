"""Figures of worlds and robots with Matplotlib, and recordings inside a notebook."""

import html
import os

from drake_starnav.geometry.trajectory import Motion
from drake_starnav.utils.files import read_text
from drake_starnav.visualization.world_figure import (
    draw_goal,
    draw_robot,
    draw_world,
    save_drive,
    save_figure,
    world_axes,
)

__all__ = ["InlinePage", "Motion", "draw_goal", "draw_robot", "draw_world", "save_drive", "save_figure", "world_axes"]


class InlinePage:
    """A self-contained HTML page, such as a recording, shown as the output of a notebook cell.

    The page becomes part of the notebook, which needs neither the file nor a network to show it.
    """

    def __init__(self, path: str | os.PathLike, *, height: int = 480) -> None:
        """Show an HTML file, `height` pixels high.

        Raises:
            StarnavError: the file cannot be read.
        """
        self._page = read_text(path, f"page {path}", "an HTML file")
        self._height = height

    def _repr_html_(self) -> str:
        """Called by the notebook."""
        page = html.escape(self._page)
        return f'<iframe srcdoc="{page}" style="width: 100%; height: {self._height}px; border: 0"></iframe>'
