"""`starnav`: its commands, by name, and what it lists without one."""

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from drake_starnav.cli.options import Command

MODULES = {
    "demo": "simulate", "simulate": "simulate", "record": "record", "benchmark": "benchmark", "report": "benchmark",
    "show_world": "show", "margins": "show", "drive": "drive", "replay": "drive", "warm": "drive",
    "calibrate": "drive",
}  # fmt: skip
"""Module of each command, in this folder."""


def find_command(name: str) -> "Command":
    """The command of a name, of those in `MODULES`."""
    import importlib

    return getattr(importlib.import_module(f"{__package__}.{MODULES[name]}"), name)


def main(arguments: Sequence[str] | None = None) -> int:
    """The program `starnav [COMMAND ...]`; returns its exit code.

    Args:
        arguments: None for those of the process.
    """
    arguments = sys.argv[1:] if arguments is None else arguments
    if arguments and arguments[0] in MODULES:
        return find_command(arguments[0])(arguments[1:])
    from drake_starnav.cli.options import find_program_name, run_for_exit_code

    return run_for_exit_code(find_program_name(), lambda: _print_list(arguments))


def _print_list(arguments: Sequence[str]) -> int:
    from drake_starnav.errors import shown
    from drake_starnav.parameters import unknown_name

    if list(arguments) == ["--version"]:
        from drake_starnav.evaluation.trial_file import find_versions

        found_versions = find_versions()
        print(
            f"drake_starnav {found_versions['drake_starnav']} ({found_versions['git'] or 'no checkout'}), "
            f"Drake {found_versions['drake']}"
        )
        return 0
    if arguments and arguments[0] not in ("-h", "--help"):
        raise unknown_name(f"command {shown(arguments[0])}", arguments[0], MODULES)
    print(_make_listing())
    return 0


def _make_listing() -> str:
    import inspect

    from drake_starnav.cli.options import find_program_name
    from drake_starnav.scenario.shipped import METHODS, list_scenario_names
    from drake_starnav.worlds import WORLD_KINDS

    commands = {name: find_command(name).description.rstrip(".") for name in MODULES}
    worlds = {
        f"!{name}": (inspect.getdoc(kind) or "").splitlines()[0].rstrip(".") for name, kind in WORLD_KINDS.items()
    }
    name_width = max(map(len, (*commands, *worlds)))
    return "\n".join(
        (
            f"usage: {find_program_name()} COMMAND ...   (COMMAND --help for its options)   or --version",
            "",
            "commands",
            *(f"  {name:<{name_width}}  {text}" for name, text in commands.items()),
            "",
            f"scenarios  {', '.join(list_scenario_names())}, or a YAML file",
            f"methods    {', '.join(METHODS)}",
            "",
            "worlds that a YAML file can ask for",
            *(f"  {name:<{name_width}}  {text}" for name, text in worlds.items()),
        )
    )
