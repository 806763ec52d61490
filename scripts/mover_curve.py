"""What caution costs among obstacles that move: python scripts/mover_curve.py --trials 20 --out out/movers"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from drake_starnav.benchmark import TrialFile, make_cases, make_header, run_batch
from drake_starnav.benchmark.jobs import Record
from drake_starnav.benchmark.summary import markdown_table, number, rate_text
from drake_starnav.benchmark_command import add_batch_options, check_batch_options, chosen_pool
from drake_starnav.console import BAD_INPUT, INTERRUPTED
from drake_starnav.errors import StarnavError
from drake_starnav.files import check_writable, write_text
from drake_starnav.report.figures import new_figure, svg

CAUTIONS = (1.0, 0.75, 0.5, 0.25, 0.0)
BLIND = "movers.max_speed=0"
"""The method for worlds that stand still, to compare with."""
OUTCOMES = ("collision", "struck", "timeout", "unreachable")
Results = dict[str, list[Record]]
"""Trials by the override that they were run with."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the curve; see `--help`. Returns the exit code."""
    parser = argparse.ArgumentParser(prog="mover_curve.py", description="Measure what caution costs.")
    default = ["crowd_room", "crowd_hall"]
    parser.add_argument("scenario", nargs="*", default=default, help=f"default: {' '.join(default)}")
    parser.add_argument(
        "--cautions", nargs="+", type=float, default=CAUTIONS, metavar="C", help="from 0 to 1 (default: five of them)"
    )
    parser.add_argument(
        "--set", action="append", default=[], dest="overrides", metavar="KEY=VALUE", help="change the scenarios"
    )
    parser.add_argument("--out", type=Path, default=Path("out/movers"), metavar="FOLDER", help="default: out/movers")
    add_batch_options(parser)
    options = parser.parse_args(arguments)
    try:
        return measure_curve(options)
    except StarnavError as error:
        print(f"{parser.prog}: {error}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        print(f"{parser.prog}: interrupted; what has run is in {options.out}, --resume goes on", file=sys.stderr)
        return INTERRUPTED


def measure_curve(options: argparse.Namespace) -> int:
    """Run the trials, one file for each caution, then write the table and draw the curve."""
    check_batch_options(options)
    table, figure = options.out / "movers.md", options.out / "movers.svg"
    check_writable(table)
    results: Results = {}
    names: list[str] = []
    with chosen_pool(options) as pool:
        for key in (BLIND, *(f"movers.caution={caution:g}" for caution in options.cautions)):
            overrides = (*options.overrides, key)
            cases = make_cases(options.scenario, ["star"], overrides)
            names = [case.scenario for case in cases]
            header = make_header(cases, options.seed, overrides)
            with TrialFile(options.out / f"{key}.jsonl", header, resume=options.resume) as file:
                if file.repaired:
                    print(file.repaired, file=sys.stderr)
                results[key] = run_batch(
                    cases, trials=options.trials, seed=options.seed, pool=pool, file=file, quiet=options.quiet,
                    title=key,
                )  # fmt: skip
    text = curve_table(results, names)
    write_text(table, text + "\n")
    write_text(figure, curve_figure(results, names))
    if not options.quiet:
        print(text)
        print(f"wrote {table}, {figure} and a file of trials for each row")
    return 0


def trials_of(results: Results, key: str, scenario: str) -> list[Record]:
    """The trials of one row in one scenario."""
    return [record for record in results[key] if record["scenario"] == scenario]


def curve_table(results: Results, scenarios: Sequence[str]) -> str:
    """A Markdown table with a row for each caution and scenario."""
    rows = []
    for scenario in scenarios:
        for key in results:
            trials = trials_of(results, key, scenario)
            ended = [record["outcome"] for record in trials]
            times = [record["time_s"] for record in trials if record["outcome"] == "reached"]
            counts = [str(ended.count(outcome)) for outcome in OUTCOMES]
            mean = number(sum(times) / len(times), 1) if times else "-"
            rows.append((scenario, key, rate_text(ended.count("reached"), len(trials)), *counts, mean))
    return markdown_table(("scenario", "setting", "reached (95 %)", *OUTCOMES, "mean time s"), rows)


def curve_figure(results: Results, scenarios: Sequence[str]) -> str:
    """Shares of trials that reached the goal and that collided over the caution, as SVG."""
    figure = new_figure(3.0)
    axes = figure.subplots()
    cautions = {float(key.partition("=")[2]): key for key in results if key != BLIND}
    for scenario in scenarios:
        shares = {}
        for outcome in ("reached", "collision"):
            trials = [[record["outcome"] for record in trials_of(results, key, scenario)] for key in cautions.values()]
            shares[outcome] = [100.0 * ended.count(outcome) / len(ended) for ended in trials]
        (line,) = axes.plot(list(cautions), shares["reached"], "o-", label=f"{scenario}: reached")
        axes.plot(list(cautions), shares["collision"], "x--", color=line.get_color(), label=f"{scenario}: collision")
    axes.set(xlabel="movers.caution", ylabel="% of trials", ylim=(-2.0, 102.0))
    axes.legend(fontsize="small")
    return svg(figure)


if __name__ == "__main__":
    sys.exit(main())
