"""Serves the page of a live run: Meshcat's, with the same panel and bar around it as a recording has."""

import json
import threading
import urllib.request
from collections.abc import Callable
from dataclasses import asdict, dataclass
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

from pydrake.geometry import Meshcat

from drake_starnav.visualization.page import Cameras, Caption, with_panel

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
        """Of a scene with buttons named start and pause; another thread asks for the state several times a second."""
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
