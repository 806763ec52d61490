"""The page of a live run, Meshcat's with the panel and bar of a recording around it, and the goal that it moves."""

import json
import threading
import urllib.request
from collections.abc import Callable
from dataclasses import asdict, dataclass
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.systems.framework import Context, DiscreteValues, EventStatus, LeafSystem

from drake_starnav.visualization.page import SLIDERS, Cameras, Caption, with_panel
from drake_starnav.worlds.world import World

SOURCE, ADDRESS = 'src="', "location.toString()"
"""How Meshcat's page begins the address of its script and gets its own address: both are then Meshcat's."""


@dataclass(frozen=True)
class LiveState:
    """What the page shows of a run: the simulated time, s, whether the robot is driven, whether it will not be driven
    any more, and how the run goes, in words."""

    time: float
    running: bool = False
    ended: bool = False
    said: str = ""


class LivePage:
    """Serves one page on this machine, at its `address`, until it is closed."""

    def __init__(self, meshcat: Meshcat, caption: Caption, cameras: Cameras, state: Callable[[], LiveState]) -> None:
        """Serve a scene with buttons named start and pause; another thread asks for the state at a steady rate."""
        address = meshcat.web_url()
        with urllib.request.urlopen(address) as answer:
            page = answer.read().decode()
        page = page.replace(SOURCE, f"{SOURCE}{address}/").replace(ADDRESS, f'"{address}/"', 1)
        text = with_panel(page, caption, cameras, live=True).encode()
        answers = {
            "/": lambda: ("text/html; charset=utf-8", text),
            "/state": lambda: ("application/json", json.dumps(asdict(state())).encode()),
        }

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                if self.path not in answers:
                    self.send_error(404)
                    return
                kind, content = answers[self.path]()
                self.send_response(200)
                self.send_header("Content-Type", kind)
                self.send_header("Content-Length", str(len(content)))
                self.end_headers()
                self.wfile.write(content)

            def log_message(self, format: str, *args: object) -> None:
                pass

        self._server = ThreadingHTTPServer(("localhost", 0), Handler)
        self._server.daemon_threads = True
        self.address = f"http://localhost:{self._server.server_port}/"
        threading.Thread(target=self._server.serve_forever, daemon=True).start()

    def close(self) -> None:
        """Serve no longer."""
        self._server.shutdown()
        self._server.server_close()


def add_goal_sliders(meshcat: Meshcat, world: World) -> Callable[[], np.ndarray | None]:
    """Add two sliders to Meshcat's panel that span a world and begin at its goal.

    Returns a function for `SliderGoal` that reads them: None until one has been moved.
    """
    x0, y0, x1, y1 = world.extent
    for label, low, high, value in zip(SLIDERS, (x0, y0), (x1, y1), world.goal, strict=True):
        meshcat.AddSlider(label, low, high, 0.01, value)

    def values() -> np.ndarray:
        return np.array([meshcat.GetSliderValue(label) for label in SLIDERS])

    first = values()  # rounded to whole steps, unlike the world's goal

    def read() -> np.ndarray | None:
        now = values()
        return None if np.array_equal(now, first) else now

    return read


class SliderGoal(LeafSystem):
    """Takes the goal from outside the simulation, such as sliders in Meshcat's panel.

    ```
    ┌────────────┐
    │ SliderGoal ├──> goal
    └────────────┘
    ```

    Ports:
        goal: vector (x, y) in the world frame W, m; discrete state: what was read at the last update.

    What a run with it does depends on when the goal is moved, and cannot be repeated.
    """

    def __init__(
        self, goal: tuple[float, float], read: Callable[[], np.ndarray | None], *, period: float = 0.1
    ) -> None:
        """
        Args:
            goal: where there is no other, (x, y), W, m.
            read: says where the goal is now, shape (2,), W, m, or None; see `add_goal_sliders`.
            period: of the updates, s.
        """
        super().__init__()
        self._goal, self._read = np.array(goal, dtype=float), read
        self.DeclareStateOutputPort("goal", self.DeclareDiscreteState(self._goal))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, values: DiscreteValues) -> EventStatus:
        moved = self._read()
        values.set_value(self._goal if moved is None else moved)
        return EventStatus.Succeeded()
