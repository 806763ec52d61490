"""What the command lines share."""

import argparse

REACHED, NOT_REACHED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130
"""Exit codes."""


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
