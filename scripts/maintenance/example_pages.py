"""The pages of the docs that show the examples, which `write_tables.py` writes."""

import ast
import re
from collections.abc import Callable
from functools import partial
from pathlib import Path

EXAMPLES = Path(__file__).parents[1] / "examples"


def example_pages() -> dict[str, Callable[[], str]]:
    """The pages, by their paths in the checkout: one for each example, and one that shows all pictures."""
    scripts = sorted(EXAMPLES.glob("[0-9]*.py"))
    pages: dict[str, Callable[[], str]] = {f"docs/examples/{path.stem}.md": partial(_page, path) for path in scripts}
    return {"docs/examples/index.md": partial(_gallery, scripts), **pages}


def _said(script: Path) -> tuple[str, str]:
    """Title and text of an example, from its docstring."""
    text = (ast.get_docstring(ast.parse(script.read_text(encoding="utf-8"))) or "").partition("\n\nRun:")[0]
    title, *rest = re.split(r"\.(?=\s|$)", text, maxsplit=1)
    return title, "".join(rest).strip()


def _picture(script: Path) -> str:
    return f"![What it draws](../images/examples/{script.stem}.png)"


def _page(script: Path) -> str:
    title, rest = _said(script)
    run = f"Run: `python scripts/examples/{script.name}`"
    program = EXAMPLES / script.name.lstrip("0123456789_")  # 06 runs lidar_only.py
    shown = program if program.is_file() else script
    code = f"```{{literalinclude}} ../../scripts/examples/{shown.name}\n:language: python\n```"
    return "\n\n".join(part for part in (f"# {title}", rest, run, _picture(script), code) if part) + "\n"


def _gallery(scripts: list[Path]) -> str:
    rows = "\n".join(f"| [{_said(script)[0]}]({script.stem}.md) | {_picture(script)} |" for script in scripts)
    menu = "\n".join(("```{toctree}", ":hidden:", "", *(script.stem for script in scripts), "```"))
    about = "Scripts that run in seconds and need no display; with `--png FILE` each draws its picture."
    return "\n\n".join(("# Examples", about, f"| example | picture |\n|---|---|\n{rows}", menu)) + "\n"
