"""The command lines of the package, for `starnav`, `python -m drake_starnav` and scripts/."""

import argparse
import inspect
import json
import os
import sys
import webbrowser
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from drake_starnav.cli.options import (
    NOT_REACHED,
    REACHED,
    CommandParser,
    add_overrides,
    check_seed,
    command_name,
    exit_code,
    print_written,
    program_name,
    progress_bar,
    run_command,
)
from drake_starnav.errors import StarnavError
from drake_starnav.parameters import unknown_name
from drake_starnav.scenario.shipped import METHODS, scenario_names
from drake_starnav.utils.files import check_outputs, file_name, write_text

if TYPE_CHECKING:
    from drake_starnav.scenario import Scenario

RUN_CODES = "exit codes: 0 the goal was reached, 1 it was not, 2 bad input"

# What commands need is imported when they run: help and bad options are answered before it.


def simulate(arguments: Sequence[str] | None = None) -> int:
    """Run one scenario; see `--help`. Returns the exit code."""
    parser = CommandParser(
        prog=command_name("simulate"), description="Drive one scenario and report how it went.", epilog=RUN_CODES
    )
    parser.add_argument("scenario", help=f"a shipped scenario ({', '.join(scenario_names())}) or a YAML file")
    _add_run_options(parser)
    parser.add_argument("--html", type=Path, metavar="FILE", help="write a recording that opens offline")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures")
    parser.add_argument(
        "--meshcat", action="store_true", help="drive in a live page with buttons, the goal moved by sliders"
    )
    parser.add_argument(
        "--real-time-rate", type=float, metavar="X",
        help="with --meshcat: simulated time over real time at most; 0 for as fast as it goes (default: 1)",
    )  # fmt: skip
    return run_command(parser, arguments, _simulate)


def demo(arguments: Sequence[str] | None = None) -> int:
    """Drive the forest and leave its recording in out/; see `--help`. Returns the exit code."""
    html, figures = Path("out", "forest.html"), Path("out", "forest.json")
    parser = CommandParser(
        prog=command_name("demo"), description=f"Drive the forest; write {html} and {figures}.", epilog=RUN_CODES
    )
    _add_run_options(parser)
    parser.set_defaults(scenario="forest", html=html, json=figures, meshcat=False, real_time_rate=None)
    return run_command(parser, arguments, _simulate)


def _add_run_options(parser: CommandParser) -> None:
    parser.add_argument("--method", default="star", help=f"one of {', '.join(METHODS)} (default: star)")
    parser.add_argument("--seed", type=int, default=0, help="of the world and the sensor's noise (default: 0)")
    add_overrides(parser)
    parser.add_argument("--quiet", action="store_true", help="no progress bar and no table")


def benchmark(arguments: Sequence[str] | None = None) -> int:
    """Run many trials and report their figures; see `--help`. Returns the exit code."""
    from drake_starnav.cli.benchmark import benchmark as command

    return command(arguments)


def report(arguments: Sequence[str] | None = None) -> int:
    """Report on trials that have run; see `--help`. Returns the exit code."""
    from drake_starnav.cli.benchmark import report as command

    return command(arguments)


def record(arguments: Sequence[str] | None = None) -> int:
    """Record one run; see `--help`. Returns the exit code."""
    from drake_starnav.cli.record import record as command

    return command(arguments)


def _simulate(options: argparse.Namespace) -> int:
    from drake_starnav.scenario.schema import load_scenario, scenario_text
    from drake_starnav.scenario.source_files import input_files
    from drake_starnav.worlds import make_world

    check_seed(options.seed)
    _check_live_options(options)
    scenario = load_scenario(options.scenario, method=options.method, overrides=options.overrides)
    check_outputs((options.html, options.json), input_files(options.scenario, scenario))
    if options.meshcat:
        return _simulate_live(scenario, options)
    with progress_bar(f"{scenario.name} seed {options.seed}") as progress:
        world = make_world(scenario.world, options.seed, scenario.robot.radius)
        from drake_starnav.simulation import run_trial, trial_record  # late: a bad world is reported before it

        trial = run_trial(
            scenario,
            method=options.method,
            seed=options.seed,
            world=world if world.model is None else None,  # only Drake can read a model's footprints
            html=options.html,
            progress=progress,
        )
    if options.json is not None:
        fields = {**trial_record(trial), "text": scenario_text(scenario)}
        write_text(options.json, json.dumps(fields, indent=2) + "\n")
    if not options.quiet:
        print(_table(trial_record(trial)))
        print_written((options.html, options.json))
        if options.html is not None:
            print(f"open {options.html.resolve().as_uri()} in a browser, no network needed")
    return REACHED if trial.outcome == "reached" else NOT_REACHED


def _check_live_options(options: argparse.Namespace) -> None:
    rate = options.real_time_rate
    if rate is not None and not (options.meshcat and 0.0 <= rate <= 100.0):
        raise StarnavError(f"--real-time-rate is {rate:g}; allowed: 0 <= x <= 100, with --meshcat")
    if options.meshcat and options.json is not None:
        raise StarnavError("--json with --meshcat, where the goal moves and no figure can be repeated; allowed: --html")


def _simulate_live(scenario: "Scenario", options: argparse.Namespace) -> int:
    from drake_starnav.cli.live import LiveRun  # late: bad input is reported before Drake is loaded

    rate = 1.0 if options.real_time_rate is None else options.real_time_rate
    say = (lambda text: None) if options.quiet else print
    run = LiveRun(scenario, method=options.method, seed=options.seed, real_time_rate=rate, html=options.html, say=say)
    address = run.page.address
    print(f"open {address} and press play (s); pause (space), stop (escape), the goal: arrow keys", flush=True)
    if os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY") or sys.platform == "darwin":
        webbrowser.open(address)
    run.run()
    run.finish()
    return NOT_REACHED if run.collided else REACHED


def show_world(arguments: Sequence[str] | None = None) -> int:
    """Draw the world of one scenario; see `--help`. Returns the exit code."""
    parser = CommandParser(
        prog=command_name("show_world"),
        description="Draw a scenario's world with start, goal, shortest path and the paths of moving obstacles.",
    )
    parser.add_argument("scenario", help=f"a shipped scenario ({', '.join(scenario_names())}) or a YAML file")
    parser.add_argument("--seed", type=int, default=0, help="of the world (default: 0)")
    add_overrides(parser)
    parser.add_argument("--out", type=Path, metavar="FILE", help="a .png or an .html (default: out/SCENARIO.png)")
    return run_command(parser, arguments, _show_world)


def _show_world(options: argparse.Namespace) -> int:
    from drake_starnav.scenario.schema import load_scenario
    from drake_starnav.scenario.source_files import input_files
    from drake_starnav.worlds import make_world

    check_seed(options.seed)
    scenario = load_scenario(options.scenario, overrides=options.overrides)
    file = Path("out", f"{file_name(scenario.name)}.png") if options.out is None else options.out
    if file.suffix not in (".png", ".html"):
        raise StarnavError(f"--out is {file}; allowed: a file whose name ends in .png or .html")
    check_outputs([file], input_files(options.scenario, scenario))
    with progress_bar(f"{scenario.name} seed {options.seed}"):
        make_world(scenario.world, options.seed, scenario.robot.radius)  # bad input is reported before Drake is loaded
        from drake_starnav.simulation import omniscient_path
        from drake_starnav.station.model_world import make_world_with_footprints
        from drake_starnav.visualization.world_figure import write_html, write_png

        world = make_world_with_footprints(scenario.world, options.seed, scenario.robot.radius)
        found = omniscient_path(world, scenario.robot.radius)
        length = "no shortest path" if found is None else f"shortest path {found[0]:.2f} m"
        title = f"{scenario.name} · seed {options.seed} · {length}"
        write = write_png if file.suffix == ".png" else write_html
        write(world, scenario.robot, None if found is None else found[1], title, file)
    moving = f", {len(world.moving_obstacles)} that move" if len(world.moving_obstacles) else ""
    print(f"{title}\nobstacles: {len(world.discs)} round, {len(world.polygons)} polygons{moving}\nwrote {file}")
    return REACHED


def _table(record: dict) -> str:
    shortest = record["shortest_path_m"]
    ratio = f" ({record['path_length_m'] / shortest:.3f} x shortest)" if shortest else ""
    clearance = record["min_clearance_m"]
    micro = {name: record[name]["p50_s"] * 1e6 for name in ("command", "scan", "plan")}
    rows = (
        ("outcome", record["outcome"] + (f" of {record['contact']}" if record["contact"] else "")),
        ("time", f"{record['time_s']:.1f} s ({record['wall_s']:.1f} s on the wall)"),
        ("path", f"{record['path_length_m']:.2f} m{ratio}"),
        ("mean speed", f"{record['mean_speed_mps']:.2f} m/s"),
        ("least clearance", "nothing to hit" if clearance is None else f"{clearance * 1000:.0f} mm"),
        ("roadmap", f"{record['nodes']} nodes"),
        ("median times", ", ".join(f"{name} {value:.0f} us" for name, value in micro.items())),
    )
    return "\n".join(f"{name:>16}  {value}" for name, value in rows)


COMMANDS = {
    "demo": demo, "simulate": simulate, "record": record, "benchmark": benchmark, "report": report,
    "show_world": show_world,
}  # fmt: skip
"""Commands of `starnav`; scripts/ has one file for each but `demo`."""


def main(arguments: Sequence[str] | None = None) -> int:
    """`starnav [COMMAND ...]`: run a command, or list commands, scenarios, methods and worlds."""
    arguments = sys.argv[1:] if arguments is None else arguments
    if arguments and arguments[0] in COMMANDS:
        return COMMANDS[arguments[0]](arguments[1:])
    return exit_code(program_name(), lambda: _list(arguments))


def _list(arguments: Sequence[str]) -> int:
    if list(arguments) == ["--version"]:
        from drake_starnav.evaluation.trial_file import versions

        found = versions()
        print(f"drake_starnav {found['drake_starnav']} (source {found['source']}), Drake {found['drake']}")
        return REACHED
    if arguments and arguments[0] not in ("-h", "--help"):
        raise unknown_name("command", arguments[0], COMMANDS)
    print(_listing())
    return REACHED


def _listing() -> str:
    """Commands, scenarios, methods and worlds."""
    from drake_starnav.worlds import WORLD_KINDS

    commands = {name: _first_sentence(command).partition(";")[0] for name, command in COMMANDS.items()}
    worlds = {f"!{name}": _first_sentence(kind) for name, kind in WORLD_KINDS.items()}
    width = max(map(len, (*commands, *worlds)))
    return "\n".join(
        (
            f"usage: {program_name()} COMMAND ...   (COMMAND --help for its options)   or --version",
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
