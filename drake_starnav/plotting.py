"""Figures of worlds and robots with Matplotlib, and recordings inside a notebook."""

from drake_starnav.geometry.trajectory import Motion
from drake_starnav.visualization.inline_page import InlinePage
from drake_starnav.visualization.world_figure import draw_goal, draw_robot, draw_world, save_figure, world_axes

__all__ = ["InlinePage", "Motion", "draw_goal", "draw_robot", "draw_world", "save_figure", "world_axes"]
