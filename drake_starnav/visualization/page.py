"""A recording's page: Meshcat's own, with a caption, a clock, camera buttons and a legend beside the scene."""

import html
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drake_starnav.visualization.camera import PANEL_WIDTH, check_view
from drake_starnav.visualization.meshes import LAYERS, SPEED_COLORS, Layer


@dataclass(frozen=True)
class Caption:
    """The text beside a scene.

    Attributes:
        heading: e.g. the scenario.
        lines: e.g. method and seed, outcome.
        layers: the rows of the legend, lowest first; those without a label are left out.
    """

    heading: str
    lines: tuple[str, ...] = ()
    layers: Mapping[str, Layer] | None = None

    @property
    def legend(self) -> list[Layer]:
        """The rows of the legend, from the highest layer to the lowest."""
        layers = LAYERS if self.layers is None else self.layers
        return [layer for layer in sorted(layers.values(), key=lambda layer: -layer.height) if layer.label]


@dataclass(frozen=True)
class Cameras:
    """The camera presets of a page.

    Attributes:
        poses: view -> position and target, each of shape (3,), W, m, at the start of the run.
        view: the one the page opens with.
        followed: path in Meshcat of the object that the view `follow` moves with.
        start: its initial position, (x, y), W, m.
    """

    poses: Mapping[str, tuple[np.ndarray, np.ndarray]]
    view: str
    followed: str
    start: tuple[float, float]

    def __post_init__(self) -> None:
        check_view(self.view)


def with_panel(page: str, caption: Caption, cameras: Cameras) -> str:
    """A static Meshcat page with a caption, a clock, camera buttons and a legend on its left.

    Its script has two functions for programs: `starnav.show(seconds)` stops the animation at a time, and
    `starnav.look(view)` takes a camera preset.
    """
    rows = "".join(f"<tr><td>{_symbol(layer)}</td><td>{html.escape(layer.label)}</td></tr>" for layer in caption.legend)
    buttons = "".join(f"<button onclick=\"starnav.look('{view}')\">{view}</button>" for view in cameras.poses)
    panel = (
        f'<style>{_STYLE}</style><div id="starnav-panel"><h1>{html.escape(caption.heading)}</h1>'
        + "".join(f"<p>{html.escape(line)}</p>" for line in caption.lines)
        + f'<p id="starnav-clock">t = 0.0 s</p><div id="starnav-views">{buttons}</div><table>{rows}</table></div>'
        + f"<script>{_SCRIPT.replace('SETTINGS', _settings(cameras))}</script>"
    )
    title = html.escape(" · ".join((caption.heading, *caption.lines)))
    page = page.replace("<title>Drake MeshCat</title>", f"<title>{title}</title>", 1)
    head, end, tail = page.rpartition("</body>")
    return head + panel + end + tail


def _settings(cameras: Cameras) -> str:
    poses = {view: [point.tolist() for point in pose] for view, pose in cameras.poses.items()}
    settings = {
        "poses": poses,
        "view": cameras.view,
        "followed": cameras.followed.strip("/").split("/"),
        "start": [*cameras.start, 0.0],
    }
    return json.dumps(settings).replace("<", "\\u003c")  # "<" may end the script, or begin a comment


_STYLE = (
    f"#starnav-panel{{position:fixed;left:0;top:0;width:{PANEL_WIDTH - 25:g}px;padding:10px 12px;color:#222;"
    "background:rgba(255,255,255,.93);font:12px/1.35 system-ui,sans-serif;pointer-events:none}"
    "#starnav-panel h1{font-size:17px;margin:0 0 4px}#starnav-panel p{margin:0 0 2px}"
    "#starnav-views{margin-top:8px}#starnav-views button{pointer-events:auto;font:inherit;margin-right:4px;"
    "padding:1px 8px;border:1px solid #bbb;border-radius:3px;background:#fff;color:#222;cursor:pointer}"
    "#starnav-views button.on{background:#222;color:#fff;border-color:#222}"
    "#starnav-panel table{margin-top:8px;border-spacing:0 3px}#starnav-panel svg{display:block;margin-right:6px}"
)
_SCRIPT = """
const starnav = (function () {
  const settings = SETTINGS;
  const clock = document.getElementById('starnav-clock');
  const buttons = document.querySelectorAll('#starnav-views button');
  let view = settings.view, at = null;
  const drawn = (p) => [p[0], p[2], -p[1]];  // three.js has y up
  function followed() {
    viewer.scene.updateMatrixWorld(true);
    const e = viewer.scene_tree.find(settings.followed).object.matrixWorld.elements;
    return [e[12], 0, e[14]];
  }
  function move(by) {
    const target = viewer.controls.target.toArray().map((x, i) => x + by[i]);
    viewer.camera.position.fromArray(viewer.camera.position.toArray().map((x, i) => x + by[i]));
    viewer.set_camera_target(target);
    viewer.controls.update();
    viewer.set_dirty();
  }
  function look(name) {
    view = name;
    const [position, target] = settings.poses[name].map(drawn);
    viewer.camera.position.fromArray(position);
    viewer.set_camera_target(target);
    viewer.controls.update();
    viewer.set_dirty();
    at = name === 'follow' ? drawn(settings.start) : null;
    buttons.forEach(b => b.className = b.textContent === name ? 'on' : '');
    update();
  }
  function update() {
    let t = 0;  // each action's own time: unlike the animator's, it also follows a seek
    for (const action of viewer.animator.actions) t = Math.max(t, action.time);
    clock.textContent = 't = ' + t.toFixed(1) + ' s';
    if (at !== null) {
      const now = followed();
      if (now.some((x, i) => x !== at[i])) move(now.map((x, i) => x - at[i]));
      at = now;
    }
    // Or points are drawn in the wrong size in the first frame that shows them.
    viewer.scene.traverse(o => {
      if (o.isPoints && !o.userData.fresh) { o.userData.fresh = true; o.material.needsUpdate = true; }
    });
  }
  function show(seconds) {
    viewer.animator.pause();
    viewer.animator.seek(seconds);
    update();
    viewer.render();
  }
  const tick = () => { update(); requestAnimationFrame(tick); };
  look(view);
  tick();
  return {show, look};
})();
"""


def css_color(color: tuple[float, float, float] | np.ndarray) -> str:
    """A colour of red, green, blue, 0 to 1, as CSS."""
    return "rgb({:.0f},{:.0f},{:.0f})".format(*(255.0 * np.asarray(color)))


def _symbol(layer: Layer) -> str:
    """The layer's symbol in the legend, as inline SVG."""
    color = css_color(layer.color)
    angle = -0.5 * math.pi + math.pi / 5.0 * np.arange(10)
    spoke = 6.5 * np.where(np.arange(10) % 2, 0.45, 1.0)
    rim = zip(11.0 + spoke * np.cos(angle), 7.0 + spoke * np.sin(angle), strict=True)
    corners = " ".join(f"{x:.1f},{y:.1f}" for x, y in rim)
    share = np.linspace(0.0, 1.0, len(SPEED_COLORS))
    stops = "".join(
        f'<stop offset="{at:.2f}" stop-color="{css_color(c)}"/>' for at, c in zip(share, SPEED_COLORS, strict=True)
    )
    shapes = {
        "area": f'<rect x="2" y="2" width="18" height="10" fill="{color}" fill-opacity=".45" stroke="{color}"/>',
        "line": f'<path d="M1 7H21" stroke="{color}" stroke-width="3"/>',
        "disc": f'<circle cx="11" cy="7" r="4.5" fill="{color}"/>',
        "square": f'<rect x="8" y="4" width="6" height="6" fill="{color}"/>',
        "dot": f'<circle cx="11" cy="7" r="2.2" fill="{color}"/>',
        "ring": f'<circle cx="11" cy="7" r="5" fill="none" stroke="{color}" stroke-width="2.4"/>',
        "cross": f'<path d="M7 3L15 11M15 3L7 11" stroke="{color}" stroke-width="2.6"/>',
        "star": f'<polygon points="{corners}" fill="{color}"/>',
        "gradient": f'<linearGradient id="starnav-speed">{stops}</linearGradient>'
        '<rect x="1" y="5" width="20" height="4" fill="url(#starnav-speed)"/>',
    }
    return f'<svg width="22" height="14">{shapes[layer.symbol]}</svg>'
