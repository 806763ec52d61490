"""The command `record`: recordings, stills and clips of one run, or of several methods in one world."""

import argparse
import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from drake_starnav.cli.options import (
    NOT_REACHED,
    REACHED,
    Command,
    add_overrides,
    check_numbers,
    check_seed,
    find_program_name,
    print_written,
    show_progress_bar,
)
from drake_starnav.errors import StarnavError
from drake_starnav.evaluation.report.recordings import read_trial
from drake_starnav.loading import load_scenario, parse_scenario
from drake_starnav.scenario.scenario_file import find_scenario
from drake_starnav.scenario.schema import Scenario, select_world
from drake_starnav.scenario.shipped import METHODS, list_scenario_names
from drake_starnav.utils.files import check_outputs, make_file_name

if TYPE_CHECKING:
    from drake_starnav.visualization.timeline import RecordedRun

TRIAL_SUFFIXES = (".json", ".jsonl")
"""Suffixes of files with trials; every other argument is a scenario."""
STILLS = {
    "png": "stills as pixels", "svg": "vector graphics with axes in metres", "pdf": "the same as PDF",
}  # fmt: skip
"""Options for pictures of one time."""


@dataclass(frozen=True)
class Run:
    """A run to record.

    Attributes:
        scenarios: method -> scenario, in the order given.
        seed: of the world and the sensor's noise.
        state_hash: of the run to repeat; None for a new run.
        log: of a drive on a robot, instead.
    """

    scenarios: dict[str, Scenario]
    seed: int
    state_hash: str | None = None
    log: Path | None = None

    @property
    def name(self) -> str:
        """Scenario, methods and seed, or the log, for file names."""
        if self.log is not None:
            return make_file_name(self.log.stem)
        scenario = next(iter(self.scenarios.values()))
        return "-".join((make_file_name(scenario.name), *self.scenarios, str(self.seed)))


def _add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "run",
        nargs="?",
        metavar="TRIAL.json|SCENARIO",
        help="a trial by `simulate --json` or `benchmark --json`, which is repeated; or a scenario to drive: "
        f"{', '.join(list_scenario_names())}, or a YAML file",
    )
    parser.add_argument("--log", type=Path, metavar="LOG.mcap", help="instead: a drive on a robot, by `drive --log`")
    parser.add_argument("--line", type=int, metavar="N", help="line of the trial in a file of several, from 1")
    parser.add_argument("--method", help=f"one of {', '.join(METHODS)}, or module:function (default: star)")
    parser.add_argument("--seed", type=int, help="of the world and the sensor's noise (default: 0)")
    add_overrides(parser)
    parser.add_argument("--compare", nargs="+", metavar="METHOD", help="methods whose robots drive in one scene")
    parser.add_argument(
        "--html", type=Path, metavar="FILE", help="the recording (default: out/SCENARIO-METHOD-SEED.html)"
    )
    for kind, what in STILLS.items():
        parser.add_argument(
            f"--{kind}", type=float, nargs="*", metavar="T", help=f"{what} at these times, s (default: at the end)"
        )
    parser.add_argument(
        "--layers", metavar="NAME,...", help="what is drawn beside robot and obstacles, e.g. trail,scan (default: all)"
    )
    for option in ("--gif", "--mp4"):
        text = f"write a clip (default: the HTML file's name with .{option[2:]})"
        parser.add_argument(option, type=Path, nargs="?", const=Path(), metavar="FILE", help=text)
    parser.add_argument("--view", default="top", help="top, follow or, for the page alone, oblique (default: top)")
    parser.add_argument(
        "--width",
        type=int,
        default=1100,
        help="of PNG and clips, pixels, and of SVG and PDF, inches / 100 (default: 1100)",
    )
    parser.add_argument("--speed", type=float, default=2.0, help="of clips: times real time (default: 2)")
    parser.add_argument("--rate", type=int, default=10, help="pictures a second of clips (default: 10)")
    parser.add_argument("--quiet", action="store_true", help="no progress bar and no list of files")


def _record_run(options: argparse.Namespace) -> int:
    run = choose_run(options)
    html = options.html or Path("out") / f"{run.name}.html"
    check_outputs([html])  # so that it has a name, from which others are derived
    clips = [
        path if path.name else html.with_suffix(suffix)
        for path, suffix in ((options.gif, ".gif"), (options.mp4, ".mp4"))
        if path is not None
    ]
    _check_numbers(options)
    stills = _list_still_times(html, options)
    input_files = {run.log or Path(options.run)}
    if run.log is None and not Path(options.run).name.endswith(TRIAL_SUFFIXES):
        input_files.add(find_scenario(options.run))
    check_outputs([html, *clips, *(path for path, _ in stills)], input_files)

    from drake_starnav.visualization.page import check_view  # late: bad input is reported before Drake is loaded

    check_view(options.view)
    shown_layers = _choose_layers(run, options)
    if stills or clips:
        _check_pictures(options)
    recorded_run, is_same_run = _record_choice(run, html, options, shown_layers)
    if stills or clips:
        _write_pictures(recorded_run, stills, clips, options)
    if not options.quiet:
        print_written([html, *(path for path, _ in stills), *clips])
    if not is_same_run:
        print(
            f"{find_program_name()} record: this run differs from the trial it repeats; "
            "both need the same versions and settings",
            file=sys.stderr,
        )
    return REACHED if is_same_run else NOT_REACHED


def choose_run(options: argparse.Namespace) -> Run:
    """The run that the command line selects.

    Raises:
        StarnavError: no such trial, scenario, method or parameter, or options that do not go together.
    """
    check_seed(options.seed)
    if (options.run is None) == (options.log is None):
        raise StarnavError("a run and --log: both or none are given; allowed: one of them")
    if options.log is not None:
        return Run({}, 0, log=options.log)
    if options.compare and options.method:
        raise StarnavError("--compare and --method do not go together; allowed: one of them")
    if options.compare and len(set(options.compare)) < len(options.compare):
        raise StarnavError(f"--compare is {' '.join(options.compare)}; allowed: each method once")
    path = Path(options.run)
    if not path.name.endswith(TRIAL_SUFFIXES):
        if options.line is not None:
            raise StarnavError(f"--line {options.line} with scenario {options.run}; allowed: with a file of trials")
        methods = options.compare or [options.method or "star"]
        scenarios = {m: load_scenario(options.run, method=m, overrides=options.overrides) for m in methods}
        if options.compare and any(scenario.robots for scenario in scenarios.values()):
            raise StarnavError(f"--compare with scenario {options.run} of several robots; allowed: one of one robot")
        return Run(scenarios, options.seed or 0)
    for name in ("method", "seed", "overrides", "compare"):
        if getattr(options, name) not in (None, []):
            option_name = "set" if name == "overrides" else name
            raise StarnavError(f"--{option_name} with a trial, which has its own; allowed: with a scenario")
    trial = read_trial(path, options.line)
    check_seed(trial["seed"])
    method, name, text = trial["method"], trial["scenario"], trial.get("text")
    scenario = parse_scenario(text, name=name, method=method) if text else load_scenario(name, method=method)
    return Run({method: select_world(scenario, trial.get("world"))}, trial["seed"], trial.get("state_hash"))


def _check_numbers(options: argparse.Namespace) -> None:
    for kind in STILLS:
        for time in getattr(options, kind) or []:
            if not 0.0 <= time < math.inf:
                raise StarnavError(f"--{kind} is {time:g}; allowed: 0 <= T s")
    check_numbers(options, width=(100, 4400), rate=(1, 50), speed=(0.1, 100.0))


def _check_pictures(options: argparse.Namespace) -> None:
    """Raise a `StarnavError` before the run where its pictures cannot be drawn."""
    from drake_starnav.visualization.world_figure import make_figure

    if options.view == "oblique":
        raise StarnavError("--view oblique with stills or clips, which are drawn from above; allowed: top or follow")
    make_figure(1.0)
    if options.mp4 is not None:
        from drake_starnav.visualization.pictures import import_ffmpeg  # late: it takes Matplotlib

        import_ffmpeg()


def _choose_layers(run: Run, options: argparse.Namespace) -> frozenset[str] | None:
    from drake_starnav.visualization.meshes import LAYERS, select_layers

    names = [*(options.compare or []), *(robot.name for each in run.scenarios.values() for robot in each.robots)]
    trails = [f"trail/{name}" for name in names]
    return None if options.layers is None else select_layers(options.layers, [*LAYERS, *trails])


def _record_choice(
    run: Run, html: Path, options: argparse.Namespace, layers: frozenset[str] | None
) -> tuple["RecordedRun", bool]:
    """Simulate and record; returns what was recorded, and whether the run repeats the given trial."""
    with show_progress_bar("driving") as progress:
        if run.log is not None:
            from drake_starnav.simulation.log_recording import record_log

            return record_log(run.log, html, view=options.view, shown=layers), True
        if options.compare:
            from drake_starnav.simulation.records import record_comparison

            recorded_run = record_comparison(
                run.scenarios, run.seed, html, view=options.view, shown=layers, progress=progress
            )
            return recorded_run, True
        from drake_starnav.simulation.records import make_robots_record, record_robots
        from drake_starnav.simulation.robots import run_robots
        from drake_starnav.simulation.run import run_trial
        from drake_starnav.visualization.recorder import Recorder

        ((method, scenario),) = run.scenarios.items()
        if scenario.robots:
            trials = run_robots(scenario, method=method, seed=run.seed, progress=progress)
            recorded_run = record_robots(scenario, trials, run.seed, html, view=options.view, shown=layers)
            return recorded_run, run.state_hash in (None, make_robots_record(trials)["state_hash"])
        recorder = Recorder(html, options.view, layers)
        trial = run_trial(scenario, method=method, seed=run.seed, observer=recorder, progress=progress)
    assert recorder.recorded is not None
    return recorder.recorded, run.state_hash in (None, trial.state_hash)


def _write_pictures(
    run: "RecordedRun", stills: list[tuple[Path, float]], clips: list[Path], options: argparse.Namespace
) -> None:
    from drake_starnav.visualization.pictures import write_clips, write_still

    for path, time in stills:
        if run.duration < time < math.inf:
            allowed_text = f"allowed: times up to {run.duration:.1f} s"
            raise StarnavError(f"--{path.suffix[1:]} is {time:g}, after the run; {allowed_text}")
    for path, time in stills:
        write_still(path, run, time, options.view, options.width if path.suffix == ".png" else options.width / 100)
    if clips:
        write_clips(clips, run, options.view, options.width, options.speed, options.rate)


def _list_still_times(html: Path, options: argparse.Namespace) -> list[tuple[Path, float]]:
    """The times, s, infinite for the end, of what the options of `STILLS` ask for, beside the recording."""
    stills = []
    for kind in STILLS:
        times = getattr(options, kind)
        for time in [math.inf] if times == [] else times or []:
            time_suffix = "" if time == math.inf else f"-{time:g}s"
            stills.append((html.with_name(f"{html.stem}{time_suffix}.{kind}"), time))
    return stills


record = Command(
    "record",
    "Drive one scenario, or repeat a trial, and leave a recording that opens offline.",
    _add_options,
    _record_run,
    "0 done, 1 done but the run is not the one it should repeat",
)
