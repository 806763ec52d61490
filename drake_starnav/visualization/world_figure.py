"""Pictures of worlds without a run: obstacles, zones, start, goal, and the shortest path between them."""

from pathlib import Path
from typing import Any

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.footprint import Footprint, disc
from drake_starnav.geometry.se2 import transform_points
from drake_starnav.scenario.schema import Scenario
from drake_starnav.utils.files import replace_file
from drake_starnav.visualization import meshes
from drake_starnav.worlds.world import OPEN_BORDER, World

WIDTH = 11.0
"""Width of a plot, inches; a page shows an inch as 96 pixels."""
EMBEDDED_FONTS = {"pdf.fonttype": 42, "svg.fonttype": "none"}
"""Matplotlib's settings by which a PDF holds TrueType fonts, as publishers ask for, and an SVG texts."""
OBSTACLES, WALLS = "0.62", "0.35"
"""Greys of the obstacles and of the walls around a world."""
START, GOAL, PATH = "#D55E00", "#009E73", "#0072B2"
"""Distinguishable for colour-blind readers (Okabe and Ito, 2008); the symbols differ as well."""
MOST_OUTLINES = 300
"""A world with more outlines is drawn as pixels, to keep vector graphics small."""


def make_figure(height: float, width: float = WIDTH) -> Any:
    """An empty Matplotlib figure, `height` and `width` in inches; a `StarnavError` if Matplotlib is not installed."""
    try:
        from matplotlib.figure import Figure  # without pyplot, which needs a display and keeps figures alive
    except ImportError:
        raise StarnavError("matplotlib is not installed; allowed: pip install 'drake-starnav[report]'") from None
    return Figure(figsize=(width, height), layout="constrained")


def draw_world(axis: Any, world: World, obstacles: str = OBSTACLES, *, paths: bool = True) -> None:
    """Draw the obstacles into Matplotlib axes of equal scales, moving ones at first, and the walls around them.

    `obstacles` is their colour, `paths` whether to draw the paths of the moving ones.
    """
    from matplotlib.collections import PatchCollection, PolyCollection
    from matplotlib.patches import Circle, Rectangle

    # A hairline edge hides the seams between the parts of a wall.
    discs = PatchCollection([Circle((x, y), radius) for x, y, radius in world.discs], facecolor=obstacles, linewidth=0)
    polygon_patches = PolyCollection(world.polygons, facecolor=obstacles, edgecolor=obstacles, linewidth=0.2)
    for collection in (discs, polygon_patches):
        collection.set(zorder=1, rasterized=len(world.discs) + len(world.polygons) > MOST_OUTLINES)
        axis.add_collection(collection)
    moving, moving_color = world.moving_obstacles, meshes.MOVING_OBSTACLES.color
    for radius, path in zip(moving.radii, moving.paths, strict=True):
        if paths:
            axis.plot(*path[:, 1:].T, color=moving_color, linewidth=0.6, alpha=0.6, zorder=1)
        axis.add_patch(Circle(path[0, 1:], radius, facecolor=moving_color, zorder=1))
    if world.bounds is not None:
        x0, y0, x1, y1 = world.bounds
        axis.add_patch(Rectangle((x0, y0), x1 - x0, y1 - y0, fill=False, edgecolor=WALLS, linewidth=1.5, zorder=1))


def world_axes(world: World, title: str) -> tuple[Any, Any]:
    """A Matplotlib figure of a world seen from above, for `save_figure`, and its axes to draw more into.

    Its width, inches, is 9 or 7, by the world's shape.
    """
    x0, y0, x1, y1 = world.extent
    spare = 0.0 if world.bounds is not None else OPEN_BORDER - 0.4
    x0, y0, x1, y1 = x0 + spare, y0 + spare, x1 - spare, y1 - spare
    width = 9.0 if x1 - x0 >= y1 - y0 else 7.0
    figure = make_figure(min(12.0, max(4.0, width * (y1 - y0) / (x1 - x0) + 1.0)), width)
    axis = figure.add_subplot()
    draw_world(axis, world)
    axis.set_xlim(x0 - 0.2, x1 + 0.2)
    axis.set_ylim(y0 - 0.2, y1 + 0.2)
    axis.set_aspect("equal")
    axis.set_xlabel("x in m")
    axis.set_ylabel("y in m")
    axis.set_title(title, parse_math=False)
    return figure, axis


def draw_robot(
    axis: Any, pose: tuple[float, ...] | np.ndarray, shape: Footprint | float, color: str, label: str = ""
) -> None:
    """Draw a robot's rim and heading: pose (x, y, yaw) in W, and its footprint, or the radius of a disc, m."""
    from matplotlib.patches import Polygon

    footprint = disc(shape) if isinstance(shape, float) else shape
    robot_pose = np.asarray(pose, dtype=float)
    for part in footprint.parts or (footprint.outline,):
        part_corners = transform_points(robot_pose, part)
        axis.add_patch(Polygon(part_corners, facecolor="none", edgecolor=color, linewidth=1.6, zorder=3))
    heading_line = transform_points(robot_pose, np.array([(0.0, 0.0), (footprint.radius, 0.0)]))
    axis.plot(*heading_line.T, color=color, linewidth=1.6, label=label or None, zorder=3)


def draw_goal(axis: Any, goal: tuple[float, float] | np.ndarray, label: str = "goal") -> None:
    """Draw a goal, (x, y) in W."""
    axis.plot(*goal, "*", color=GOAL, markersize=13.0, label=label or None, linestyle="none", zorder=3)


def render_figure(figure: Any, *, dpi: int = 80) -> np.ndarray:
    """A figure as pixels: shape (height, width, 3), bytes."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    figure.set_dpi(dpi)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.array(canvas.buffer_rgba())[..., :3]


def save_figure(figure: Any, file: str | Path, *, dpi: int = 80, legend: bool = True) -> None:
    """Write a figure as PNG, SVG or PDF, by the name's end, with one legend below if `legend`."""
    from matplotlib import rc_context

    if legend:
        legend_columns = max(1, round(4 * figure.get_figwidth() / 7.0))
        figure.legend(loc="outside lower center", ncols=min(4, legend_columns), frameon=False)
    file_suffix = Path(file).suffix.lower()
    with replace_file(Path(file)) as temporary, rc_context(EMBEDDED_FONTS):
        figure.savefig(temporary, dpi=dpi, format=file_suffix[1:] if file_suffix in (".svg", ".pdf") else "png")


def save_drive(world: World, trail: np.ndarray, title: str, file: str | Path) -> None:
    """Write the figure of a world with the way (n, 2) that was driven in it, W, m, as PNG."""
    figure, axis = world_axes(world, title)
    axis.plot(*trail.T, color=START, label="driven")
    draw_goal(axis, world.goal)
    save_figure(figure, file)


def write_png(world: World, scenario: Scenario, path: np.ndarray | None, title: str, file: Path) -> None:
    """Draw a world, a scenario's zones, start, goal and the shortest path (k, 2), W, m, if there is one, as PNG."""
    figure, axis = world_axes(world, title)
    if path is not None:
        axis.plot(*path.T, color=PATH, linewidth=1.6, label="shortest path", zorder=2)
    for zone, layer in ((zone, meshes.LAYERS[meshes.name_zone_layer(zone)]) for zone in scenario.zones):
        is_known = layer.label in axis.get_legend_handles_labels()[1]
        zone_look = {"facecolor": layer.color, "alpha": layer.opacity, "label": None if is_known else layer.label}
        axis.fill(*np.transpose(zone.polygon), **zone_look, zorder=0.5)
    draw_robot(axis, world.start, scenario.robot.shape, START, "start: the robot")
    draw_goal(axis, world.goal)
    if len(world.moving_obstacles):
        color, label = meshes.MOVING_OBSTACLES.color, f"{meshes.MOVING_OBSTACLES.label}, its path"
        axis.plot([], [], "o-", color=color, markersize=10.0, linewidth=0.6, label=label)
    save_figure(figure, file, dpi=150)
