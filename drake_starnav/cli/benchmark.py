"""The commands `benchmark` and `report`: run many trials, and report on them."""

import argparse
import math
import os
import sys
from collections.abc import Iterable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from drake_starnav.cli.options import (
    NOT_REACHED,
    REACHED,
    Command,
    add_overrides,
    check_numbers,
    check_seed,
    print_written,
)
from drake_starnav.errors import StarnavError, shown
from drake_starnav.scenario.shipped import METHODS, list_scenario_names
from drake_starnav.utils.files import check_outputs, check_writable, write_text
from drake_starnav.utils.progress import Progress

if TYPE_CHECKING:
    from drake_starnav.evaluation.report.results import Results
    from drake_starnav.evaluation.workers import Pool

MOST_TRIALS, MOST_JOBS = 100_000, 1000
"""Larger numbers, also of worlds in one range of `--worlds`, would only fill the memory."""


def _add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "scenario", nargs="*", help=f"shipped scenarios ({', '.join(list_scenario_names())}) or YAML files"
    )
    parser.add_argument("--suite", metavar="NAME", help="a named set of scenarios and methods with its table: table1")
    parser.add_argument("--method", nargs="+", help=f"of {', '.join(METHODS)}, or module:function (default: star)")
    add_overrides(parser)
    parser.add_argument(
        "--worlds",
        metavar="NUMBERS",
        help="instead of --trials, one trial in each numbered world of the scenario's file, e.g. 0-149 or 3,7,20-29",
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write a line for each trial as it ends")
    _add_report_options(parser)
    add_batch_options(parser)


def add_batch_options(parser: argparse.ArgumentParser) -> None:
    """Add the options shared by all commands that run many trials; see `check_batch_options`."""
    parser.add_argument("--trials", type=int, default=30, help="of each scenario and method (default: 30)")
    parser.add_argument("--seed", type=int, default=0, help="that all trials' seeds are derived from (default: 0)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes (default: one for each core)")
    parser.add_argument("--dask", metavar="ADDRESS", help="run on the Dask cluster whose scheduler has this address")
    parser.add_argument("--resume", action="store_true", help="continue a file: run only the trials it lacks")
    parser.add_argument("--quiet", action="store_true", help="no progress bar and no tables")


def check_batch_options(options: argparse.Namespace) -> None:
    """Raise `StarnavError` for a number out of its range."""
    check_numbers(options, trials=(1, MOST_TRIALS), jobs=(1, MOST_JOBS))
    check_seed(options.seed)


def choose_pool(options: argparse.Namespace) -> AbstractContextManager["Pool"]:
    """The processes or the cluster that the options of `add_batch_options` select."""
    from drake_starnav.evaluation.cluster import connect_dask_pool
    from drake_starnav.evaluation.workers import make_local_pool

    return connect_dask_pool(options.dask) if options.dask else nullcontext(make_local_pool(options.jobs))


def parse_world_numbers(text: str) -> list[int]:
    """Numbers and ranges as in "3,7,20-29", in ascending order, each once."""
    numbers: set[int] = set()
    for part in text.split(","):
        first_text, dash, last_text = part.partition("-")
        if not first_text.strip().isdecimal() or (dash and not last_text.strip().isdecimal()):
            raise StarnavError(f"--worlds is {shown(text)}; allowed: numbers and ranges, e.g. 0-149 or 3,7,20-29")
        first_number, last_number = int(first_text), int(last_text if dash else first_text)
        if not first_number <= last_number < first_number + MOST_TRIALS:
            raise StarnavError(f"--worlds has {shown(part)}; allowed: an ascending range of at most {MOST_TRIALS}")
        numbers.update(range(first_number, last_number + 1))
    return sorted(numbers)


def _run_benchmark(options: argparse.Namespace) -> int:
    check_batch_options(options)
    if options.resume and options.json is None:
        raise StarnavError("--resume without --json; allowed: --resume --json FILE, the file to continue")
    if not options.scenario and not options.suite:
        raise StarnavError(
            "neither a scenario nor --suite; allowed: one of the two, or scenarios in place of a suite's"
        )
    _check_report_options(options)
    worlds = None if options.worlds is None else parse_world_numbers(options.worlds)
    from drake_starnav.evaluation.jobs import check_worlds, make_cases
    from drake_starnav.evaluation.report.results import make_results
    from drake_starnav.evaluation.suites import find_suite
    from drake_starnav.evaluation.trial_file import TrialFile, make_header
    from drake_starnav.evaluation.workers import BatchInterrupted, run_batch
    from drake_starnav.scenario.scenario_file import find_scenario

    suite = find_suite(options.suite) if options.suite else None
    methods = options.method or (suite.methods if suite else ["star"])
    sources = options.scenario or (suite.scenarios if suite else ())
    cases = make_cases(sources, methods, options.overrides)
    if worlds is not None:
        check_worlds(cases, worlds)
    _check_report_outputs(options, map(find_scenario, sources), options.json)
    header = make_header(
        cases, options.seed, options.overrides, suite=options.suite, in_worlds=worlds is not None, command=options.typed
    )
    make_results([header], [], options.reference)  # raises before any trial runs if a reference is unknown
    with (
        choose_pool(options) as pool,
        TrialFile(options.json, header, resume=options.resume) if options.json else nullcontext() as file,
    ):
        try:
            records = run_batch(cases, trials=worlds or options.trials, seed=options.seed, pool=pool, file=file)
        except BatchInterrupted as interruption:
            if file is not None:
                raise KeyboardInterrupt(f"{interruption}, in {options.json}; --resume goes on") from None
            if interruption.records:
                _write_report(make_results([header], interruption.records, options.reference), options)
            raise
    _write_report(make_results([header], records, options.reference), options)
    if not options.quiet and options.json is not None:
        print(f"wrote {options.json}")
    return NOT_REACHED if any(record["outcome"] == "error" for record in records) else REACHED


def _add_file_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", nargs="+", type=Path, help="files by `benchmark --json`")
    _add_report_options(parser)
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes that record (default: cores)")
    parser.add_argument("--quiet", action="store_true", help="no progress bar and no tables")


def _write_report_of_files(options: argparse.Namespace) -> int:
    check_numbers(options, jobs=(1, MOST_JOBS))
    _check_report_options(options)
    _check_report_outputs(options, options.file)
    from drake_starnav.evaluation.report.results import read_results

    _write_report(read_results(options.file, options.reference), options)
    return REACHED


def _add_report_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--reference", nargs="+", default=[], metavar="METHOD",
        help="methods that all are compared with (default: those of the suite, or the first method)",
    )  # fmt: skip
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="write the tables")
    parser.add_argument(
        "--csv", type=Path, metavar="FILE", help="write the figures, a line for each scenario and method"
    )
    parser.add_argument(
        "--html",
        type=Path,
        metavar="FILE",
        help="write a report that opens offline, and beside it the data of its figures",
    )
    parser.add_argument(
        "--recordings", type=int, nargs="?", const=3, metavar="N",
        help="once the HTML report is written, record at most N failures of each scenario and method, two successes "
        "(default: none; without N: 3)",
    )  # fmt: skip
    parser.add_argument(
        "--panels", type=int, default=12, metavar="N", help="worlds of each scenario that it draws (default: 12)"
    )


def _check_report_options(options: argparse.Namespace) -> None:
    check_numbers(options, panels=(1, math.inf))
    if options.recordings is not None:
        check_numbers(options, recordings=(0, math.inf))


def _check_report_outputs(options: argparse.Namespace, inputs: Iterable[Path | str], *outputs: Path | None) -> None:
    """Raise a `StarnavError` unless report and outputs can be written, and none is an input or another output."""
    check_outputs((*outputs, options.markdown, options.csv, options.html, _name_figures_csv(options.html)), inputs)
    if options.html is not None:
        if options.recordings is not None:
            check_writable(_name_recordings_folder(options.html) / "trial.html")
        from drake_starnav.evaluation.report.figures import make_figure
        from drake_starnav.evaluation.report.page import load_template

        make_figure(1.0)  # both raise before any trial runs if a package is missing
        load_template()


def _name_figures_csv(html: Path | None) -> Path | None:
    """The file beside a report that has the data of its figures; None without a report."""
    return None if html is None else html.with_name(f"{html.stem}_figures.csv")


def _name_recordings_folder(html: Path) -> Path:
    """The folder for a report's recordings, unique among the reports in a folder."""
    return html.with_name(f"{html.stem}_recordings" if html.suffix == ".html" else f"{html.name}.recordings")


def _write_report(results: "Results", options: argparse.Namespace) -> None:
    from drake_starnav.evaluation.report.figures import collect_figure_data
    from drake_starnav.evaluation.report.page import write_page
    from drake_starnav.evaluation.report.recordings import choose_trials, record_chosen
    from drake_starnav.evaluation.report.tables import format_csv, format_summary_csv, format_tables_markdown

    tables = format_tables_markdown(results)
    if not options.quiet:
        print(tables)
    if options.markdown is not None:
        write_text(options.markdown, tables + "\n")
    if options.csv is not None:
        write_text(options.csv, format_summary_csv(results))
    chosen = choose_trials(results)
    if options.html is not None:
        with Progress("drawing") as bar:
            write_text(options.html, write_page(results, chosen, options.panels, bar.count))
    if (figures_file := _name_figures_csv(options.html)) is not None:
        write_text(figures_file, format_csv(collect_figure_data(results)))
    if not options.quiet:
        print_written((options.markdown, options.csv, options.html, figures_file))
        sys.stdout.flush()  # now the report can be read, while what follows is recorded
    if options.html is not None and options.recordings is not None:
        folder, failures = _name_recordings_folder(options.html), options.recordings
        with Progress("recordings") as bar:
            chosen = record_chosen(results, chosen, folder, failures=failures, jobs=options.jobs, progress=bar.count)
        write_text(options.html, write_page(results, chosen, options.panels))
        if not options.quiet:
            print(f"wrote recordings into {folder}, with links in {options.html}")


benchmark = Command(
    "benchmark",
    "Run many trials of scenarios and methods, and compare them.",
    _add_options,
    _run_benchmark,
    "0 all trials ran, 1 some could not be run",
)
report = Command(
    "report",
    "Make tables, plots and recordings of trials that `benchmark` has run.",
    _add_file_options,
    _write_report_of_files,
)
