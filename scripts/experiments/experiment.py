"""What experiments on several variants share: options, errors, a file of trials for each variant."""

import argparse
import json
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

from tqdm import tqdm

from drake_starnav.cli.benchmark import add_batch_options, check_batch_options, choose_pool
from drake_starnav.cli.options import NOT_REACHED, REACHED, CommandParser, run_command
from drake_starnav.evaluation.jobs import Record, make_cases, make_jobs
from drake_starnav.evaluation.summary import compare_trials, format_number, format_rate
from drake_starnav.evaluation.trial_file import TrialFile, make_header
from drake_starnav.evaluation.workers import BatchInterrupted, Pool, describe_batch, run_batch
from drake_starnav.utils.files import check_outputs, write_text

Results = dict[str, list[Record]]
"""The trials of each variant, by its name."""


def experiment_parser(prog: str, description: str, scenarios: Sequence[str], out: Path) -> argparse.ArgumentParser:
    """A parser with the common options of experiments: scenario, --out, and those of `add_batch_options`.

    Args:
        prog: the script's name.
        description: what it measures.
        scenarios: default scenarios.
        out: default output folder.
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

    return run_command(parser, arguments, work)


Variants = Mapping[str, tuple[str, Sequence[str]]]
"""By name, the method and the "section.key=value" overrides of each variant."""


def run_experiment(
    variants: Variants,
    options: argparse.Namespace,
    output: str,
    table: Callable[[Results, Sequence[str]], str],
    pool_of: Callable[[Pool, str], Pool] = lambda pool, name: pool,
) -> Results:
    """Run the trials of all variants, each in the file <out>/<name>.jsonl, then write and print their table.

    Args:
        variants: to run.
        options: scenario, out, and those of `add_batch_options`.
        output: name of the table's file in <out>; whether it can be written is checked before any trial runs.
        table: makes a text from the trials and the scenarios' names.
        pool_of: from the pool of the options and a variant's name to the pool in which that variant's trials run.
    """
    path = options.out / output
    check_outputs([path], options.scenario)
    results, scenarios = _run_variants(variants, options, pool_of)
    text = table(results, scenarios)
    write_text(path, f"{text.rstrip()}\n")
    if not options.quiet:
        print(text)
        print(f"wrote {path} and a file of trials for each row")
    return results


def _run_variants(
    variants: Variants, options: argparse.Namespace, pool_of: Callable[[Pool, str], Pool]
) -> tuple[Results, list[str]]:
    """The trials of each variant, and the scenarios' names."""
    batches = []
    for name, (method, overrides) in variants.items():  # all are made before any runs, so that bad input is found first
        batches.append((name, overrides, make_cases(options.scenario, [method], overrides)))
    results: Results = {}
    with choose_pool(options) as pool:
        if len(batches) > 1 and not options.quiet:
            jobs = [job for _, _, cases in batches for job in make_jobs(cases, options.trials, options.seed, set())]
            less = ", less what has run" if options.resume else ""
            print(f"{len(batches)} rows, {describe_batch(jobs, pool.workers)}{less}", file=sys.stderr, flush=True)
        for name, overrides, cases in batches:
            header = make_header(cases, options.seed, overrides, command=getattr(options, "typed", ""))
            with TrialFile(options.out / f"{name}.jsonl", header, resume=options.resume) as file:
                try:
                    results[name] = run_batch(
                        cases, trials=options.trials, seed=options.seed, pool=pool_of(pool, name), file=file, title=name
                    )
                except BatchInterrupted as interruption:
                    raise KeyboardInterrupt(f"{interruption} of {name}, in {options.out}; --resume goes on") from None
    return results, [case.scenario for case in batches[0][2]]


def add_case_options(parser: argparse.ArgumentParser) -> None:
    """Add the options --seed, --workers and --out of experiments on drawn cases."""
    parser.add_argument("--seed", type=int, default=0, help="of the first case; default: 0")
    parser.add_argument("--workers", type=int, default=2, metavar="N", help="processes; default: 2")
    parser.add_argument("--out", type=Path, metavar="FILE", help="append the records, one JSON a line")


def run_cases(
    measure: Callable[[Any], dict[str, Any]], cases: Sequence[Any], options: argparse.Namespace
) -> list[dict[str, Any]]:
    """Measure each case in a pool of processes, append the records to `options.out` as they come, return them."""
    records = []
    if options.out is not None:
        options.out.parent.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(options.workers) as pool:
        found = pool.map(measure, cases)
        for record in tqdm(found, total=len(cases), unit="trial", disable=None, leave=False):
            records.append(record)
            if options.out is not None:
                with options.out.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(record) + "\n")
    return records


def comparison_head(scenarios: Sequence[str], reference: str) -> list[str]:
    """Heads of the columns that `comparison_cells` fills; `reference` is a variant's name."""
    return [
        name for scenario in scenarios for name in (f"{scenario}: reached (95 %)", "collisions", f"time / {reference}")
    ]


def comparison_cells(records: Sequence[Record], reference: Sequence[Record], scenarios: Sequence[str]) -> list[str]:
    """Per scenario: rate of success, collisions, and time over the reference's where both reached the goal."""
    cells = []
    for scenario in scenarios:
        trials = of_scenario(records, scenario)
        rate = format_rate(count(trials, "reached"), len(trials))
        ratio = format_number(compare_trials(trials, reference).time_ratio, 2)
        cells += [rate, str(count(trials, "collision")), ratio]
    return cells


def of_scenario(records: Iterable[Record], scenario: str) -> list[Record]:
    """The records of one scenario."""
    return [record for record in records if record["scenario"] == scenario]


def count(records: Iterable[Record], outcome: str) -> int:
    """Number of trials with this outcome."""
    return sum(record["outcome"] == outcome for record in records)
