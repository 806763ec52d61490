"""What faults of sensing and drive cost: python scripts/fault_table.py --trials 50 --out out/faults"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from drake_starnav.benchmark import TrialFile, compare, make_cases, make_header, run_batch
from drake_starnav.benchmark.jobs import Record
from drake_starnav.benchmark.summary import markdown_table, number, rate_text
from drake_starnav.benchmark_command import add_batch_options, check_batch_options, chosen_pool
from drake_starnav.console import BAD_INPUT, INTERRUPTED
from drake_starnav.errors import StarnavError
from drake_starnav.files import check_writable, write_text
from drake_starnav.parameters import unknown_name


@dataclass(frozen=True)
class Row:
    """One row: a name, also that of its file of trials, and the "section.key=value" texts that make it."""

    name: str
    overrides: tuple[str, ...] = ()


LEVELS = {
    "lidar.noise": (0.02, 0.03, 0.05),
    "lidar.dropout": (0.1, 0.2, 0.4),
    "lidar.outliers": (0.01, 0.02, 0.05),
    "lidar.delay": (0.05, 0.1, 0.2),
    "lidar.scan_loss": (0.1, 0.3, 0.5),
    "localization.drift": (0.01, 0.02, 0.05),
    "localization.jump": (0.05, 0.1, 0.2),
    "drive.delay": (0.02, 0.05, 0.1),
    "drive.slip": (0.02, 0.05, 0.1),
    "robot.mass_error": (-0.2, 0.2, 0.5),
}
"""Each fault alone at three levels."""
TOGETHER = Row(
    "all_moderate",
    (
        "lidar.noise=0.02",
        "lidar.dropout=0.1",
        "lidar.outliers=0.01",
        "lidar.delay=0.05",
        "lidar.scan_loss=0.05",
        "localization.drift=0.01",
        "drive.delay=0.02",
        "drive.slip=0.02",
        "robot.mass_error=0.1",
    ),
)
ROWS = (
    Row("none"),
    *(Row(f"{key}_{level:g}", (f"{key}={level:g}",)) for key, row in LEVELS.items() for level in row),
    TOGETHER,
)
Results = list[tuple[Row, list[Record]]]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the table; see `--help`. Returns the exit code."""
    parser = argparse.ArgumentParser(prog="fault_table.py", description="Measure what faults cost.")
    parser.add_argument("scenario", nargs="*", default=["forest", "maze", "room"], help="default: forest maze room")
    names = [row.name for row in ROWS]
    parser.add_argument("--rows", nargs="+", default=names, metavar="ROW", help=f"of {', '.join(names)} (default: all)")
    parser.add_argument("--out", type=Path, default=Path("out/faults"), metavar="FOLDER", help="default: out/faults")
    add_batch_options(parser)
    options = parser.parse_args(arguments)
    try:
        return measure_faults(options)
    except StarnavError as error:
        print(f"{parser.prog}: {error}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        print(f"{parser.prog}: interrupted; what has run is in {options.out}, --resume goes on", file=sys.stderr)
        return INTERRUPTED


def measure_faults(options: argparse.Namespace) -> int:
    """Run the rows, one file of trials each, then write the table."""
    check_batch_options(options)
    table = options.out / "faults.md"
    check_writable(table)
    known = {row.name: row for row in ROWS}
    for name in options.rows:
        if name not in known:
            raise unknown_name(f"row {name!r}", name, known)
    results: Results = []
    names: list[str] = []
    with chosen_pool(options) as pool:
        for row in (row for row in ROWS if row.name in options.rows or not row.overrides):
            cases = make_cases(options.scenario, ["star"], row.overrides)
            names = [case.scenario for case in cases]
            header = make_header(cases, options.seed, row.overrides)
            with TrialFile(options.out / f"{row.name}.jsonl", header, resume=options.resume) as file:
                if file.repaired:
                    print(file.repaired, file=sys.stderr)
                records = run_batch(
                    cases, trials=options.trials, seed=options.seed, pool=pool, file=file, quiet=options.quiet,
                    title=row.name,
                )  # fmt: skip
            results.append((row, records))
    text = fault_table(results, names)
    write_text(table, text + "\n")
    if not options.quiet:
        print(text)
        print(f"wrote {table} and a file of trials for each row")
    return 0


def fault_table(results: Results, scenarios: Sequence[str]) -> str:
    """A Markdown table with a row for each fault; times are compared with the first row's, where both reached."""
    rows = []
    for row, records in results:
        cells = [", ".join(row.overrides) or "none"]
        for scenario in scenarios:
            trials = [record for record in records if record["scenario"] == scenario]
            before = [record for record in results[0][1] if record["scenario"] == scenario]
            ended = [record["outcome"] for record in trials]
            cells += [
                rate_text(ended.count("reached"), len(trials)),
                str(ended.count("collision")),
                number(compare(trials, before).time_ratio, 2),
            ]
        rows.append(tuple(cells))
    head = ["faults"]
    for scenario in scenarios:
        head += [f"{scenario}: reached (95 %)", "collisions", f"time / {results[0][0].name}"]
    return markdown_table(tuple(head), rows)


if __name__ == "__main__":
    sys.exit(main())
