"""Names of methods and of shipped scenarios. Help texts show them before anything heavy is imported."""

from collections.abc import Callable
from typing import Any, cast

from drake_starnav.baselines import BASELINES
from drake_starnav.errors import shown
from drake_starnav.utils.imported import import_named
from drake_starnav.utils.resources import find_model_path

METHODS: dict[str, dict[str, dict[str, Any]] | Callable[[Any], Any] | str] = {
    "star": {},
    "star_paper": "drake_starnav.paper:method",
    **{name: {"controller": {"kind": name}} for name in BASELINES},
    "grid_astar": "drake_starnav.systems.grid_planner:grid_astar",
}
"""A method is settings: which controller drives, and what else it sets before the scenario's own keys do.

One of your own is a function from a `Scenario` to the `Parts` that drive it, to their fields by name, or to the
controller alone. Enter it here by a name, as a function or as module:function, or name it so where a method is named.
"""


def read_method_settings(name: str) -> dict[str, dict[str, Any]]:
    """What a method sets in a scenario; a `StarnavError` if there is none of that name. Imports nothing."""
    found_settings = METHODS.get(name, {})
    if name not in METHODS and ":" not in name:
        from drake_starnav.parameters import unknown_name  # late: it takes NumPy

        raise unknown_name(f"method {shown(name)}", name, (*METHODS, "module:function"))
    return found_settings if isinstance(found_settings, dict) else {}


def import_own_method(name: str) -> Callable[[Any], Any] | None:
    """The function of a method of the user's own, from a scenario to its parts; None of a shipped one.

    Raises:
        StarnavError: there is no such method, see `import_named`.
    """
    found_method = METHODS[name] if name in METHODS else name if ":" in name else read_method_settings(name)
    if isinstance(found_method, str):
        return cast(Callable[[Any], Any], import_named("method", found_method))
    return None if isinstance(found_method, dict) else found_method


def list_scenario_names() -> list[str]:
    """Names of the shipped scenarios."""
    return sorted(path.stem for path in find_model_path("scenarios").glob("*.yaml"))
