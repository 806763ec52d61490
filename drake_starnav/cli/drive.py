"""The commands `drive`, `replay`, `warm` and `calibrate`: a robot that is not simulated."""

import argparse
import json
import math
import sys
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter
from typing import Any

from drake_starnav.cli.options import INTERRUPTED, NOT_REACHED, REACHED, Command, add_scenario
from drake_starnav.errors import StarnavError, counted, shown
from drake_starnav.utils.files import check_outputs, write_text
from drake_starnav.utils.imported import import_named

ROBOTS = {"ros2": "drake_starnav.runtime.ros2:Ros2"}
"""Robots by name."""


def make_imported(kind: str, options: Sequence[str], *arguments: Any) -> Any:
    """What a function that can be imported makes.

    Args:
        kind: of ROBOTS, or `module:name`.
        options: its arguments by name, as NAME=VALUE; a value is JSON, or a text.
        arguments: before these.
    """
    factory = import_named("robot", ROBOTS.get(kind, kind))
    settings = {}
    for option in options:
        key, is_given, value_text = option.partition("=")
        if not is_given:
            raise StarnavError(f"option {shown(option)} has no value; allowed: NAME=VALUE")
        try:
            settings[key] = json.loads(value_text)
        except json.JSONDecodeError:
            settings[key] = value_text
    try:
        return factory(*arguments, **settings)
    except TypeError as error:
        raise StarnavError(f"robot {shown(kind)}: {error}; allowed: the arguments of {factory.__name__}") from None


def _add_drive_options(parser: argparse.ArgumentParser) -> None:
    add_scenario(parser)
    parser.add_argument(
        "--robot", default="ros2", metavar="KIND", help="ros2, or MODULE:NAME of what makes a robot (default: ros2)"
    )
    parser.add_argument("--option", action="append", default=[], metavar="NAME=VALUE", help="of the robot; repeated")
    parser.add_argument("--goal", type=float, nargs="+", metavar="X", help="X Y [YAW], m and rad, where none comes in")
    parser.add_argument("--log", type=Path, metavar="FILE.mcap", help="write what comes in and is commanded")
    parser.add_argument("--seconds", type=float, default=math.inf, help="drive for so long (default: until Ctrl-C)")
    parser.add_argument("--until-reached", action="store_true", help="end when the goal is reached")
    parser.add_argument("--quiet", action="store_true", help="no status")


def _drive_robot(options: argparse.Namespace) -> int:
    from drake_starnav.loading import load_scenario
    from drake_starnav.runtime import Navigator, drive

    if options.goal is not None and len(options.goal) not in (2, 3):
        raise StarnavError(f"--goal has {counted(len(options.goal), 'number')}; allowed: X Y or X Y YAW")
    if not all(map(math.isfinite, options.goal or ())):
        raise StarnavError(f"--goal is {' '.join(map(str, options.goal))}; allowed: finite numbers, m and rad")
    if not options.seconds > 0.0:
        raise StarnavError(f"--seconds is {options.seconds:g}; allowed: more than 0")
    check_outputs([options.log])
    scenario = load_scenario(options.scenario, overrides=options.overrides)
    robot = make_imported(options.robot, options.option, scenario)
    if scenario.drive.timeout == 0.0 and not getattr(robot, "watched", False):
        what = "drive.timeout is 0, and no watchdog sends the base its commands: it keeps the last if this process dies"
        print(f"warning: {what}", file=sys.stderr)
    try:
        navigator = Navigator(scenario, mounts=getattr(robot, "mounts", None))
        if hasattr(robot, "navigator"):
            robot.navigator = navigator  # whose plan it shows
        end_conditions = {"seconds": options.seconds, "until_reached": options.until_reached, "quiet": options.quiet}
        drive_result = drive(navigator, robot, goal=options.goal, log=options.log, **end_conditions)
    except StarnavError:
        robot.close()
        raise
    print(drive_result)
    if drive_result.end == "stopped":
        return INTERRUPTED
    return REACHED if drive_result.end == "reached" or not options.until_reached else NOT_REACHED


drive = Command(
    "drive",
    "Drive a robot that is not simulated, with its own scans and odometry.",
    _add_drive_options,
    _drive_robot,
    "0 driven for --seconds or reached, 1 not reached with --until-reached, 130 stopped by a signal",
)


def _add_log(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("log", type=Path, metavar="LOG.mcap", help="as written by `drive --log`")


def _replay_log(options: argparse.Namespace) -> int:
    from drake_starnav.runtime import replay as repeat

    replayed_log = repeat(options.log)
    print(replayed_log)
    return REACHED if replayed_log.differs is None else NOT_REACHED


replay = Command(
    "replay",
    "Navigate again by the log of a drive, and name the first command that differs.",
    _add_log,
    _replay_log,
    "0 all commands equal to the bit, 1 one differs",
)


def _warm_caches(options: argparse.Namespace) -> int:
    from drake_starnav.loading import load_scenario
    from drake_starnav.runtime import Navigator

    scenario = load_scenario(options.scenario, overrides=options.overrides)
    for _ in range(2):
        begin = perf_counter()
        Navigator(scenario)
        print(f"ready after {perf_counter() - begin:.1f} s")
    return REACHED


warm = Command(
    "warm",
    "Compile all that a robot's declarations can use, and say how long that takes then and once compiled.",
    add_scenario,
    _warm_caches,
)


def _add_calibrate_options(parser: argparse.ArgumentParser) -> None:
    _add_log(parser)
    parser.add_argument("--out", type=Path, metavar="FILE", help="a YAML file (default: the standard output)")


def _calibrate_from_log(options: argparse.Namespace) -> int:
    from drake_starnav.loading import parse_scenario
    from drake_starnav.runtime import read_log
    from drake_starnav.runtime.calibration import calibrate

    check_outputs([options.out], [options.log])
    log = read_log(options.log)
    text = calibrate(log, parse_scenario(log.scenario, name=log.name))
    if options.out is None:
        sys.stdout.write(text)
    else:
        write_text(options.out, text)
    return REACHED


calibrate = Command(
    "calibrate",
    "Say what a robot is like by the log of a drive, as YAML to declare.",
    _add_calibrate_options,
    _calibrate_from_log,
)
