"""How Sphinx makes the site from these pages: `make docs`. Nothing in it is loaded from a network."""

import re
import tomllib
from pathlib import Path
from typing import Any

from docutils import nodes

import drake_starnav

DOCS = Path(__file__).resolve().parent
ROOT = DOCS.parent
OUTSIDE = {
    "pydrake": "https://drake.mit.edu/pydrake/{module}.html#{name}",
    "numpy": "https://numpy.org/doc/stable/reference/generated/{name}.html",
}
"""Where the types of other packages are described."""
SHOWN: set[str] = set()
"""Names of the package that the site has."""
LINK = re.compile(r"(?<!!)\[([^\]]+)\]\(([^)\s]+)\)")

project = "drake_starnav"
author = copyright = "The drake_starnav authors"
release = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
autodoc_default_options = {"members": True}
autoclass_content = "both"
autodoc_typehints = "signature"
autodoc_member_order = "bysource"
napoleon_custom_sections = [("Ports", "params_style")]
napoleon_use_ivar = True
default_role = "code"
suppress_warnings = ["ref.python"]  # of attributes that several classes have, Napoleon's lists mean those of their own
myst_heading_anchors = 3  # pages link to headings as on a forge: parameters.md#lidar
nb_execution_mode = "auto"  # the notebooks' outputs are made with the site
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 300
html_theme = "furo"
html_title = f"{project} {release}"
html_static_path = ["style.css"]
html_css_files = ["style.css"]
html_copy_source = False
html_show_sphinx = False


def without_outside_links(text: str, folder: Path) -> str:
    """A page whose links to files that are not part of the site are only their texts; SAFETY.md is a page of it.

    Args:
        text: Markdown.
        folder: that its links are relative to.
    """

    def kept(match: re.Match) -> str:
        label, target = match.groups()
        file, _, anchor = target.partition("#")
        path = (folder / file).resolve()
        if path == ROOT / "SAFETY.md":
            return f"[{label}](safety.md{'#' * bool(anchor)}{anchor})"
        return match[0] if "://" in target or path.is_relative_to(DOCS) else label

    return LINK.sub(kept, text)


def on_page(app: Any, name: str, source: list[str]) -> None:
    """Sphinx has read a page."""
    source[0] = without_outside_links(source[0], (DOCS / name).parent)


def on_include(app: Any, path: Path, name: str, source: list[str]) -> None:
    """Sphinx has read what a page includes: README."""
    source[0] = without_outside_links(source[0], ROOT / Path(path).parent)


def on_docstring(app: Any, what: str, name: str, thing: object, options: object, lines: list[str]) -> None:
    """Autodoc has read a docstring: drawings fenced as in Markdown become literal blocks."""
    inside, out = False, []
    for line in lines:
        if line.strip() == "```":
            inside = not inside
            out += ["::", ""] if inside else [""]
        else:
            out.append(f"    {line}" if inside else line)
    lines[:] = out


def on_member(app: Any, what: str, name: str, thing: object, skip: bool, options: object) -> bool | None:
    """Autodoc has found a member: a room does not show again what the package has shown."""
    if what != "module" or name not in drake_starnav.__all__:
        return None
    if name in SHOWN:
        return True
    SHOWN.add(name)
    return None


def on_missing_reference(app: Any, env: Any, node: Any, content: Any) -> Any:
    """A type in a signature is another package's."""
    target = node.get("reftarget", "")
    module, _, name = target.rpartition(".")
    address = OUTSIDE.get(target.partition(".")[0])
    if address is None:
        return None
    return nodes.reference("", "", content, internal=False, refuri=address.format(module=module, name=target))


def setup(app: Any) -> None:
    """Sphinx calls this once."""
    app.connect("autodoc-skip-member", on_member)
    app.connect("missing-reference", on_missing_reference)
    app.connect("source-read", on_page)
    app.connect("include-read", on_include)
    app.connect("autodoc-process-docstring", on_docstring, priority=100)  # before Napoleon
