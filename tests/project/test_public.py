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


@pytest.mark.parametrize("name", drake_starnav.__all__)
def test_every_public_name_exists_and_is_documented(name: str) -> None:
    member = getattr(drake_starnav, name)
    assert inspect.getdoc(member)
    assert member.__name__ == name
    module = importlib.import_module(f"drake_starnav.{drake_starnav._PUBLIC[name]}")
    assert getattr(module, name) is member
    assert not member.__module__.rpartition(".")[2].startswith("_")


def test_type_checkers_see_the_same_names_from_the_same_modules() -> None:
    (block,) = (node for node in ast.parse(SOURCE.read_text(encoding="utf-8")).body if isinstance(node, ast.If))
    seen = {alias.asname: f"{node.module}.{alias.name}" for node in block.body for alias in node.names}
    assert seen == {name: f"drake_starnav.{module}.{name}" for name, module in drake_starnav._PUBLIC.items()}
    assert (SOURCE.parent / "py.typed").is_file()


def test_a_name_that_is_not_public_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'Robots'"):
        _ = drake_starnav.Robots
    assert dir(drake_starnav) == sorted(drake_starnav.__all__)


def test_numerics_do_without_drake() -> None:
    names = ("StarRegion", "StarRoadmap", "World", "make_world", "load_scenario", "LaserScan", "PlannerParameters")
    uses = "; ".join(f"drake_starnav.{name}" for name in names)
    code = f"import sys, drake_starnav; {uses}; assert not any('pydrake' in name for name in sys.modules)"
    environment = {**os.environ, "PYTHONPATH": str(SOURCE.parents[1])}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_each_public_name_is_on_the_page_of_the_public_interface() -> None:
    pages = sorted((SOURCE.parents[1] / "docs" / "api").glob("*.md"))
    page = "\n".join(page.read_text(encoding="utf-8") for page in pages)
    assert sorted(re.findall(r"^\.\. auto\w+:: drake_starnav\.(\w+)$", page, re.MULTILINE)) == sorted(
        drake_starnav.__all__
    )
