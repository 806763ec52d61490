"""Lidar navigation through unknown clutter, as Drake systems: star-shaped roadmap and modulation.

What is listed in `__all__`, here and of the packages that docs/api.md names, is the public interface: it changes only
with an entry in the changelog. All else is internal, whatever its name. A public name is imported when first used, so
that the numerics can be used without Drake.
"""

import importlib

from drake_starnav.utils.compiled_ahead import use_what_was_compiled

use_what_was_compiled()

__version__ = "0.1.0"


def _public_names() -> dict[str, str]:
    """The module of each public name, by the lines `from module import name as name` of the type checkers' stub."""
    with open(f"{__file__.removesuffix('.py')}.pyi", encoding="utf-8") as stub:
        lines = [line.split() for line in stub if line.startswith("from ")]
    return {name: module for _, module, _, name, *_ in lines}


_PUBLIC = _public_names()
__all__ = list(_PUBLIC)


def __getattr__(name: str) -> object:
    if name not in _PUBLIC:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_PUBLIC[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
