"""The commands `simulate` and `demo`: drive one scenario."""

import argparse
import json
import os
import sys
import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING

from drake_starnav.cli.options import (
    NOT_REACHED,
    REACHED,
    Command,
    add_overrides,
    add_scenario,
    check_seed,
    print_written,
    show_progress_bar,
)
from drake_starnav.errors import StarnavError, counted
from drake_starnav.scenario.shipped import METHODS
from drake_starnav.utils.files import check_outputs, write_text

if TYPE_CHECKING:
    from drake_starnav.scenario.schema import Scenario

CODES = "0 the goal was reached, 1 it was not"
DEMO_FILES = Path("out", "forest.html"), Path("out", "forest.json")


def _add_options(parser: argparse.ArgumentParser) -> None:
    add_scenario(parser)
    _add_run_options(parser)
    parser.add_argument("--html", type=Path, metavar="FILE", help="write a recording that opens offline")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures")
    parser.add_argument("--meshcat", action="store_true", help="drive in a live page, where sliders move the goal")
    parser.add_argument(
        "--real-time-rate", type=float, metavar="X",
        help="with --meshcat: simulated time over real time at most; 0 for as fast as it goes (default: 1)",
    )  # fmt: skip


def _add_demo_options(parser: argparse.ArgumentParser) -> None:
    add_overrides(parser)
    _add_run_options(parser)
    html, figures = DEMO_FILES
    parser.set_defaults(scenario="forest", html=html, json=figures, meshcat=False, real_time_rate=None)


def _add_run_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--method", default="star", help=f"one of {', '.join(METHODS)}, or module:function (default: star)"
    )
    parser.add_argument("--seed", type=int, default=0, help="of the world and the sensor's noise (default: 0)")
    parser.add_argument("--quiet", action="store_true", help="no progress bar and no table")


def _run_simulation(options: argparse.Namespace) -> int:
    from drake_starnav.loading import load_scenario
    from drake_starnav.scenario.scenario_file import find_scenario, format_scenario
    from drake_starnav.worlds import make_world

    check_seed(options.seed)
    _check_live_options(options)
    scenario = load_scenario(options.scenario, method=options.method, overrides=options.overrides)
    check_outputs((options.html, options.json), [find_scenario(options.scenario)])
    if options.meshcat:
        return _simulate_live(scenario, options)
    with show_progress_bar(f"{scenario.name} seed {options.seed}") as progress:
        if not scenario.robots:  # a bad world is reported before Drake is loaded
            make_world(scenario.world, options.seed, scenario.robot.shape, scenario.goals)
        from drake_starnav.simulation.records import make_driven_record

        record = make_driven_record(
            scenario, method=options.method, seed=options.seed, html=options.html, progress=progress
        )
    if options.json is not None:
        write_text(options.json, json.dumps({**record, "text": format_scenario(scenario)}, indent=2) + "\n")
    if not options.quiet:
        print("\n".join(map(_format_robot_line, record["robots"])) if scenario.robots else _format_table(record))
        print_written((options.html, options.json))
        if options.html is not None:
            print(f"open {options.html.resolve().as_uri()} in a browser, no network needed")
    return REACHED if record["outcome"] == "reached" else NOT_REACHED


def _format_robot_line(record: dict) -> str:
    why = record["contact"] or (record["outcome"] in ("blocked", "unreachable") and record["blocked_by"]) or ""
    return (
        f"{record['robot']:>16}  {record['outcome']}{f' ({why})' if why else ''}, {record['time_s']:.1f} s, "
        f"{record['path_length_m']:.2f} m, at least {record['min_gap_m']:.2f} m from the others"
    )


def _check_live_options(options: argparse.Namespace) -> None:
    rate = options.real_time_rate
    if rate is not None and not (options.meshcat and 0.0 <= rate <= 100.0):
        raise StarnavError(f"--real-time-rate is {rate:g}; allowed: 0 <= x <= 100, with --meshcat")
    if options.meshcat and options.json is not None:
        raise StarnavError("--json with --meshcat, where the goal moves and no figure can be repeated; allowed: --html")


def _simulate_live(scenario: "Scenario", options: argparse.Namespace) -> int:
    from drake_starnav.cli.live import LiveRobots, LiveRun  # late: bad input is reported before Drake is loaded

    rate = 1.0 if options.real_time_rate is None else options.real_time_rate
    kind = LiveRobots if scenario.robots else LiveRun
    run = kind(scenario, method=options.method, seed=options.seed, real_time_rate=rate, html=options.html)
    page_address, goal = run.meshcat.web_url(), "" if scenario.robots else "; sliders move the goal"
    print(f"open {page_address} and press start (s); pause (space), stop (escape){goal}", flush=True)
    if os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY") or sys.platform == "darwin":
        webbrowser.open(page_address)
    run.run(options.quiet)
    run.finish()
    return NOT_REACHED if run.collided else REACHED


def _format_table(record: dict) -> str:
    from drake_starnav.station.monitors import describe_contact  # late: it loads Drake

    outcome, shortest_length = record["outcome"], record["shortest_path_m"]
    ratio_text = f" ({record['path_length_m'] / shortest_length:.3f} x shortest)" if shortest_length else ""
    clearance = record["min_clearance_m"]
    median_times = {name: record[name]["p50_s"] * 1e6 for name in ("command", "scan", "plan")}
    rows = (
        ("outcome", describe_contact(outcome, record["contact"]) if record["contact"] else outcome),
        *([("blocked", f"at {record['blocked_s']:.0f} s: {record['blocked_by']}")] if record["blocked_by"] else []),
        ("time", f"{record['time_s']:.1f} s ({record['wall_s']:.1f} s on the wall)"),
        ("path", f"{record['path_length_m']:.2f} m{ratio_text}"),
        ("mean speed", f"{record['mean_speed_mps']:.2f} m/s"),
        ("least clearance", "nothing to hit" if clearance is None else f"{clearance * 1000:.0f} mm"),
        ("roadmap", counted(record["nodes"], "node")),
        ("median times", ", ".join(f"{name} {value:.0f} us" for name, value in median_times.items())),
    )
    return "\n".join(f"{name:>16}  {value}" for name, value in rows)


simulate = Command("simulate", "Drive one scenario and report how it went.", _add_options, _run_simulation, CODES)
demo = Command(
    "demo", f"Drive the forest; write {DEMO_FILES[0]} and {DEMO_FILES[1]}.", _add_demo_options, _run_simulation, CODES
)
