"""The command lines of the package: what scripts/ and `python -m drake_starnav` call."""

import argparse
import inspect
import json
import os
import sys
import webbrowser
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from tqdm import tqdm

from drake_starnav.console import BAD_INPUT, INTERRUPTED, NOT_REACHED, REACHED, add_overrides
from drake_starnav.errors import StarnavError
from drake_starnav.files import check_writable, write_text
from drake_starnav.parameters import unknown_name
from drake_starnav.record_command import record
from drake_starnav.scenario import METHODS, Scenario, load_scenario, scenario_names, scenario_text
from drake_starnav.worlds import WORLD_KINDS

if TYPE_CHECKING:
    from drake_starnav.benchmark import Pool
    from drake_starnav.report import Results

MOST_WORLDS = 100_000
"""In one range of `--worlds`."""


def simulate(arguments: Sequence[str] | None = None) -> int:
    """Run one scenario; see `--help`. Returns the exit code."""
    parser = argparse.ArgumentParser(prog="simulate.py", description="Drive one scenario and say how it went.")
    parser.add_argument("scenario", help=f"a shipped scenario ({', '.join(scenario_names())}) or a YAML file")
    parser.add_argument("--method", default="star", help=f"one of {', '.join(METHODS)} (default: star)")
    parser.add_argument("--seed", type=int, default=0, help="of the world and the sensor's noise (default: 0)")
    add_overrides(parser)
    parser.add_argument("--html", type=Path, metavar="FILE", help="write a recording that opens offline")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures")
    parser.add_argument("--quiet", action="store_true", help="no progress bar and no table")
    parser.add_argument(
        "--meshcat", action="store_true", help="drive in a live page with buttons, the goal moved by sliders"
    )
    parser.add_argument(
        "--real-time-rate", type=float, metavar="X",
        help="with --meshcat: simulated time over real time at most; 0 for as fast as it goes (default: 1)",
    )  # fmt: skip
    options = parser.parse_args(arguments)
    try:
        return _simulate(options)
    except StarnavError as error:
        print(f"{parser.prog}: {error}", file=sys.stderr)
        return BAD_INPUT


def _simulate(options: argparse.Namespace) -> int:
    if options.seed < 0:
        raise StarnavError(f"--seed is {options.seed}; allowed: a whole number >= 0")
    for path in (options.html, options.json):
        check_writable(path)
    _check_live_options(options)
    scenario = load_scenario(options.scenario, method=options.method, overrides=options.overrides)
    if options.meshcat:
        return _simulate_live(scenario, options)
    from drake_starnav.simulation import run_trial, trial_record  # late: bad input is told before Drake is loaded

    with tqdm(total=1.0, disable=options.quiet or None, leave=False, bar_format="{desc} {bar} {elapsed}") as bar:

        def progress(now: float, limit: float) -> None:
            bar.set_description(f"{scenario.name} seed {options.seed}: {now:5.1f} s of at most {limit:g} s")
            bar.n = now / limit
            bar.refresh()

        trial = run_trial(scenario, method=options.method, seed=options.seed, html=options.html, progress=progress)
    if options.json is not None:
        fields = {**trial_record(trial), "text": scenario_text(scenario)}
        write_text(options.json, json.dumps(fields, indent=2) + "\n")
    if not options.quiet:
        print(_table(trial_record(trial)))
        for path in (options.html, options.json):
            if path is not None:
                print(f"wrote {path}")
        if options.html is not None:
            print(f"open file://{options.html.resolve()} in a browser, no network needed")
    return REACHED if trial.outcome == "reached" else NOT_REACHED


def _check_live_options(options: argparse.Namespace) -> None:
    rate = options.real_time_rate
    if rate is not None and not (options.meshcat and 0.0 <= rate <= 100.0):
        raise StarnavError(f"--real-time-rate is {rate:g}; allowed: 0 <= x <= 100, with --meshcat")
    if options.meshcat and options.json is not None:
        raise StarnavError("--json with --meshcat, where the goal moves and no figure can be repeated; allowed: --html")


def _simulate_live(scenario: Scenario, options: argparse.Namespace) -> int:
    from drake_starnav.live import LiveRun  # late: bad input is told before Drake is loaded

    rate = 1.0 if options.real_time_rate is None else options.real_time_rate
    say = (lambda text: None) if options.quiet else print
    run = LiveRun(scenario, seed=options.seed, real_time_rate=rate, html=options.html, say=say)
    address = run.meshcat.web_url()
    print(f"open {address} and press start (s); pause (space), stop (escape), the goal: arrow keys", flush=True)
    if os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY") or sys.platform == "darwin":
        webbrowser.open(address)
    run.run()
    run.finish(options.method, options.seed)
    return NOT_REACHED if run.collided else REACHED


def benchmark(arguments: Sequence[str] | None = None) -> int:
    """Run many trials and tell their figures; see `--help`. Returns the exit code."""
    parser = argparse.ArgumentParser(
        prog="benchmark.py",
        description="Run many trials of scenarios and methods, and compare them.",
        epilog="exit codes: 0 all trials ran, 1 some could not be run, 2 bad input, 130 interrupted",
    )
    parser.add_argument("scenario", nargs="*", help=f"shipped scenarios ({', '.join(scenario_names())}) or YAML files")
    parser.add_argument("--suite", metavar="NAME", help="a named set of scenarios and methods with its table: table1")
    parser.add_argument("--method", nargs="+", help=f"of {', '.join(METHODS)} (default: star, or the suite's)")
    add_overrides(parser)
    parser.add_argument(
        "--worlds",
        metavar="NUMBERS",
        help="instead of --trials, one trial in each numbered world of the scenario's file, e.g. 0-149 or 3,7,20-29",
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write a line for each trial as it ends")
    _add_report_options(parser)
    add_batch_options(parser)
    options = parser.parse_args(arguments)
    try:
        return _benchmark(options)
    except StarnavError as error:
        print(f"{parser.prog}: {error}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        kept = f"; the trials that ended are in {options.json}, --resume goes on" if options.json else ""
        print(f"{parser.prog}: interrupted{kept}", file=sys.stderr)
        return INTERRUPTED


def add_batch_options(parser: argparse.ArgumentParser) -> None:
    """The options that every command which runs many trials has; see `check_batch_options`."""
    parser.add_argument("--trials", type=int, default=30, help="of each scenario and method (default: 30)")
    parser.add_argument("--seed", type=int, default=0, help="that all trials' seeds are derived from (default: 0)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes (default: one for each core)")
    parser.add_argument(
        "--dask", metavar="ADDRESS", help="run on a Dask cluster: its scheduler's address, or local for --jobs workers"
    )
    parser.add_argument("--resume", action="store_true", help="continue a file: run only the trials it lacks")
    parser.add_argument("--quiet", action="store_true", help="no progress bar and no tables")


def check_batch_options(options: argparse.Namespace) -> None:
    """Raise `StarnavError` for a number out of its range."""
    for name, low in (("trials", 1), ("seed", 0), ("jobs", 1)):
        if getattr(options, name) < low:
            raise StarnavError(f"--{name} is {getattr(options, name)}; allowed: a whole number >= {low}")


def chosen_pool(options: argparse.Namespace) -> AbstractContextManager["Pool"]:
    """Where the trials run: the processes or the cluster that the options of `add_batch_options` ask for."""
    from drake_starnav.benchmark import dask_pool, local_pool

    return dask_pool(options.dask, options.jobs) if options.dask else nullcontext(local_pool(options.jobs))


def world_numbers(text: str) -> list[int]:
    """Numbers and ranges as in "3,7,20-29", in ascending order, each once."""
    numbers: set[int] = set()
    for part in text.split(","):
        first, dash, last = part.partition("-")
        if not first.strip().isdecimal() or (dash and not last.strip().isdecimal()):
            raise StarnavError(f"--worlds is {text!r}; allowed: numbers and ranges, e.g. 0-149 or 3,7,20-29")
        low, high = int(first), int(last if dash else first)
        if not low <= high < low + MOST_WORLDS:
            raise StarnavError(f"--worlds has {part!r}; allowed: an ascending range of at most {MOST_WORLDS}")
        numbers.update(range(low, high + 1))
    return sorted(numbers)


def _benchmark(options: argparse.Namespace) -> int:
    check_batch_options(options)
    if options.resume and options.json is None:
        raise StarnavError("--resume without --json; allowed: --resume --json FILE, the file to continue")
    if bool(options.scenario) == bool(options.suite):
        raise StarnavError(
            f"{'both scenarios and' if options.suite else 'neither a scenario nor'} --suite; allowed: one of the two"
        )
    _check_report_options(options)
    worlds = None if options.worlds is None else world_numbers(options.worlds)
    from drake_starnav.benchmark import TrialFile, check_worlds, find_suite, make_cases, make_header, run_batch

    suite = find_suite(options.suite) if options.suite else None
    methods = options.method or (suite.methods if suite else ["star"])
    cases = make_cases(suite.scenarios if suite else options.scenario, methods, options.overrides)
    if worlds is not None:
        check_worlds(cases, worlds)
    header = make_header(cases, options.seed, options.overrides, suite=options.suite, in_worlds=worlds is not None)
    with (
        chosen_pool(options) as pool,
        TrialFile(options.json, header, resume=options.resume) if options.json else nullcontext() as file,
    ):
        if file and file.repaired:
            print(file.repaired, file=sys.stderr)
        records = run_batch(
            cases, trials=worlds or options.trials, seed=options.seed, pool=pool, file=file, quiet=options.quiet
        )
    from drake_starnav.report.results import make_results

    _report(make_results([header], records), options)
    if not options.quiet and options.json is not None:
        print(f"wrote {options.json}")
    return NOT_REACHED if any(record["outcome"] == "error" for record in records) else REACHED


def report(arguments: Sequence[str] | None = None) -> int:
    """Report on trials that have run; see `--help`. Returns the exit code."""
    parser = argparse.ArgumentParser(
        prog="report.py",
        description="Make tables, plots and recordings of trials that benchmark.py has run.",
    )
    parser.add_argument(
        "file", nargs="+", type=Path, help="files that benchmark.py --json wrote, as they are or as .xz"
    )
    _add_report_options(parser)
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes that record (default: cores)")
    parser.add_argument("--quiet", action="store_true", help="no progress bar and no tables")
    options = parser.parse_args(arguments)
    try:
        if options.jobs < 1:
            raise StarnavError(f"--jobs is {options.jobs}; allowed: a whole number >= 1")
        _check_report_options(options)
        from drake_starnav.report.results import read_results

        _report(read_results(options.file), options)
    except StarnavError as error:
        print(f"{parser.prog}: {error}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        print(f"{parser.prog}: interrupted", file=sys.stderr)
        return INTERRUPTED
    return REACHED


def _add_report_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="write the tables")
    parser.add_argument(
        "--csv", type=Path, metavar="FILE", help="write the figures, a line for each scenario and method"
    )
    parser.add_argument("--html", type=Path, metavar="FILE", help="write a report that opens offline")
    parser.add_argument(
        "--recordings", type=int, default=3, metavar="N",
        help="for the HTML report, record at most N failures of each scenario and method, and two successes "
        "(default: 3; -1: record nothing)",
    )  # fmt: skip
    parser.add_argument(
        "--panels", type=int, default=12, metavar="N", help="worlds of each scenario that it draws (default: 12)"
    )


def _check_report_options(options: argparse.Namespace) -> None:
    for name, low in (("recordings", -1), ("panels", 1)):
        if getattr(options, name) < low:
            raise StarnavError(f"--{name} is {getattr(options, name)}; allowed: a whole number >= {low}")
    for path in (options.markdown, options.csv, options.html):
        check_writable(path)
    if options.html is not None:
        from drake_starnav.report.figures import new_figure

        new_figure(1.0)  # tells whether there is a matplotlib before anything runs


def _report(results: "Results", options: argparse.Namespace) -> None:
    """Print the tables and write what the options of `_add_report_options` ask for."""
    from drake_starnav.report import Report, chosen_trials, record_chosen, summary_csv, tables_markdown, write_page

    tables = tables_markdown(results)
    if not options.quiet:
        print(tables)
    if options.markdown is not None:
        write_text(options.markdown, tables + "\n")
    if options.csv is not None:
        write_text(options.csv, summary_csv(results))
    if options.html is not None:
        folder = options.html.with_name(f"{options.html.stem}_recordings")
        recordings = chosen_trials(results)
        if options.recordings >= 0:
            with tqdm(desc="recordings", unit="trial", disable=options.quiet or None, leave=False) as bar:

                def progress(done: int, total: int) -> None:
                    bar.total = total
                    bar.update(done - bar.n)

                recordings = record_chosen(
                    results, recordings, folder, failures=options.recordings, jobs=options.jobs, progress=progress
                )
        write_text(options.html, write_page(Report(results, recordings, options.panels)))
    if not options.quiet:
        for path in (options.markdown, options.csv, options.html):
            if path is not None:
                print(f"wrote {path}")


def show_world(arguments: Sequence[str] | None = None) -> int:
    """Draw the world of one scenario; see `--help`. Returns the exit code."""
    parser = argparse.ArgumentParser(
        prog="show_world.py",
        description="Draw a scenario's world with start, goal, shortest path and the paths of what moves.",
    )
    parser.add_argument("scenario", help=f"a shipped scenario ({', '.join(scenario_names())}) or a YAML file")
    parser.add_argument("--seed", type=int, default=0, help="of the world (default: 0)")
    add_overrides(parser)
    parser.add_argument("--out", type=Path, metavar="FILE", help="a .png or an .html (default: out/SCENARIO.png)")
    options = parser.parse_args(arguments)
    try:
        return _show_world(options)
    except StarnavError as error:
        print(f"{parser.prog}: {error}", file=sys.stderr)
        return BAD_INPUT


def _show_world(options: argparse.Namespace) -> int:
    if options.seed < 0:
        raise StarnavError(f"--seed is {options.seed}; allowed: a whole number >= 0")
    scenario = load_scenario(options.scenario, overrides=options.overrides)
    file = Path("out", f"{scenario.name}.png") if options.out is None else options.out
    if file.suffix not in (".png", ".html"):
        raise StarnavError(f"--out is {file}; allowed: a file whose name ends in .png or .html")
    check_writable(file)
    from drake_starnav.simulation import omniscient_path
    from drake_starnav.systems.model_world import make_world_with_footprints
    from drake_starnav.world_figure import write_html, write_png

    world = make_world_with_footprints(scenario.world, options.seed, scenario.robot.radius)
    found = omniscient_path(world, scenario.robot.radius)
    length = "no shortest path" if found is None else f"shortest path {found[0]:.2f} m"
    title = f"{scenario.name} · seed {options.seed} · {length}"
    write = write_png if file.suffix == ".png" else write_html
    write(world, scenario.robot, None if found is None else found[1], title, file)
    moving = f", {len(world.movers)} that move" if len(world.movers) else ""
    print(f"{title}\nobstacles: {len(world.discs)} round, {len(world.polygons)} polygons{moving}\nwrote {file}")
    return REACHED


def _table(record: dict) -> str:
    shortest = record["shortest_path_m"]
    ratio = f" ({record['path_length_m'] / shortest:.3f} x shortest)" if shortest else ""
    clearance = record["min_clearance_m"]
    micro = {name: record[name]["p50_s"] * 1e6 for name in ("command", "scan", "plan")}
    rows = (
        ("outcome", record["outcome"]),
        ("time", f"{record['time_s']:.1f} s ({record['wall_s']:.1f} s on the wall)"),
        ("path", f"{record['path_length_m']:.2f} m{ratio}"),
        ("mean speed", f"{record['mean_speed_mps']:.2f} m/s"),
        ("least clearance", "nothing to hit" if clearance is None else f"{clearance * 1000:.0f} mm"),
        ("roadmap", f"{record['nodes']} nodes"),
        ("median times", ", ".join(f"{name} {value:.0f} us" for name, value in micro.items())),
    )
    return "\n".join(f"{name:>16}  {value}" for name, value in rows)


COMMANDS = {
    "simulate": simulate, "record": record, "benchmark": benchmark, "report": report, "show_world": show_world,
}  # fmt: skip
"""Commands of `python -m drake_starnav`; scripts/ has one file for each."""


def main(arguments: Sequence[str] | None = None) -> int:
    """`python -m drake_starnav [COMMAND ...]`: run a command, or list commands, scenarios, methods and worlds."""
    arguments = sys.argv[1:] if arguments is None else arguments
    if not arguments or arguments[0] in ("-h", "--help"):
        print(_listing())
        return REACHED
    if arguments[0] not in COMMANDS:
        print(f"python -m drake_starnav: {unknown_name('command', arguments[0], COMMANDS)}", file=sys.stderr)
        return BAD_INPUT
    return COMMANDS[arguments[0]](arguments[1:])


def _listing() -> str:
    """All that a command line can name."""
    commands = {name: _first_sentence(command).partition(";")[0] for name, command in COMMANDS.items()}
    worlds = {f"!{name}": _first_sentence(kind) for name, kind in WORLD_KINDS.items()}
    width = max(map(len, (*commands, *worlds)))
    return "\n".join(
        (
            "usage: python -m drake_starnav COMMAND ...   (COMMAND --help for its options)",
            "",
            "commands",
            *(f"  {name:<{width}}  {text}" for name, text in commands.items()),
            "",
            f"scenarios  {', '.join(scenario_names())}, or a YAML file",
            f"methods    {', '.join(METHODS)}",
            "",
            "worlds that a YAML file can ask for",
            *(f"  {name:<{width}}  {text}" for name, text in worlds.items()),
        )
    )


def _first_sentence(documented: object) -> str:
    return (inspect.getdoc(documented) or "").splitlines()[0].rstrip(".")
