"""Names of methods and of shipped scenarios. Help texts show them before anything heavy is imported."""

from collections.abc import Callable
from typing import Any, cast

from drake_starnav.errors import shown
from drake_starnav.utils.imported import import_named
from drake_starnav.utils.resources import find_model_path

METHODS: dict[str, Callable[[Any], Any] | str | None] = {
    "star": None,
    "star_paper": "drake_starnav.paper:method",
    **{
        name: f"drake_starnav.baselines.baseline_controller:{name}"
        for name in ("dsm", "foa", "foa_cluster", "foa_roadmap", "dwa")
    },
    "grid_astar": "drake_starnav.baselines.grid_planner:grid_astar",
}
"""What drives: `star` is what a scenario declares; each other method is a function in the place of its parts.

It takes a `Scenario` and returns the `Parts` that drive it, their fields by name, or the controller alone. Enter one of
your own here by a name, as a function or as module:function, or name it so where a method is named.
"""


def check_method_name(name: str) -> None:
    """Raise a `StarnavError` if there is no method of a name. Imports none."""
    if name not in METHODS and ":" not in name:
        from drake_starnav.parameters import unknown_name  # late: it takes NumPy

        raise unknown_name(f"method {shown(name)}", name, (*METHODS, "module:function"))


def import_method(name: str) -> Callable[[Any], Any] | None:
    """The function of a method, from a scenario to its parts; None of `star`.

    Raises:
        StarnavError: there is no such method, see `import_named`.
    """
    check_method_name(name)
    method = METHODS.get(name, name)
    return cast(Callable[[Any], Any], import_named("method", method)) if isinstance(method, str) else method


def list_scenario_names() -> list[str]:
    """Names of the shipped scenarios."""
    return sorted(path.stem for path in find_model_path("scenarios").glob("*.yaml"))
