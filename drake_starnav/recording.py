"""A run as one HTML file that opens offline: the look of the scene, the camera, the caption, the file."""

import html
import math
import os
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from pydrake.geometry import Meshcat, MeshcatParams, MeshcatVisualizer, MeshcatVisualizerParams, Role
from pydrake.systems.framework import DiagramBuilder

from drake_starnav.drawing import LAYERS, SPEED_COLORS, Layer, RecordingParameters
from drake_starnav.errors import StarnavError
from drake_starnav.systems.star_roadmap_visualizer import StarRoadmapVisualizer

if TYPE_CHECKING:
    from drake_starnav.diagram import Navigation
    from drake_starnav.scenario import Scenario

FIELD_OF_VIEW = 20.0
"""Of the camera, deg: narrow, so that tall obstacles seen from above hide little."""
PAGE = (1100.0, 800.0)
"""Width and height of the page that the camera presets are made for, pixels."""
PANEL_WIDTH = 225.0
"""Of the caption and legend on the left, which the camera presets leave free, pixels."""
AMBIENT_LIGHT, FILL_LIGHT = 2.0, 1.3
"""Intensities: together they show a level surface in about the colour it was given, and walls a little darker."""
VIEWS = ("top", "oblique")


class Recorder:
    """Records a navigation diagram: its scene, and what the robot sees and decides."""

    def __init__(self, builder: DiagramBuilder, navigation: "Navigation", scenario: "Scenario") -> None:
        """Start a Meshcat and add its visualizers.

        Args:
            builder: to which they are added.
            navigation: what `add_navigation` put into the same builder.
            scenario: whose parameters `recording` and `robot` are used.
        """
        self._meshcat = Meshcat(MeshcatParams(host="localhost", show_stats_plot=False))
        self._parameters = scenario.recording
        self._extent = navigation.world.extent
        station, controller = navigation.station, navigation.controller
        MeshcatVisualizer.AddToBuilder(
            builder,
            station.GetOutputPort("cheat.geometry_query"),
            self._meshcat,
            MeshcatVisualizerParams(
                publish_period=1.0 / self._parameters.frames_per_second, role=Role.kIllustration, prefix="world"
            ),
        )
        visualizer = builder.AddNamedSystem(
            "star_roadmap_visualizer", StarRoadmapVisualizer(self._meshcat, self._parameters, scenario.robot)
        )
        for port, name in (
            (station.GetOutputPort("localization.pose"), "pose"),
            (station.GetOutputPort("lidar.scan"), "scan"),
            (station.GetOutputPort("localization.scan_pose"), "scan_pose"),
            (navigation.goal.get_output_port(), "goal"),
            (controller.GetOutputPort("twist_command"), "twist"),
            (controller.GetOutputPort("certificate"), "certificate"),
        ):
            builder.Connect(port, visualizer.GetInputPort(name))
        if navigation.planner is not None:
            builder.Connect(navigation.planner.GetOutputPort("roadmap"), visualizer.GetInputPort("roadmap"))

    def start(self) -> None:
        """Start to record; call it before the simulator is initialized."""
        start_recording(self._meshcat, self._parameters, self._extent)

    def finish(self, path: str | os.PathLike, caption: str) -> None:
        """End the recording and write it; arguments as for `write_html`."""
        finish_recording(self._meshcat, path, caption)


def start_recording(
    meshcat: Meshcat,
    parameters: RecordingParameters,
    extent: tuple[float, float, float, float],
    view: str = "top",
    live: bool = False,
) -> None:
    """Set the look and the camera and start to record; call it before the simulator is initialized.

    Args:
        meshcat: that the run's visualizers draw into.
        parameters: of the recording.
        extent: of the world, (x_min, y_min, x_max, y_max), W, m.
        view: camera preset, one of VIEWS.
        live: whether an open page follows the run as well; it makes the run slower.
    """
    set_look(meshcat)
    frame_camera(meshcat, extent, view)
    meshcat.StartRecording(parameters.frames_per_second, set_visualizations_while_recording=live)


def finish_recording(meshcat: Meshcat, path: str | os.PathLike, caption: str) -> None:
    """End the recording and write it as one HTML file; arguments as for `write_html`."""
    meshcat.StopRecording()
    meshcat.PublishRecording()
    write_html(meshcat, path, caption)


def set_look(meshcat: Meshcat) -> None:
    """White background, no grid, even light from everywhere."""
    for light in ("SpotLight", "PointLightNegativeX", "PointLightPositiveX"):
        meshcat.SetProperty(f"/Lights/{light}", "visible", False)
    meshcat.SetProperty("/Lights/AmbientLight/<object>", "intensity", AMBIENT_LIGHT)
    meshcat.SetProperty("/Lights/FillLight/<object>", "intensity", FILL_LIGHT)
    meshcat.SetProperty("/Lights/FillLight/<object>", "position", [-3.0, 10.0, 4.0])  # x, z, -y of W
    meshcat.SetProperty("/Background", "top_color", [1.0, 1.0, 1.0])
    meshcat.SetProperty("/Background", "bottom_color", [1.0, 1.0, 1.0])
    for helper in ("/Grid", "/Axes"):
        meshcat.SetProperty(helper, "visible", False)


def frame_camera(meshcat: Meshcat, extent: tuple[float, float, float, float], view: str = "top") -> None:
    """Point the camera so that a box of the floor fills the page beside the panel, its longer side across.

    Args:
        meshcat: whose camera is set.
        extent: (x_min, y_min, x_max, y_max), W, m.
        view: `top`, straight down, or `oblique`, from the side.

    Raises:
        StarnavError: unknown view.
    """
    position, target = camera_pose(extent, view)
    distance = float(np.linalg.norm(position - target))
    # A near plane that is not too near keeps flat layers a centimetre apart from flickering.
    camera = Meshcat.PerspectiveCamera(
        fov=FIELD_OF_VIEW, aspect=PAGE[0] / PAGE[1], near=0.02 * distance, far=10.0 * distance
    )
    meshcat.SetCamera(camera)
    meshcat.SetCameraPose(position, target)


def camera_pose(extent: tuple[float, float, float, float], view: str = "top") -> tuple[np.ndarray, np.ndarray]:
    """Where `frame_camera` puts the camera and what it looks at, each shape (3,), W, m; arguments as there."""
    if view not in VIEWS:
        raise StarnavError(f"camera view is {view!r}; allowed: one of {', '.join(VIEWS)}")
    size = np.array([extent[2] - extent[0], extent[3] - extent[1]])
    middle = np.array([0.5 * (extent[0] + extent[2]), 0.5 * (extent[1] + extent[3])])
    across, up = np.array([1.0, 0.0]), np.array([0.0, 1.0])
    if size[1] > size[0]:
        across, up, size = up, -across, size[::-1]
    share = 1.0 - PANEL_WIDTH / PAGE[0]
    # Straight down "up" would be undefined: a hair off.
    tilt = math.radians(0.05 if view == "top" else 50.0)
    half_angle = math.tan(math.radians(0.5 * FIELD_OF_VIEW))
    # The page shows `high` metres from its lower to its upper rim at the target; more, as the near rim looks wider.
    high = 1.04 * max(size[1], size[0] / share * PAGE[1] / PAGE[0]) + half_angle * math.sin(tilt) * size[1]
    middle = middle - 0.5 * (1.0 - share) * high * PAGE[0] / PAGE[1] * across
    distance = 0.5 * high / half_angle
    position = np.append(middle - distance * math.sin(tilt) * up, distance * math.cos(tilt))
    return position, np.append(middle, 0.0)


def write_html(meshcat: Meshcat, path: str | os.PathLike, caption: str) -> None:
    """Write the scene, with its published recording if any, as one HTML file that needs no network.

    The file appears under its name only once it is complete.

    Args:
        meshcat: the scene.
        path: of the file.
        caption: shown beside the scene, above a legend of the layers: a heading and lines, separated by " · ".

    Raises:
        StarnavError: the file cannot be written.
    """
    path = Path(path)
    text = with_panel(meshcat.StaticHtml(), caption)
    temporary = None
    try:
        with tempfile.NamedTemporaryFile(
            "w", encoding="utf-8", dir=path.parent, prefix=f".{path.name}.", suffix=".part", delete=False
        ) as file:
            temporary = file.name
            file.write(text)
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except OSError as error:
        if temporary is not None:
            Path(temporary).unlink(missing_ok=True)
        raise StarnavError(
            f"recording {path} cannot be written ({error.strerror}); allowed: a file in a writable folder"
        ) from error


def with_panel(page: str, caption: str) -> str:
    """A Meshcat page with a caption, a clock and a legend of the layers on its left."""
    rows = "".join(
        f"<tr><td>{_symbol(layer)}</td><td>{html.escape(layer.label)}</td></tr>"
        for _, layer in sorted(LAYERS.items(), key=lambda item: -item[1].height)
    )
    heading, *lines = (html.escape(part) for part in caption.split(" · "))
    panel = (
        f'<style>{_STYLE}</style><div id="starnav-panel"><h1>{heading}</h1>'
        + "".join(f"<p>{line}</p>" for line in lines)
        + f'<p id="starnav-clock">t = 0.0 s</p><table>{rows}</table></div><script>{_SCRIPT}</script>'
    )
    page = page.replace("<title>Drake MeshCat</title>", f"<title>{html.escape(caption)}</title>", 1)
    head, end, tail = page.rpartition("</body>")
    return head + panel + end + tail


_STYLE = (
    "#starnav-panel{position:fixed;left:0;top:0;width:200px;padding:10px 12px;color:#222;"
    "background:rgba(255,255,255,.85);font:12px/1.35 system-ui,sans-serif;pointer-events:none}"
    "#starnav-panel h1{font-size:17px;margin:0 0 4px}#starnav-panel p{margin:0 0 2px}"
    "#starnav-panel table{margin-top:10px;border-spacing:0 3px}#starnav-panel svg{display:block;margin-right:6px}"
)
_SCRIPT = (
    # Each action's own time: unlike the animator's, it also follows a seek.
    "(function tick(){let t=0;for(const action of viewer.animator.actions)t=Math.max(t,action.time);"
    "document.getElementById('starnav-clock').textContent='t = '+t.toFixed(1)+' s';"
    # Or points are drawn in the wrong size in the first frame that shows them.
    "viewer.scene.traverse(o=>{if(o.isPoints&&!o.userData.fresh){o.userData.fresh=true;o.material.needsUpdate=true}});"
    "requestAnimationFrame(tick)})();"
)


def _css(color: tuple[float, float, float] | np.ndarray) -> str:
    return "rgb({:.0f},{:.0f},{:.0f})".format(*(255.0 * np.asarray(color)))


def _symbol(layer: Layer) -> str:
    """The layer's sign in the legend, as inline SVG."""
    color = _css(layer.color)
    angle = -0.5 * math.pi + math.pi / 5.0 * np.arange(10)
    spoke = 6.5 * np.where(np.arange(10) % 2, 0.45, 1.0)
    rim = zip(11.0 + spoke * np.cos(angle), 7.0 + spoke * np.sin(angle), strict=True)
    corners = " ".join(f"{x:.1f},{y:.1f}" for x, y in rim)
    stops = "".join(
        f'<stop offset="{k / (len(SPEED_COLORS) - 1):.2f}" stop-color="{_css(c)}"/>' for k, c in enumerate(SPEED_COLORS)
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
