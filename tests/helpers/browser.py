"""Take pictures of a recording's page with headless Chromium."""

import io
import os
import shutil
from pathlib import Path
from typing import Any

from PIL import Image

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
"""Names of the program, in the order of search on PATH."""
PLACES = ("/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",)
PAGE = (1100.0, 800.0)
"""Width and height of a page, pixels."""
FLAGS = ("--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
"""For rendering without a graphics card, also as root in a container."""
PATIENCE = 120.0
"""Time limit for a page to become ready or to answer, s."""


def find_chromium() -> str | None:
    """Path of the program; None if none is installed."""
    found = (shutil.which(name) for name in NAMES)
    return next((path for path in (*found, *PLACES) if path and os.access(path, os.X_OK)), None)


def browser_missing() -> str | None:
    """The program that is missing for pictures by a browser, in words; None if all are there."""
    if find_chromium() is None:
        return f"Chromium (none of {', '.join(NAMES)} is on PATH)"
    try:
        import playwright.sync_api  # noqa: F401
    except ImportError:
        return "playwright (pip install playwright)"
    return None


class BrowserCamera:
    """Takes pictures of a recording as a browser shows it; a context manager with the open `page`, of Playwright."""

    page: Any

    def __init__(self, html: Path, view: str = "top") -> None:
        """Of a recording, from a preset of `page.VIEWS`."""
        self._html, self._view = html, view

    def __enter__(self) -> "BrowserCamera":
        from playwright.sync_api import sync_playwright

        self._playwright = sync_playwright().start()
        self._browser = self._playwright.chromium.launch(
            executable_path=find_chromium(), headless=True, args=list(FLAGS)
        )
        self.page = self._browser.new_page(viewport={"width": int(PAGE[0]), "height": int(PAGE[1])})
        self.page.set_default_timeout(1e3 * PATIENCE)
        self.page.goto(self._html.resolve().as_uri())
        self.page.wait_for_function("viewer.animator.duration > 0")
        self.page.evaluate(f"starnav.look('{self._view}')")
        # Buttons are not for pictures.
        controls = "#starnav-views, #starnav-controls, #starnav-legend summary, #starnav-legend tr.off"
        self.page.add_style_tag(content=f"{controls} {{display: none !important}}")
        self.page.add_style_tag(content="#starnav-play, #starnav-time {visibility: hidden}")
        return self

    def __exit__(self, *error: object) -> None:
        self._browser.close()
        self._playwright.stop()

    def picture(self, time: float) -> Image.Image:
        """The page at a time of the run, s."""
        self.page.evaluate(f"starnav.show({time})")
        return Image.open(io.BytesIO(self.page.screenshot())).convert("RGB")
