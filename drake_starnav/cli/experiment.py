"""What scripts that run the same trials of several variants have in common: options, errors, a file for each."""

import argparse
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from drake_starnav.cli.benchmark import add_batch_options, check_batch_options, chosen_pool
from drake_starnav.cli.options import NOT_REACHED, REACHED, CommandParser, run_command
from drake_starnav.errors import shown
from drake_starnav.evaluation import TrialFile, make_cases, make_header, run_batch
from drake_starnav.evaluation.jobs import Record
from drake_starnav.parameters import unknown_name
from drake_starnav.utils.files import check_outputs

Results = dict[str, list[Record]]
"""The trials of each variant, by its name."""


def experiment_parser(prog: str, description: str, scenarios: Sequence[str], out: Path) -> argparse.ArgumentParser:
    """A parser with the options of every experiment: scenario, --out, and those of `add_batch_options`.

    Args:
        prog: the script's name.
        description: what it measures.
        scenarios: that it runs by default.
        out: the folder that it writes to by default.
    """
    parser = CommandParser(prog=prog, description=description)
    parser.add_argument("scenario", nargs="*", default=scenarios, help=f"default: {' '.join(scenarios)}")
    parser.add_argument("--out", type=Path, default=out, metavar="FOLDER", help=f"default: {out}")
    add_batch_options(parser)
    return parser


def experiment(
    parser: argparse.ArgumentParser, measure: Callable[[argparse.Namespace], Results], arguments: Sequence[str] | None
) -> int:
    """Parse the arguments and measure; returns the exit code, as of `benchmark`."""

    def work(options: argparse.Namespace) -> int:
        check_batch_options(options)
        results = measure(options)
        return NOT_REACHED if any(count(records, "error") for records in results.values()) else REACHED

    def interrupted(options: argparse.Namespace) -> str:
        return f"interrupted; what has run is in {options.out}, --resume goes on"

    return run_command(parser, arguments, work, interrupted)


def add_rows(parser: argparse.ArgumentParser, rows: Iterable[str]) -> None:
    """The option --rows, of the variants' names; see `check_rows`."""
    names = list(rows)
    parser.add_argument("--rows", nargs="+", default=names, metavar="ROW", help=f"of {', '.join(names)} (default: all)")


def check_rows(options: argparse.Namespace, known: Iterable[str]) -> None:
    """Raise `StarnavError` for a name in --rows that is not known."""
    names = list(known)
    for name in options.rows:
        if name not in names:
            raise unknown_name(f"row {shown(name)}", name, names)


def run_variants(
    variants: Mapping[str, tuple[str, Sequence[str]]], options: argparse.Namespace, outputs: Sequence[Path]
) -> tuple[Results, list[str]]:
    """Run the trials of all variants, each in the file <out>/<name>.jsonl.

    Args:
        variants: by name, the method and the "section.key=value" texts that make it.
        options: scenario, out, and those of `add_batch_options`.
        outputs: files that shall be written of the trials: whether they can be is seen before any runs.

    Returns:
        The trials, and the scenarios' names.
    """
    batches = []
    for name, (method, overrides) in variants.items():  # all are made before any runs: bad input is told at once
        batches.append((name, overrides, make_cases(options.scenario, [method], overrides)))
    check_outputs(outputs, options.scenario)
    results: Results = {}
    with chosen_pool(options) as pool:
        for name, overrides, cases in batches:
            header = make_header(cases, options.seed, overrides)
            with TrialFile(options.out / f"{name}.jsonl", header, resume=options.resume) as file:
                if file.repaired:
                    print(file.repaired, file=sys.stderr)
                results[name] = run_batch(
                    cases, trials=options.trials, seed=options.seed, pool=pool, file=file, quiet=options.quiet,
                    title=name,
                )  # fmt: skip
    return results, [case.scenario for case in batches[0][2]]


def of_scenario(records: Iterable[Record], scenario: str) -> list[Record]:
    """The records of one scenario."""
    return [record for record in records if record["scenario"] == scenario]


def count(records: Iterable[Record], outcome: str) -> int:
    """How many trials ended so."""
    return sum(record["outcome"] == outcome for record in records)
