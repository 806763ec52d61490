"""Expands model files with macros of xacro (an extra), in a process of their own with bounds on its memory and time.

A macro is a program: it may compute or nest without end.
"""

import importlib.util
import json
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drake_starnav.errors import StarnavError, said_by
from drake_starnav.models.model_folders import find_file
from drake_starnav.parameters import unknown_name

MOST_MEMORY, MOST_TIME = 400_000_000, 5
"""What an expansion may take: address space, bytes, and CPU, s. A robot of 2,000 links takes 0.1 GB and 2 s."""


def expand_macros(path: Path, arguments: Mapping[str, Any], place: str) -> bytes:
    """Return the text of a model file whose macros are expanded.

    Args:
        path: the file.
        arguments: values of its `xacro:arg`, by name.
        place: the file in messages, e.g. "robot model r.urdf.xacro".

    Raises:
        StarnavError: xacro is not installed or cannot expand the file, or there is no such argument.
    """
    if importlib.util.find_spec("xacro") is None:
        raise StarnavError(
            f"{place} has macros of xacro; allowed: pip install 'drake-starnav[xacro]', or a file that is "
            "expanded already (xacro IN > OUT)"
        )
    package_root = str(Path(__file__).parents[2])
    texts = {name: str(value).lower() if isinstance(value, bool) else str(value) for name, value in arguments.items()}
    process_run = subprocess.run(
        [sys.executable, "-c", f"from {__name__} import _answer_process; _answer_process({MOST_TIME})"],
        input=json.dumps([str(path), texts]).encode(),
        capture_output=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, (package_root, os.environ.get("PYTHONPATH"))))},
    )
    try:
        answer: dict[str, Any] = json.loads(process_run.stdout)
    except ValueError:  # it was ended
        answer = {"error": f"it takes more than {MOST_TIME} s or {MOST_MEMORY // 10**6} MB", "missing": []}
    if "error" in answer:
        missing_text = "".join(f"package {name}, which it names, is not found; " for name in answer["missing"])
        raise StarnavError(
            f"{place}: xacro: {answer['error']}; {missing_text}allowed: a file that xacro expands, its packages "
            "beside it or in ROS_PACKAGE_PATH, its arguments in robot.xacro_args"
        )
    for name in arguments:
        if name not in answer["declared"]:
            raise unknown_name(f"key robot.xacro_args.{name} of {path}", name, sorted(answer["declared"]))
    return str(answer["text"]).encode()


class _Arguments(dict[str, str]):
    """Values of xacro's arguments; it notes for which of them a model asks."""

    def __init__(self, *values: Any) -> None:
        super().__init__(*values)
        self.declared: set[str] = set()

    def __contains__(self, name: object) -> bool:
        self.declared.add(str(name))
        return super().__contains__(name)

    def __getitem__(self, name: str) -> str:
        self.declared.add(name)
        return super().__getitem__(name)


def _answer_process(most_time: int) -> None:
    """Expand the file that standard input names, within the bounds; the answer goes to standard output."""
    import resource

    resource.setrlimit(resource.RLIMIT_CPU, (most_time, most_time))
    resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    path, arguments = json.load(sys.stdin)
    answer_stream, sys.stdout = sys.stdout, sys.stderr  # xacro and macros may print
    try:
        answer_text = json.dumps(_expand(Path(path), arguments))
    except MemoryError:
        os._exit(1)
    answer_stream.write(answer_text)


def _expand(path: Path, arguments: dict[str, str]) -> dict[str, Any]:
    import xacro
    from xacro import substitution_args

    missing_packages: list[str] = []

    def find_package(name: str) -> str:
        """Where it lies; else a pattern without a match: only what is used of the package is missed."""
        folder = find_file(f"package://{name}", path.resolve().parent)
        if folder is None and name not in missing_packages:
            missing_packages.append(name)
        return str(folder or f"/no_package_{name}*")

    substitution_args._eval_find = find_package  # else it asks an installation of ROS
    argument_values = _Arguments(arguments)
    try:
        expanded_text = xacro.process_file(str(path), mappings=argument_values).toxml()
        if missing_packages and "<link" not in expanded_text:  # an include without a match is left out
            raise ValueError("it includes nothing that has links")
    except MemoryError:
        raise
    except Exception as error:  # whatever a broken macro makes it raise
        return {"error": said_by(error), "missing": missing_packages}
    return {"text": expanded_text, "declared": list(argument_values.declared)}
