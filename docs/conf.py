"""How Sphinx makes the site from these pages: `make docs`. Nothing in it is loaded from a network."""

import re
import tomllib
from pathlib import Path
from typing import Any

DOCS = Path(__file__).resolve().parent
ROOT = DOCS.parent
LINK = re.compile(r"(?<!!)\[([^\]]+)\]\(([^)\s]+)\)")

project = "drake_starnav"
author = copyright = "The drake_starnav authors"
release = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]

extensions = ["myst_parser"]
myst_heading_anchors = 3  # pages link to headings as on a forge: parameters.md#lidar
html_theme = "furo"
html_title = f"{project} {release}"
html_static_path = ["style.css"]
html_css_files = ["style.css"]
html_copy_source = False
html_show_sphinx = False


def without_outside_links(text: str, folder: Path) -> str:
    """A page whose links to files that are not part of the site are only their texts.

    Args:
        text: Markdown.
        folder: that its links are relative to.
    """

    def kept(match: re.Match) -> str:
        label, target = match.groups()
        path = (folder / target.partition("#")[0]).resolve()
        return match[0] if "://" in target or path.is_relative_to(DOCS) else label

    return LINK.sub(kept, text)


def on_page(app: Any, name: str, source: list[str]) -> None:
    """Sphinx has read a page."""
    source[0] = without_outside_links(source[0], (DOCS / name).parent)


def on_include(app: Any, path: Path, name: str, source: list[str]) -> None:
    """Sphinx has read what a page includes: README."""
    source[0] = without_outside_links(source[0], ROOT / Path(path).parent)


def setup(app: Any) -> None:
    """Sphinx calls this once."""
    app.connect("source-read", on_page)
    app.connect("include-read", on_include)
