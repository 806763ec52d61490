"""Drive different robots with different lidars through the same kinds of worlds; nothing but these two is declared.

Run: python scripts/experiments/robots_and_lidars.py --trials 7 --out out/robots_and_lidars
With the lidar elsewhere than on the axis: python scripts/experiments/robots_and_lidars.py --mounts --trials 20
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from drake_starnav.evaluation.summary import markdown_table, number, rate_text
from drake_starnav.scenario.error_budget import error_budget
from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.utils.files import read_text, write_text
from drake_starnav.utils.resources import model_path
from scripts.experiments.experiment import (
    Results,
    comparison_cells,
    comparison_head,
    count,
    experiment,
    experiment_parser,
    of_scenario,
    run_experiment,
)

ROBOT, LIDAR = ("model", "radius", "max_speed", "max_acceleration"), ("beams", "range_max", "rate", "noise")
DECLARED = (
    ("starbot", 0.15, 0.4, 1.0, 90, 3.5, 5.0, 0.01),
    ("starbot", 0.15, 3.0, 3.0, 720, 30.0, 40.0, 0.03),
    ("starbot", 0.2, 0.8, 1.0, 180, 5.0, 10.0, 0.02),
    ("starbot", 0.25, 0.4, 1.0, 180, 10.0, 5.0, 0.03),
    ("starbot", 0.25, 1.5, 2.0, 360, 10.0, 20.0, 0.01),
    ("starbot", 0.25, 3.0, 3.0, 720, 30.0, 40.0, 0.001),
    ("starbot", 0.35, 0.8, 1.0, 360, 3.5, 10.0, 0.02),
    ("jackal", 0.334, 0.8, 1.0, 180, 30.0, 20.0, 0.001),
    ("jackal", 0.334, 1.5, 2.0, 720, 10.0, 40.0, 0.03),
    ("jackal", 0.5, 1.5, 2.0, 360, 30.0, 20.0, 0.001),
)  # fmt: skip
"""Robots and their lidars: the values of ROBOT and LIDAR."""

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
    """Run the combinations; see `--help`. Returns the exit code."""
    parser = experiment_parser(
        "robots_and_lidars.py",
        "Drive different robots with different lidars.",
        ["forest", "maze", "room"],
        Path("out/robots_and_lidars"),
    )
    parser.add_argument("--mounts", action="store_true", help="one robot whose lidars are elsewhere than on its axis")
    return experiment(parser, lambda options: (measure_mounts if options.mounts else measure)(options), arguments)


def measure_mounts(options: argparse.Namespace) -> Results:
    """Run the trials of each mount, then write the table."""
    options.out.mkdir(parents=True, exist_ok=True)
    model = options.out / "mounted.urdf"
    frames = [f'<frame name="{n}" link="base_link" xyz="{xyz}" rpy="{rpy}"/>' for n, (xyz, rpy) in FRAMES.items()]
    text = read_text(model_path("robots", "starbot.urdf"))
    write_text(model, text.replace("</robot>", "\n".join((*frames, "</robot>"))))
    robot = f"robot.model={model.absolute()}"
    variants = {name: ("star", [robot, *overrides]) for name, overrides in MOUNTS.items()}
    return run_experiment(variants, options, {"mounts.md": mounts_table})


def mounts_table(results: Results, scenarios: Sequence[str]) -> str:
    """A Markdown table with a row for each mount, compared with the centred lidar."""
    centred, *_ = results.values()
    rows = [
        (
            name,
            *comparison_cells(records, centred, scenarios),
            number(min(record["min_clearance_m"] for record in records), 0, 1e3),
        )
        for name, records in results.items()
    ]
    return markdown_table(("lidar", *comparison_head(scenarios, "centred"), "least clearance mm"), rows)


def measure(options: argparse.Namespace) -> Results:
    """Run the trials, one file for each combination, then write the table."""
    keys = [*(f"robot.{key}" for key in ROBOT), *(f"lidar.{key}" for key in LIDAR)]
    variants = {
        " ".join(map(str, values)): ("star", [f"{key}={value}" for key, value in zip(keys, values, strict=True)])
        for values in DECLARED
    }
    margins = {
        name: error_budget(load_scenario(options.scenario[0], overrides=overrides)).total
        for name, (_, overrides) in variants.items()
    }
    return run_experiment(
        variants, options, {"robots_and_lidars.md": lambda results, scenarios: table(results, scenarios, margins)}
    )


def table(results: Results, scenarios: Sequence[str], margins: dict[str, float]) -> str:
    """A Markdown table with a row for each combination."""
    rows = []
    for name, records in results.items():
        reached = [record for record in records if record["outcome"] == "reached"]
        least = min((record["min_clearance_m"] for record in reached), default=None)
        speeds = [
            f"{sum(r['mean_speed_mps'] for r in trials) / len(trials):.2f}" if trials else "-"
            for trials in (of_scenario(reached, scenario) for scenario in scenarios)
        ]
        rows.append(
            (
                *name.split(" "),
                f"{1e3 * margins[name]:.0f}",
                rate_text(len(reached), len(records)),
                str(count(records, "collision")),
                number(least, 0, 1e3),
                *speeds,
            )
        )
    head = ("model", "radius m", "max_speed m/s", "max_acceleration", "beams", "range m", "rate Hz", "noise m")
    return markdown_table(
        (*head, "margin mm", "reached (95 %)", "collisions", "least clearance mm", *(f"{s}: m/s" for s in scenarios)),
        rows,
    )


if __name__ == "__main__":
    sys.exit(main())
