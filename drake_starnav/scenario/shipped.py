"""Names of what is shipped: methods and scenarios. Help texts show them before anything heavy is imported."""

from typing import Any

from drake_starnav.utils.resources import model_path

METHODS: dict[str, dict[str, dict[str, Any]]] = {
    "star": {},
    "star_paper": {"controller": {"kind": "star_paper", "rate": 40.0}},
    "dsm": {"controller": {"kind": "dsm"}},
    "foa": {"controller": {"kind": "foa"}},
    "foa_cluster": {"controller": {"kind": "foa"}, "foa": {"clusters": True}},
    "foa_roadmap": {"controller": {"kind": "foa", "target": "short_term_goal"}},
    "dwa": {"controller": {"kind": "dwa"}},
}
"""A method is settings: which controller drives, and what else it sets before the scenario's own keys do."""


def scenario_names() -> list[str]:
    """Names of the shipped scenarios."""
    return sorted(path.stem for path in model_path("scenarios").glob("*.yaml"))
