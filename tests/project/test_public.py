"""Every public name exists, is documented, and is the same for type checkers."""

import ast
import importlib
import inspect
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import drake_starnav

SOURCE = Path(drake_starnav.__file__)


ROOMS = ("plotting", "systems", "station", "planning", "surroundings", "safety", "control", "lidar", "runtime")
"""Whose `__all__` is public, too."""
PUBLIC_MODULES = ("drake_starnav", *(f"drake_starnav.{room}" for room in ROOMS))


@pytest.mark.parametrize("module", PUBLIC_MODULES)
def test_every_public_name_exists_and_is_documented(module: str) -> None:
    imported = importlib.import_module(module)
    for name in imported.__all__:
        assert inspect.getdoc(getattr(imported, name)), name


def test_type_checkers_see_the_same_names_from_the_same_modules() -> None:
    stub = ast.parse(SOURCE.with_suffix(".pyi").read_text(encoding="utf-8"))
    imports = [node for node in stub.body if isinstance(node, ast.ImportFrom)]
    modules = {alias.asname: node.module for node in imports for alias in node.names}
    assert list(modules) == drake_starnav.__all__
    for name, module in modules.items():
        assert getattr(importlib.import_module(module), name) is getattr(drake_starnav, name)
    assert (SOURCE.parent / "py.typed").is_file()


def test_numerics_do_without_drake() -> None:
    names = ("World", "make_world", "load_scenario", "derive_margins", "LaserScan", "PlannerParameters", "Guidance")
    uses = "; ".join(f"drake_starnav.{name}" for name in names)
    rooms = "planning, drake_starnav.surroundings, drake_starnav.control, drake_starnav.lidar"
    without = "assert not any('pydrake' in name for name in sys.modules)"
    code = f"import sys, drake_starnav; {uses}; import drake_starnav.{rooms}; {without}"
    environment = {**os.environ, "PYTHONPATH": str(SOURCE.parents[1])}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_the_page_of_the_public_interface_shows_each_public_module() -> None:
    page = (SOURCE.parents[1] / "docs" / "api.md").read_text(encoding="utf-8")
    shown = re.findall(r"^\.\. automodule:: (\S+)\n   :members:$", page, re.MULTILINE)
    assert shown == list(PUBLIC_MODULES)
