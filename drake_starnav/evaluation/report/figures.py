"""The plots of a report, as SVG: intervals, success against difficulty, trajectories."""

import io
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from drake_starnav.evaluation.jobs import Record
from drake_starnav.evaluation.report.results import Results
from drake_starnav.evaluation.summary import compute_median_interval, compute_wilson_interval, summarize_records
from drake_starnav.visualization.world_figure import WIDTH, draw_world, make_figure
from drake_starnav.worlds import World

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#8C510A", "#707070")
"""The palette of Okabe and Ito, its yellow replaced by a brown that shows on white, and a grey."""
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*", "h")
DASHES = ("-", (0, (5, 1.5)), (0, (1.5, 1)), (0, (4, 1, 1, 1)))
BINS = 5
"""Number of bins for worlds of similar difficulty."""
LEAST_IN_BIN = 5
"""Least number of worlds in a bin; fewer worlds make fewer bins."""
OBSTACLES = "0.78"
"""Their grey, lighter than elsewhere, as several paths cross them."""


@dataclass(frozen=True)
class Point:
    """A value with its interval; `text` is shown beside it."""

    value: float
    low: float
    high: float
    text: str


def render_svg(figure: "Figure") -> str:
    """The figure as SVG text, reproducible."""
    from matplotlib import rc_context

    svg_text = io.StringIO()
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "starnav", "font.family": "sans-serif"}):
        figure.savefig(svg_text, format="svg", metadata={"Date": None})
    return svg_text.getvalue()


def choose_style(methods: Sequence[str], method: str) -> dict[str, Any]:
    """Colour, marker and line of a method, distinguishable without colour."""
    k = methods.index(method)
    dashes = DASHES[(k + k // len(COLORS)) % len(DASHES)]
    return {"color": COLORS[k % len(COLORS)], "marker": MARKERS[k % len(MARKERS)], "linestyle": dashes}


def collect_figure_data(results: Results) -> list[dict[str, Any]]:
    """Return what the figures show, a row for each point: its figure, scenario, method, x or trial and time, and y."""
    shown_points = {"success": compute_success_points(results), "path over shortest path": compute_path_points(results)}
    rows = [
        {"figure": name, "scenario": scenario, "method": method, "y": p.value, "low": p.low, "high": p.high}
        for name, points in shown_points.items()
        for (scenario, method), p in points.items()
    ]
    for label, measure in DIFFICULTIES:
        for method, x, p in compute_difficulty_points(results, measure):
            rows.append({"figure": label, "method": method, "x": x, "y": p.value, "low": p.low, "high": p.high})
    for record in results.records:
        for robot in record.get("robots", [record]):
            names = {"figure": "trajectories", "scenario": record["scenario"], "method": robot["method"]}
            names |= {"trial": record["trial"], "robot": robot.get("robot", "")}
            path = robot.get("path", [])
            for time, (x, y) in zip(robot.get("path_s", [""] * len(path)), path, strict=True):
                rows.append({**names, "t": time, "x": x, "y": y})
    return rows


def compute_success_points(results: Results) -> dict[tuple[str, str], Point]:
    """Return the success rate of each scenario and method with its 95 % Wilson interval, %."""
    return {
        (summary.scenario, summary.method): Point(
            100.0 * summary.reached / summary.trials,
            100.0 * summary.interval[0],
            100.0 * summary.interval[1],
            f"{100.0 * summary.reached / summary.trials:.1f} %",
        )
        for summary in summarize_records(results.records)
        if summary.trials
    }


def draw_success_figure(results: Results) -> "Figure":
    """Success rates with their 95 % Wilson intervals, a panel for each scenario."""
    label, points = "reached the goal, % (95 % interval)", compute_success_points(results)
    return _draw_panels(results, points, label, axis_limits=(-4.0, 104.0))


def compute_path_points(results: Results) -> dict[tuple[str, str], Point]:
    """Return the median of path over shortest path, where the goal was reached, with its exact interval."""
    points = {}
    for pair, case_records in results.cases.items():
        reached_records = [r for r in case_records if r["outcome"] == "reached" and r["shortest_path_m"]]
        if reached_records:
            ratios = [r["path_length_m"] / r["shortest_path_m"] for r in reached_records]
            median_interval = compute_median_interval(ratios)
            points[pair] = Point(*median_interval, f"{median_interval.value:.3f}")
    return points


def draw_path_figure(results: Results) -> "Figure | None":
    """Median of path over shortest path given the full map, where the goal was reached, with its exact interval."""
    points = compute_path_points(results)
    label = "path / shortest path, median of the trials (95 % interval)"
    return _draw_panels(results, points, label, guide_value=1.0) if points else None


def _draw_panels(
    results: Results,
    points: dict[tuple[str, str], Point],
    label: str,
    *,
    axis_limits: tuple[float, float] | None = None,
    guide_value: float | None = None,
) -> "Figure":
    """A panel for each scenario, a row for each method: a marker, its interval, its number."""
    methods, rows = results.methods, math.ceil(len(results.scenarios) / 4)
    columns = math.ceil(len(results.scenarios) / rows)
    figure = make_figure(rows * (0.95 + 0.38 * len(methods)))
    grid = figure.subplots(rows, columns, sharey=True, sharex=axis_limits is not None, squeeze=False)
    figure.supxlabel(label, fontsize=10)
    for axes in grid.flat[len(results.scenarios) :]:
        axes.set_axis_off()
    for axes, scenario in zip(grid.flat, results.scenarios, strict=False):
        axes.set_title(scenario, fontsize=11, parse_math=False)
        axes.tick_params(labelbottom=True)
        shown_points = {y: points[scenario, m] for y, m in enumerate(methods) if (scenario, m) in points}
        for y, point in shown_points.items():
            style = choose_style(methods, methods[y])
            axes.plot([point.low, point.high], [y, y], color=style["color"], linewidth=2.0)
            axes.plot(point.value, y, color=style["color"], marker=style["marker"], markersize=6)
        if guide_value is not None:
            axes.axvline(guide_value, color="0.6", linewidth=0.8, zorder=0)
        if axis_limits is not None:
            axes.set_xlim(*axis_limits)
        else:
            axes.margins(x=0.12)
        for y, point in shown_points.items():
            _label_point(axes, point, y)
        axes.grid(axis="x", color="0.9")
        axes.spines[["top", "right"]].set_visible(False)
    grid[0, 0].set_yticks(range(len(methods)), methods, parse_math=False)
    grid[0, 0].set_ylim(len(methods) - 0.5, -0.7)
    return figure


def _label_point(axes: "Axes", point: Point, y: float) -> None:
    """Write a point's number above it, inside the axes, whose limits are final."""
    axis_start, axis_end = axes.get_xlim()
    axis_share = (point.value - axis_start) / (axis_end - axis_start)
    text_side = "left" if axis_share < 0.2 else "right" if axis_share > 0.8 else "center"
    axes.annotate(point.text, (point.value, y), (0, 4), textcoords="offset points", ha=text_side, fontsize=8.5)


def compute_detour(record: Record) -> float | None:
    """Ratio of the shortest path to the straight line; None if the record has no such data."""
    shortest, straight = record.get("shortest_path_m"), record.get("straight_line_m")
    return shortest / straight if shortest and straight else None


DIFFICULTIES: tuple[tuple[str, Callable[[Record], float | None]], ...] = (
    ("shortest path / straight line", compute_detour),
    ("tightest gap on the shortest path, m", lambda record: record.get("tightest_gap_m")),
)
"""Measures of how difficult a world is, in words, by the record of a trial; None where the record does not tell."""


def draw_difficulty_figure(results: Results) -> "Figure | None":
    """Success rate against the difficulty of the world, over all scenarios, with 95 % Wilson intervals."""
    panels = [(label, compute_difficulty_points(results, measure)) for label, measure in DIFFICULTIES]
    panels = [panel for panel in panels if panel[1]]
    if not panels:
        return None
    figure = make_figure(3.9)
    grid = figure.subplots(1, len(panels), squeeze=False)[0]
    for axes, (label, points) in zip(grid, panels, strict=True):
        _draw_success_by_difficulty(axes, results.methods, points)
        axes.set_xlabel(label)
    grid[0].set_ylabel("reached the goal, %")
    _add_legend(figure, *grid[0].get_legend_handles_labels())
    return figure


def _draw_success_by_difficulty(
    axes: "Axes", methods: Sequence[str], points: Sequence[tuple[str, float, Point]]
) -> None:
    """Draw a line for each method, a little aside of the others', through points as `compute_difficulty_points`."""
    places = sorted({x for _, x, _ in points})
    spread = 0.25 * min(np.diff(places), default=0.0) / len(methods)
    for k, method in enumerate(methods):
        offset = spread * (k - (len(methods) - 1) / 2)
        own_points = {x + offset: point for name, x, point in points if name == method}
        style, rates = choose_style(methods, method), [point.value for point in own_points.values()]
        axes.plot(list(own_points), rates, **style, markersize=5, linewidth=1.3, label=method)
        for x, point in own_points.items():
            axes.plot([x, x], [point.low, point.high], color=style["color"], linewidth=1.0)
    axes.set_ylim(-4.0, 104.0)
    axes.grid(color="0.92")
    axes.spines[["top", "right"]].set_visible(False)


def compute_difficulty_points(
    results: Results, measure: Callable[[Record], float | None]
) -> list[tuple[str, float, Point]]:
    """Return by method, over all scenarios, where the worlds of a bin lie, and their success rate with its interval, %.

    A bin lies where its median is, of all methods' trials.
    """
    bin_edges, points = compute_difficulty_edges(results.records, measure), []
    known_records = [(r["method"], measure(r), r["outcome"] == "reached") for r in results.records]
    known_records = [each for each in known_records if each[1] is not None]
    values = np.array([value for _, value, _ in known_records], dtype=float)
    record_bins = np.clip(np.searchsorted(bin_edges, values, side="right") - 1, 0, len(bin_edges) - 2)
    for method in results.methods:
        for b in range(len(bin_edges) - 1):
            reached_flags = [
                each[2] for each, own in zip(known_records, record_bins, strict=True) if own == b and each[0] == method
            ]
            if reached_flags:
                reached_count, m = sum(reached_flags), len(reached_flags)
                low, high = compute_wilson_interval(reached_count, m)
                point = Point(100.0 * reached_count / m, 100.0 * low, 100.0 * high, f"{reached_count} of {m}")
                points.append((method, float(np.median(values[record_bins == b])), point))
    return points


def compute_difficulty_edges(records: Sequence[Record], measure: Callable[[Record], float | None]) -> np.ndarray:
    """Edges of bins with about equally many worlds, shape (k + 1,), ascending; empty if no record has the data."""
    world_difficulties = {(r["scenario"], r["trial"]): measure(r) for r in records if measure(r) is not None}
    values = np.array(sorted(value for value in world_difficulties.values() if value is not None))
    if len(values) == 0 or values[0] == values[-1]:
        return np.zeros(0)
    bin_count = min(BINS, max(1, len(values) // LEAST_IN_BIN))
    return np.unique(np.quantile(values, np.linspace(0.0, 1.0, bin_count + 1)))


def draw_trajectory_figure(results: Results, scenario: str, count: int) -> "Figure | None":
    """The driven paths of all methods over each of the first `count` worlds of a scenario."""
    from drake_starnav.navigation.robot import robot_world  # late: it loads Drake

    trials: dict[int, list[Record]] = {}
    for record in results.records:
        if record["scenario"] == scenario and record.get("path"):
            trials.setdefault(record["trial"], []).append(record)
    shown_trials = sorted(trials)[:count]
    if not shown_trials:
        return None
    first_records = [trials[trial][0] for trial in shown_trials]
    worlds = [robot_world(results.scenario(record), record["seed"]) for record in first_records]
    figure, grid = _make_grid_of_worlds(worlds[0], len(worlds))
    for axes, trial, world in zip(grid, shown_trials, worlds, strict=False):
        _draw_task(axes, world)
        for record in trials[trial]:
            for robot in record.get("robots", [record]):
                _draw_path(axes, robot, results.methods)
        difficulties = (measure(trials[trial][0]) for _, measure in DIFFICULTIES)
        numbers = [f"{value:.2f}" for value in difficulties if value is not None]
        axes.set_title(" · ".join((f"trial {trial}", *numbers)), fontsize=8.5, pad=2)
    handles = {line.get_label(): line for axes in grid for line in axes.get_legend_handles_labels()[0]}
    methods = [method for method in results.methods if method in handles]
    _add_legend(figure, [handles[method] for method in methods], methods)
    return figure


def _make_grid_of_worlds(world: World, count: int) -> tuple["Figure", Sequence["Axes"]]:
    """Make a figure with bare axes for so many worlds of one size."""
    x0, y0, x1, y1 = world.extent
    aspect = (x1 - x0) / (y1 - y0)
    columns = 3 if aspect > 1.6 else 4 if aspect > 0.7 else 6
    rows, width = math.ceil(count / columns), WIDTH / columns
    figure = make_figure(rows * (min(1.6 * width, (width - 0.2) / aspect) + 0.3) + 0.4)
    grid = list(figure.subplots(rows, columns, squeeze=False).flat)
    for axes in grid:
        axes.set_axis_off()
    return figure, grid


def _draw_path(axes: "Axes", record: Record, methods: Sequence[str]) -> None:
    """Draw a trial's path in the style of its method, and a cross at its end unless it reached the goal."""
    method = record["method"]
    rank, path, style = methods.index(method), np.array(record["path"]), choose_style(methods, method)
    marker_shift = 0.25 * rank / len(methods)  # markers apart from one another's
    line = {**style, "linewidth": 1.5, "alpha": 0.9, "markersize": 4, "markevery": (marker_shift, 0.25)}
    axes.plot(*path.T, **line, label=method, zorder=4 - 0.1 * rank)  # the first method lies on top
    if record["outcome"] != "reached":
        axes.plot(*path[-1], marker="x", color=style["color"], markersize=7, markeredgewidth=2.2, zorder=5)


def _add_legend(figure: "Figure", handles: Sequence[Any], labels: Sequence[str]) -> None:
    columns = min(len(labels), len(COLORS))
    legend = figure.legend(handles, labels, loc="outside upper center", ncols=columns, frameon=False, fontsize=9)
    for text in legend.get_texts():
        text.set_parse_math(False)


def _draw_task(axes: "Axes", world: World) -> None:
    draw_world(axes, world, OBSTACLES, paths=False)
    axes.plot(*world.start[:2], marker="o", color="0.2", markersize=4, linestyle="none", zorder=5)
    axes.plot(*world.goal, marker="*", color="0.2", markersize=9, linestyle="none", zorder=5)
    x0, y0, x1, y1 = world.extent
    axes.set_xlim(x0, x1)
    axes.set_ylim(y0, y1)
    axes.set_aspect("equal")
