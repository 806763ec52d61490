"""Drive one robot with lidars at several places through the same worlds, and compare with one on its axis.

Run: python scripts/experiments/lidar_mounts.py --trials 8
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from drake_starnav.evaluation.summary import format_markdown_table, format_number
from drake_starnav.utils.files import read_text, write_text
from drake_starnav.utils.resources import find_model_path
from scripts.experiments.experiment import (
    Results,
    comparison_cells,
    comparison_head,
    experiment,
    experiment_parser,
    run_experiment,
)

FRAMES = {
    "ahead": ("0.2 0 0.08", "0 0 0"),
    "behind": ("-0.2 0 0.08", "0 0 2.5"),
    "upside_down": ("0.1 0.05 0.08", "3.141592653589793 0 0.5"),
    "right_corner": ("0.16 -0.16 0.08", "0 0 -0.7853981633974483"),
    "left_corner": ("-0.16 0.16 0.08", "0 0 2.356194490192345"),
}
"""Where starbot gets further frames: xyz, m, and rpy, rad, in base_link."""
CORNERS = (
    "lidar.beams=271",
    "lidar.angle_min=-2.356194490192345",
    "lidar.angle_max=2.356194490192345",
    "lidars=[{frame: right_corner}, {frame: left_corner}]",
)
MOUNTS = {
    "centred": (),
    "0.2 m ahead": ("lidar.frame=ahead",),
    "0.2 m behind, turned": ("lidar.frame=behind",),
    "upside down": ("lidar.frame=upside_down",),
    "two of 270 degrees at corners": CORNERS,
}
"""Lidars of starbot, as overrides; the first is what the others are compared with."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the mounts; see `--help`. Returns the exit code."""
    parser = experiment_parser(
        "lidar_mounts.py",
        "Drive one robot with lidars at several places.",
        ["forest", "maze", "room"],
        Path("out/lidar_mounts"),
    )
    return experiment(parser, measure_mounts, arguments)


def measure_mounts(options: argparse.Namespace) -> Results:
    """Run the trials of each mount, then write the table."""
    options.out.mkdir(parents=True, exist_ok=True)
    model = options.out / "mounted.urdf"
    frames = [f'<frame name="{n}" link="base_link" xyz="{xyz}" rpy="{rpy}"/>' for n, (xyz, rpy) in FRAMES.items()]
    text = read_text(find_model_path("robots", "starbot.urdf"))
    write_text(model, text.replace("</robot>", "\n".join((*frames, "</robot>"))))
    robot = f"robot.model={model.absolute()}"
    variants = {name: ("star", [robot, *overrides]) for name, overrides in MOUNTS.items()}
    return run_experiment(variants, options, "mounts.md", mounts_table)


def mounts_table(results: Results, scenarios: Sequence[str]) -> str:
    """A Markdown table with a row for each mount, compared with the centred lidar."""
    centred, *_ = results.values()
    rows = [
        (
            name,
            *comparison_cells(records, centred, scenarios),
            format_number(min(record["min_clearance_m"] for record in records), 0, 1e3),
        )
        for name, records in results.items()
    ]
    return format_markdown_table(("lidar", *comparison_head(scenarios, "centred"), "least clearance mm"), rows)


if __name__ == "__main__":
    sys.exit(main())
