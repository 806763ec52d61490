"""Public names that are imported when they are first used."""

import importlib
from collections.abc import Callable


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
