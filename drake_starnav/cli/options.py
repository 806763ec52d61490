"""Options, exit codes and messages that the commands share."""

import argparse
import math
import os
import shlex
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

from drake_starnav.errors import StarnavError, one_line, said_by
from drake_starnav.scenario.shipped import list_scenario_names
from drake_starnav.utils.progress import Progress, silence_progress

REACHED, NOT_REACHED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130
"""Exit codes."""
ENTRY_POINT = "starnav"
"""The installed command; `python -m drake_starnav` does the same."""


def find_program_name() -> str:
    """The command that started the package: its entry point, or `python -m` with its name."""
    return ENTRY_POINT if Path(sys.argv[0]).stem == ENTRY_POINT else "python -m drake_starnav"


class CommandParser(argparse.ArgumentParser):
    """An argument parser that reports bad arguments in one line."""

    def error(self, message: str) -> NoReturn:
        """End the program."""
        self.exit(BAD_INPUT, f"{self.prog}: {one_line(said_by(ValueError(message)))}; allowed: see --help\n")


@dataclass(frozen=True)
class Command:
    """A command of `starnav`, to be called with its arguments.

    Attributes:
        name: that it is called by.
        description: what it does, in a sentence.
        add_options: adds its options to a parser.
        work: does it with the parsed options and returns the exit code; see `run_for_exit_code` for what it may raise.
        codes: what its exit codes below 2 mean.
    """

    name: str
    description: str
    add_options: Callable[[argparse.ArgumentParser], None]
    work: Callable[[argparse.Namespace], int]
    codes: str = "0 done"

    def __call__(self, arguments: Sequence[str] | None = None) -> int:
        """Run it with these arguments, or with those of the process; returns the exit code."""
        epilog = f"exit codes: {self.codes}, {BAD_INPUT} bad input, {INTERRUPTED} interrupted"
        parser = CommandParser(prog=f"{find_program_name()} {self.name}", description=self.description, epilog=epilog)
        self.add_options(parser)
        return run_command(parser, arguments, self.work)


def format_typed_command(prog: str, arguments: Sequence[str]) -> str:
    """A command line as it was typed: `prog` is the command's name, or that of a script."""
    script = Path(sys.argv[0])
    return shlex.join([*(("python", str(script)) if script.name == prog else prog.split()), *arguments])


def run_command(
    parser: argparse.ArgumentParser, arguments: Sequence[str] | None, work: Callable[[argparse.Namespace], int]
) -> int:
    """Parse arguments, None for those of the process, and do a command's work; returns its `run_for_exit_code`."""

    def parsed() -> int:
        options = parser.parse_args(arguments)
        options.typed = format_typed_command(parser.prog, sys.argv[1:] if arguments is None else arguments)
        with silence_progress(getattr(options, "quiet", False)), format_warnings_plainly(parser.prog):
            return work(options)

    return run_for_exit_code(parser.prog, parsed)


@contextmanager
def format_warnings_plainly(prog: str) -> Iterator[None]:
    """Print each warning for the user once and in one line, without the place in the code."""
    previous_format, said_warnings = warnings.formatwarning, set[str]()

    def plain(message: Warning | str, category: type[Warning], *place: Any) -> str:
        if category is not UserWarning:
            return previous_format(message, category, *place)
        warning_text = f"{prog}: warning: {one_line(str(message))}\n"
        if warning_text in said_warnings:
            return ""
        said_warnings.add(warning_text)
        return warning_text

    warnings.formatwarning = plain  # type: ignore[assignment]
    try:
        yield
    finally:
        warnings.formatwarning = previous_format


def run_for_exit_code(prog: str, work: Callable[[], int]) -> int:
    """Run the work of a command of that name and return its exit code; an error or Ctrl-C is reported in one line.

    It may raise `StarnavError`, and `KeyboardInterrupt` with a text that says what was kept.
    """
    try:
        code = work()
        sys.stdout.flush()  # or the interpreter flushes at exit, where an error can no longer be reported
        return code
    except KeyboardInterrupt as interruption:
        message_text, code = "; ".join(filter(None, ("interrupted", str(interruption)))), INTERRUPTED
    except StarnavError as error:
        message_text, code = str(error), BAD_INPUT
    except BrokenPipeError:  # the reader of the output has gone, as `head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return NOT_REACHED
    except OSError as error:
        what, reason = error.filename or "the output", error.strerror or said_by(error)
        message_text, code = f"cannot read or write {what}: {reason}; allowed: what can be, with room for it", BAD_INPUT
    print(f"{prog}: {one_line(message_text)}", file=sys.stderr)
    return code


@contextmanager
def show_progress_bar(label: str) -> Iterator[Callable[[float, float], None]]:
    """A bar of simulated time; the function it yields takes the time now and its limit, s."""
    with Progress(label) as bar:
        first = last = math.inf

        def progress(current_time: float, limit: float) -> None:
            nonlocal first, last
            if current_time <= last:  # a run begins
                first = current_time
                bar.restart()
            last = current_time
            share = (current_time - first) / max(limit - first, 1e-9)
            bar.show(share, f"{current_time:.1f} s of at most {limit:g} s")

        yield progress


def print_written(paths: Iterable[Path | None]) -> None:
    """Name the files that a command has written; None is none."""
    for path in paths:
        if path is not None:
            print(f"wrote {path}")


def add_scenario(parser: argparse.ArgumentParser) -> None:
    """Add the argument `scenario`, and the option `--set`."""
    parser.add_argument("scenario", help=f"a shipped scenario ({', '.join(list_scenario_names())}) or a YAML file")
    add_overrides(parser)


def add_overrides(parser: argparse.ArgumentParser) -> None:
    """Add the option `--set`."""
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        dest="overrides",
        help="override a parameter of the scenario (of every one, if several), e.g. robot.radius=0.3; may be repeated",
    )


def check_numbers(options: argparse.Namespace, **ranges: tuple[float, float]) -> None:
    """Raise `StarnavError` unless each option named lies in its range, both ends included."""
    for name, (low, high) in ranges.items():
        value = getattr(options, name)
        if not low <= value <= high:
            above = "" if high == math.inf else f" <= {high}"
            raise StarnavError(f"--{name} is {value}; allowed: {low} <= x{above}")


def check_seed(seed: int | None) -> None:
    """Raise `StarnavError` unless the option `--seed` is one that every source of chance takes."""
    if seed is not None and not 0 <= seed < 2**64:
        raise StarnavError(f"--seed is {seed}; allowed: a whole number, 0 <= x < 2**64")
