"""The page around a scene: Meshcat's own, with a caption, camera buttons, a legend and a bar with clock and scale."""

import html
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from drake_starnav.errors import StarnavError, shown
from drake_starnav.visualization.meshes import (
    DECK_COLOR,
    LAYERS,
    SPEED_COLORS,
    Layer,
    find_seen_color,
    make_five_pointed_star,
)

ROOT = "starnav"
"""Folder of Meshcat's panel that holds the layers."""
VIEWS = ("top", "follow", "oblique")
"""Names of the camera presets; page.js says how each looks down."""
OWN_VIEW = "own"

Extent = tuple[float, float, float, float]


@dataclass(frozen=True)
class Caption:
    """The text beside a scene.

    Attributes:
        heading: e.g. the scenario.
        lines: e.g. method and seed, outcome.
        layers: the rows of the legend by name, lowest first; those without a label are left out. By default all.
        shown: names of the layers that are shown at first; None for all.
    """

    heading: str
    lines: tuple[str, ...] = ()
    layers: Mapping[str, Layer] = field(default_factory=lambda: LAYERS)
    shown: frozenset[str] | None = None

    @property
    def legend(self) -> dict[str, Layer]:
        """The rows of the legend, from the highest layer to the lowest."""
        return {k: layer for k, layer in sorted(self.layers.items(), key=lambda row: -row[1].height) if layer.label}

    def shows(self, name: str) -> bool:
        """Whether a layer, or an object in its folder, is shown at first."""
        hidden_layers = set() if self.shown is None else set(self.layers) - self.shown
        return not any(f"{name}/".startswith(f"{layer}/") for layer in hidden_layers)


@dataclass(frozen=True)
class Cameras:
    """The camera presets of a page.

    Attributes:
        extent: the box of the floor that `top` and `oblique` show, W, m.
        view: the one the page opens with; `OWN_VIEW` leaves Meshcat's camera where it is.
        followed: path in Meshcat of the object that the view `follow` moves with.
        start: its initial position, (x, y), W, m.
    """

    extent: Extent
    view: str
    followed: str
    start: tuple[float, float]

    def __post_init__(self) -> None:
        check_view(self.view)


def around_robot(position: np.ndarray) -> Extent:
    """The box of the floor that `follow` shows: (x_min, y_min, x_max, y_max), W, m."""
    x, y = np.asarray(position, dtype=float)[:2].tolist()
    return x - 4.5, y - 3.5, x + 4.5, y + 3.5


def check_view(view: str) -> None:
    """Raise `StarnavError` for an unknown view."""
    if view not in (*VIEWS, OWN_VIEW):
        raise StarnavError(f"camera view is {shown(view)}; allowed: one of {', '.join((*VIEWS, OWN_VIEW))}")


def add_panel(page: str, caption: Caption, cameras: Cameras) -> str:
    """A Meshcat page with a panel on its left, or below the scene where the window is narrow, and a bar.

    Its script has two functions for programs: `starnav.show(seconds)` stops the animation at a time, and
    `starnav.look(view)` takes a camera preset.

    Args:
        caption: of the panel, with the rows of the legend, each of which hides or shows its layer.
    """
    followed_path = cameras.followed.strip("/").split("/")
    legend_rows = "".join(_make_row(name, layer, caption, followed_path) for name, layer in caption.legend.items())
    buttons = "".join(f"<button onclick=\"starnav.look('{view}')\">{view}</button>" for view in VIEWS)
    caption_lines = "".join(f"<p>{html.escape(line)}</p>" for line in caption.lines)
    panel_html = (
        f"<style>{_read_page_file('page.css')}</style>"
        f'<div id="starnav-panel"><h1>{html.escape(caption.heading)}</h1>{caption_lines}'
        f'<div id="starnav-views">{buttons}</div>'
        f'<details id="starnav-legend"><summary>legend</summary><table>{legend_rows}</table></details>'
        f'<details id="starnav-controls"><summary>Meshcat</summary></details></div>'
        '<svg id="starnav-axes" width="84" height="84"><path id="starnav-x"/><path id="starnav-y"/>'
        '<text id="starnav-x-name">x</text><text id="starnav-y-name">y</text></svg>'
        '<div id="starnav-bar"><button id="starnav-play" title="play or pause" aria-label="play or pause"></button>'
        '<input id="starnav-time" type="range" min="0" step="any" value="0" aria-label="time">'
        '<span id="starnav-clock">t = 0.0 s</span><div id="starnav-scale"><span></span></div></div>'
        f"<script>{_make_script(cameras, followed_path)}</script>"
    )
    page_title = html.escape(" · ".join((caption.heading, *caption.lines)))
    viewport_tag = '<meta name="viewport" content="width=device-width, initial-scale=1">'
    page = page.replace("<title>Drake MeshCat</title>", f"{viewport_tag}<title>{page_title}</title>", 1)
    head, end, tail = page.rpartition("</body>")
    return head + panel_html + end + tail


def _make_row(name: str, layer: Layer, caption: Caption, followed_path: list[str]) -> str:
    """A row of the legend; obstacles that move have no folder of their own and cannot be hidden."""
    path = followed_path if name == "robot" else [ROOT, *name.split("/")]
    data = f' data-path="{html.escape(json.dumps(path))}" title="hide or show"' if name != "moving_obstacles" else ""
    off_class = "" if caption.shows(name) else ' class="off"'
    return f"<tr{data}{off_class}><td>{_draw_symbol(layer)}</td><td>{html.escape(layer.label)}</td></tr>"


def _read_page_file(name: str) -> str:
    return Path(__file__).with_name(name).read_text(encoding="utf-8")


def _make_script(cameras: Cameras, followed_path: list[str]) -> str:
    boxes = {view: around_robot(np.array(cameras.start)) if view == "follow" else cameras.extent for view in VIEWS}
    settings = {
        "extents": {view: [float(x) for x in box] for view, box in boxes.items()},
        "view": cameras.view,
        "followed": followed_path,
        "start": [*map(float, cameras.start), 0.0],
    }
    settings_text = json.dumps(settings).replace("<", "\\u003c")  # "<" may end the script, or begin a comment
    return _read_page_file("page.js").replace("SETTINGS", settings_text, 1)


def format_css_color(color: tuple[float, float, float] | np.ndarray) -> str:
    """A colour of red, green, blue, 0 to 1, as CSS."""
    return "rgb({:.0f},{:.0f},{:.0f})".format(*(255.0 * np.asarray(color)))


def _draw_symbol(layer: Layer) -> str:
    """The layer's symbol in the legend, as inline SVG."""
    color = format_css_color(find_seen_color(layer))
    star_rim = make_five_pointed_star(np.zeros(2), 6.5, 0.0).vertices[1:]
    star_corners = " ".join(f"{11.0 + x:.1f},{7.0 - y:.1f}" for x, y, _ in star_rim)
    color_shares = np.linspace(0.0, 1.0, len(SPEED_COLORS))
    gradient_stops = "".join(
        f'<stop offset="{at:.2f}" stop-color="{format_css_color(c)}"/>'
        for at, c in zip(color_shares, SPEED_COLORS, strict=True)
    )
    area_svg = f'<rect x="2" y="2" width="18" height="10" fill="{color}"/>'
    symbol_shapes = {
        "area": area_svg,
        "region": area_svg.replace("/>", f' stroke="{format_css_color(layer.color)}"/>'),
        "line": f'<path d="M1 7H21" stroke="{color}" stroke-width="3"/>',
        "disc": f'<circle cx="11" cy="7" r="4.5" fill="{color}"/>',
        "arrow": f'<path d="M2 6H13V2L20 7L13 12V8H2Z" fill="{color}"/>',
        "outline": f'<circle cx="11" cy="7" r="5.7" fill="none" stroke="{color}" stroke-width="1.4"/>',
        "front": f'<path d="M7 2L16 7L7 12Z" fill="{color}"/>',
        "dot": f'<circle cx="11" cy="7" r="2.2" fill="{color}"/>',
        "ring": f'<circle cx="11" cy="7" r="5" fill="none" stroke="{color}" stroke-width="2.4"/>',
        "cross": f'<path d="M7 3L15 11M15 3L7 11" stroke="{color}" stroke-width="2.6"/>',
        "star": f'<polygon points="{star_corners}" fill="{color}"/>',
        "robot": f'<circle cx="11" cy="7" r="6.5" fill="{color}"/>'
        f'<circle cx="11" cy="7" r="4.5" fill="{format_css_color(DECK_COLOR)}"/>',
        "gradient": f'<linearGradient id="starnav-speed">{gradient_stops}</linearGradient>'
        '<rect x="1" y="5" width="20" height="4" fill="url(#starnav-speed)"/>',
    }
    return f'<svg width="22" height="14">{symbol_shapes[layer.symbol]}</svg>'
