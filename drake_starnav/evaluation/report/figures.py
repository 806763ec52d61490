"""The plots of a report, as SVG: intervals, success against difficulty, trajectories."""

import io
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from drake_starnav.evaluation.jobs import Record
from drake_starnav.evaluation.report.results import Results
from drake_starnav.evaluation.summary import compare, median_interval, summarise, wilson_interval
from drake_starnav.visualization.world_figure import WIDTH, draw_world, new_figure
from drake_starnav.worlds import World

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#8C510A", "#707070")
"""The palette of Okabe and Ito, its yellow replaced by a brown that shows on white, and a grey."""
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*", "h")
DASHES = ("-", (0, (5, 1.5)), (0, (1.5, 1)), (0, (4, 1, 1, 1)))
NARROW = 0.4
"""Width of the figures for narrow windows, as a share of the others'; they have as many fewer panels a row."""
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


def svg(figure: "Figure") -> str:
    """The figure as SVG text, reproducible."""
    from matplotlib import rc_context

    file = io.StringIO()
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "starnav", "font.family": "sans-serif"}):
        figure.savefig(file, format="svg", metadata={"Date": None})
    return file.getvalue()


def style(methods: Sequence[str], method: str) -> dict[str, Any]:
    """Colour, marker and line of a method, distinguishable without colour."""
    k = methods.index(method)
    dashes = DASHES[(k + k // len(COLORS)) % len(DASHES)]
    return {"color": COLORS[k % len(COLORS)], "marker": MARKERS[k % len(MARKERS)], "linestyle": dashes}


def success_figure(results: Results, share: float = 1.0) -> "Figure":
    """Success rates with their 95 % Wilson intervals, a panel for each scenario."""
    points = {
        (s.scenario, s.method): Point(
            100.0 * s.reached / s.trials,
            100.0 * s.interval[0],
            100.0 * s.interval[1],
            f"{100.0 * s.reached / s.trials:.1f} %",
        )
        for s in summarise(results.records)
        if s.trials
    }
    return _panels(results, results.methods, points, "reached the goal, % (95 % interval)", share, limits=(-4.0, 104.0))


def path_figure(results: Results, share: float = 1.0) -> "Figure | None":
    """Median of path over shortest path given the full map, where the goal was reached, with its exact interval."""
    points = {}
    for pair, case in results.cases.items():
        reached = [r for r in case if r["outcome"] == "reached" and r["shortest_path_m"]]
        if reached:
            ratios = [r["path_length_m"] / r["shortest_path_m"] for r in reached]
            median = median_interval(ratios)
            points[pair] = Point(*median, f"{median.value:.3f}")
    label = "path / shortest path, median of the trials (95 % interval)"
    return _panels(results, results.methods, points, label, share, guide=1.0) if points else None


def comparison_figure(
    results: Results, reference: str, field: Literal["time", "path"], label: str, share: float = 1.0
) -> "Figure | None":
    """Median of each method's time or path over the reference's, on trials that both finished, with its interval."""
    points = {}
    for (scenario, method), case in results.cases.items():
        ratio = getattr(compare(case, results.of(scenario, reference)), field)
        if ratio is not None and method != reference:
            value, low, high = (100.0 * x for x in ratio.median)
            points[scenario, method] = Point(value, low, high, f"{value:.1f} %")
    others = [method for method in results.methods if method != reference]
    label = f"{label}, % of {reference}'s, median of the trials (95 % interval)"
    return _panels(results, others, points, label, share, guide=100.0) if points else None


def _panels(
    results: Results,
    methods: Sequence[str],
    points: dict[tuple[str, str], Point],
    label: str,
    share: float,
    *,
    limits: tuple[float, float] | None = None,
    guide: float | None = None,
) -> "Figure":
    """A panel for each scenario, a row for each method: a marker, its interval, its number."""
    rows = math.ceil(len(results.scenarios) / _a_row(4, share))
    columns = math.ceil(len(results.scenarios) / rows)
    figure = new_figure(rows * (0.95 + 0.38 * len(methods)), share * WIDTH)
    grid = figure.subplots(rows, columns, sharey=True, sharex=limits is not None, squeeze=False)
    figure.supxlabel(label, fontsize=10)
    for axes in grid.flat[len(results.scenarios) :]:
        axes.set_axis_off()
    for axes, scenario in zip(grid.flat, results.scenarios, strict=False):
        axes.set_title(scenario, fontsize=11, parse_math=False)
        axes.tick_params(labelbottom=True)
        for y, method in enumerate(methods):
            point = points.get((scenario, method))
            if point is None:
                continue
            look = style(results.methods, method)
            axes.plot([point.low, point.high], [y, y], color=look["color"], linewidth=2.0)
            axes.plot(point.value, y, color=look["color"], marker=look["marker"], markersize=6)
        if guide is not None:
            axes.axvline(guide, color="0.6", linewidth=0.8, zorder=0)
        if limits is not None:
            axes.set_xlim(*limits)
        else:
            axes.margins(x=0.12)
        for y, method in enumerate(methods):
            if (scenario, method) in points:
                _label(axes, points[scenario, method], y)
        axes.grid(axis="x", color="0.9")
        axes.spines[["top", "right"]].set_visible(False)
    grid[0, 0].set_yticks(range(len(methods)), methods, parse_math=False)
    grid[0, 0].set_ylim(len(methods) - 0.5, -0.7)
    return figure


def _a_row(panels: int, share: float) -> int:
    """How many panels a figure of a share of the width has in a row."""
    return max(1, round(panels * share - 0.2))


def _label(axes: "Axes", point: Point, y: float) -> None:
    """Write a point's number above it, inside the axes, whose limits are final."""
    low, high = axes.get_xlim()
    share = (point.value - low) / (high - low)
    side = "left" if share < 0.2 else "right" if share > 0.8 else "center"
    axes.annotate(point.text, (point.value, y), (0, 4), textcoords="offset points", ha=side, fontsize=8.5)


def detour(record: Record) -> float | None:
    """Ratio of the shortest path to the straight line; None if the record has no such data."""
    shortest, straight = record.get("shortest_path_m"), record.get("straight_line_m")
    return shortest / straight if shortest and straight else None


def gap(record: Record) -> float | None:
    """The tightest gap on the shortest path, m; None without obstacles nearby or without such data in the record."""
    return record.get("tightest_gap_m")


DIFFICULTIES: tuple[tuple[str, Callable[[Record], float | None]], ...] = (
    ("shortest path / straight line", detour),
    ("tightest gap on the shortest path, m", gap),
)


def difficulty_figure(results: Results, share: float = 1.0) -> "Figure | None":
    """Success rate against the difficulty of the world, over all scenarios, with 95 % Wilson intervals."""
    panels = [(label, measure, difficulty_edges(results.records, measure)) for label, measure in DIFFICULTIES]
    panels = [panel for panel in panels if len(panel[2])]
    if not panels:
        return None
    columns = min(len(panels), _a_row(2, share))
    rows = math.ceil(len(panels) / columns)
    figure = new_figure(3.9 * rows, share * WIDTH)
    grid = figure.subplots(rows, columns, squeeze=False)
    for axes, (label, measure, edges) in zip(grid.flat, panels, strict=True):
        spread = 0.25 * np.diff(edges).min() / len(results.methods)
        for k, method in enumerate(results.methods):
            trials = [(measure(r), r["outcome"] == "reached") for r in results.records if r["method"] == method]
            known = np.array([(value, reached) for value, reached in trials if value is not None]).reshape(-1, 2)
            bins = np.clip(np.searchsorted(edges, known[:, 0], side="right") - 1, 0, len(edges) - 2)
            shown = [b for b in range(len(edges) - 1) if (bins == b).any()]
            x = [np.median(known[bins == b, 0]) + spread * (k - (len(results.methods) - 1) / 2) for b in shown]
            counts = [(int(known[bins == b, 1].sum()), int((bins == b).sum())) for b in shown]
            look = style(results.methods, method)
            axes.plot(x, [100.0 * n / m for n, m in counts], **look, markersize=5, linewidth=1.3, label=method)
            for at, (n, m) in zip(x, counts, strict=True):
                low, high = wilson_interval(n, m)
                axes.plot([at, at], [100.0 * low, 100.0 * high], color=look["color"], linewidth=1.0)
        axes.set_xlabel(label)
        axes.set_ylim(-4.0, 104.0)
        axes.grid(color="0.92")
        axes.spines[["top", "right"]].set_visible(False)
    for axes in grid[:, 0]:
        axes.set_ylabel("reached the goal, %")
    handles, labels = figure.axes[0].get_legend_handles_labels()
    _legend(figure, handles, labels)
    return figure


def difficulty_edges(records: Sequence[Record], measure: Callable[[Record], float | None]) -> np.ndarray:
    """Edges of bins with about equally many worlds, shape (k + 1,), ascending; empty if no record has the data."""
    worlds = {(r["scenario"], r["trial"]): measure(r) for r in records if measure(r) is not None}
    values = np.array(sorted(value for value in worlds.values() if value is not None))
    if len(values) == 0 or values[0] == values[-1]:
        return np.zeros(0)
    bins = min(BINS, max(1, len(values) // LEAST_IN_BIN))
    return np.unique(np.quantile(values, np.linspace(0.0, 1.0, bins + 1)))


def trajectory_figure(results: Results, scenario: str, count: int, share: float = 1.0) -> "Figure | None":
    """The driven paths of all methods over each of the first `count` worlds of a scenario."""
    trials: dict[int, list[Record]] = {}
    for record in results.records:
        if record["scenario"] == scenario and record.get("path"):
            trials.setdefault(record["trial"], []).append(record)
    shown = sorted(trials)[:count]
    if not shown:
        return None
    worlds = {trial: _world(results, trials[trial][0]) for trial in shown}
    x0, y0, x1, y1 = next(iter(worlds.values())).extent
    columns = _a_row(3 if x1 - x0 > 1.6 * (y1 - y0) else 4 if x1 - x0 > 0.7 * (y1 - y0) else 6, share)
    rows = math.ceil(len(shown) / columns)
    width = share * WIDTH / columns
    height = min(1.6 * width, (width - 0.2) * (y1 - y0) / (x1 - x0)) + 0.3
    figure = new_figure(rows * height + 0.4, share * WIDTH)
    grid = figure.subplots(rows, columns, squeeze=False)
    for axes in grid.flat:
        axes.set_axis_off()
    for axes, trial in zip(grid.flat, shown, strict=False):
        _draw_task(axes, worlds[trial])
        for robot in (robot for record in trials[trial] for robot in record.get("robots", [record])):
            look = style(results.methods, robot["method"])
            path = np.array(robot["path"])
            over = 4 - 0.1 * results.methods.index(robot["method"])  # the first method lies on top
            line = {"color": look["color"], "linestyle": look["linestyle"], "linewidth": 1.5, "alpha": 0.9}
            axes.plot(*path.T, **line, label=robot["method"], zorder=over)
            if robot["outcome"] != "reached":
                axes.plot(*path[-1], marker="x", color=look["color"], markersize=7, markeredgewidth=2.2, zorder=5)
        numbers = [f"{value:.2f}" for value in (detour(trials[trial][0]), gap(trials[trial][0])) if value is not None]
        axes.set_title(" · ".join((f"trial {trial}", *numbers)), fontsize=8.5, pad=2)
    handles = {line.get_label(): line for axes in grid.flat for line in axes.get_legend_handles_labels()[0]}
    ordered = [method for method in results.methods if method in handles]
    _legend(figure, [handles[method] for method in ordered], ordered)
    return figure


def _legend(figure: "Figure", handles: Sequence[Any], labels: Sequence[str]) -> None:
    columns = min(len(labels), _a_row(len(COLORS), figure.get_figwidth() / WIDTH))
    legend = figure.legend(handles, labels, loc="outside upper center", ncols=columns, frameon=False, fontsize=9)
    for text in legend.get_texts():
        text.set_parse_math(False)


def _world(results: Results, record: Record) -> World:
    from drake_starnav.navigation.robot import robot_world  # late: it loads Drake

    scenario = results.scenario(record)
    return robot_world(scenario, record["seed"])


def _draw_task(axes: "Axes", world: World) -> None:
    draw_world(axes, world, OBSTACLES, paths=False)
    axes.plot(*world.start[:2], marker="o", color="0.2", markersize=4, linestyle="none", zorder=5)
    axes.plot(*world.goal, marker="*", color="0.2", markersize=9, linestyle="none", zorder=5)
    x0, y0, x1, y1 = world.extent
    axes.set_xlim(x0, x1)
    axes.set_ylim(y0, y1)
    axes.set_aspect("equal")
