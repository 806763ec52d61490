"""What the command lines share."""

import argparse
import os
import sys
from collections.abc import Callable
from pathlib import Path

from drake_starnav.errors import StarnavError

REACHED, NOT_REACHED, BAD_INPUT, INTERRUPTED, BROKEN_PIPE = 0, 1, 2, 130, 141
"""Exit codes."""


def command_name(name: str) -> str:
    """What a command was called by: its script, or the package."""
    return f"python -m drake_starnav {name}" if Path(sys.argv[0]).name == "__main__.py" else f"{name}.py"


def exit_code(prog: str, work: Callable[[], int], interrupted: str = "interrupted") -> int:
    """What a command's work returns, or the code for what ended it, which is told in one line.

    Args:
        prog: the command's name.
        work: may raise `StarnavError`.
        interrupted: what is told on Ctrl-C.
    """
    try:
        return work()
    except StarnavError as error:
        print(f"{prog}: {error}", file=sys.stderr)
        return BAD_INPUT
    except BrokenPipeError:  # who read the output has gone, as `head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return BROKEN_PIPE
    except KeyboardInterrupt:
        print(f"{prog}: {interrupted}", file=sys.stderr)
        return INTERRUPTED


def add_overrides(parser: argparse.ArgumentParser) -> None:
    """The option `--set`."""
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        dest="overrides",
        help="override a parameter of the scenario (of every one, if several), e.g. robot.radius=0.3; may be repeated",
    )
