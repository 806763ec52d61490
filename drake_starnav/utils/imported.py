"""What users name as `module:function`, and public names that are imported when they are first used."""

import importlib
import os
import sys
from collections.abc import Callable
from typing import Any

from drake_starnav.errors import StarnavError, said_by, shown


def import_named(what: str, name: str) -> Any:
    """What a name, `module:function`, stands for.

    A module is imported from where Python finds modules, or from the folder in which the program runs.

    Args:
        what: is named, for the message.
        name: as the user wrote it.

    Raises:
        StarnavError: there is no such module, or nothing in it of that name that can be called.
    """
    module_name, _, function_name = name.partition(":")
    if os.getcwd() not in sys.path:
        sys.path.append(os.getcwd())
    try:
        named_object = getattr(importlib.import_module(module_name), function_name)
    except (ImportError, AttributeError, ValueError) as error:
        raise StarnavError(
            f"{what} {shown(name)}: {said_by(error)}; allowed: module:function, of a module that Python finds"
        ) from None
    if not callable(named_object):
        raise StarnavError(f"{what} {shown(name)} is {shown(named_object)}; allowed: a function, or a class")
    return named_object


def load_lazily(package: str, file: str) -> tuple[list[str], Callable[[str], object]]:
    """`__all__` and `__getattr__` of a package, by the lines `from module import name as name` of its stub for type
    checkers, which is beside its file."""
    with open(f"{file.removesuffix('.py')}.pyi", encoding="utf-8") as stub:
        stub_lines = [line.split() for line in stub if line.startswith("from ")]
    module_names = {name: module for _, module, _, name, *_ in stub_lines}

    def get(name: str) -> object:
        if name not in module_names:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(importlib.import_module(module_names[name]), name)

    return list(module_names), get
