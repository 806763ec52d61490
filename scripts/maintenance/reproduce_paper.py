"""Drive Table I of arXiv 2403.11484, print it, and on request write what the docs say of it.

Run: python scripts/maintenance/reproduce_paper.py [--trials 30] [--jobs 2] [--record | --check]

Trials are kept in out/paper, a file for each method, so that a run that was interrupted goes on; delete the folder if
the code has changed since. With --record they become the project's results: they are stored in
benchmarks/results/paper, and the sections of README and docs/paper.md, environment and pictures are written from them
alone, but for Fig. 5 and 7, which are measured and driven anew. Without it the checkout stays as it is.
"""

import argparse
import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from drake_starnav.cli.benchmark import benchmark
from drake_starnav.cli.options import NOT_REACHED, REACHED, run_for_exit_code
from drake_starnav.evaluation.report.results import Results, read_results
from drake_starnav.evaluation.suites import SUITES, make_suite_table
from drake_starnav.evaluation.summary import compare_trials, format_markdown_table, format_number, summarize_records
from drake_starnav.evaluation.trial_file import read_trials
from drake_starnav.utils.files import replace_file
from scripts.experiments.ablate_segments import segments_table
from scripts.maintenance.paper_figures import draw_figures
from scripts.maintenance.record_results import environment, stale, with_section

ROOT = Path(__file__).parents[2]
FOLDER, OUT = ROOT / "benchmarks" / "results" / "paper", ROOT / "out" / "paper"
PICTURES = ROOT / "docs" / "images" / "paper"
SUITE = SUITES["table1"]
SECTION = "table1", "python scripts/maintenance/reproduce_paper.py"
"""Name of the sections of README and docs/paper.md, and the command that writes them."""
SEGMENTS = "segments", SECTION[1]
"""The other section of docs/paper.md."""
WORLDS = {"paper_forest": "forest", "paper_maze": "maze"}
"""Scenarios, and what the paper calls their worlds."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Drive, print and write, or only compare; returns the exit code."""
    parser = argparse.ArgumentParser(prog="reproduce_paper.py", description=(__doc__ or "").partition(":")[0])
    parser.add_argument("--trials", type=int, default=30, help="of each method in each world (default: 30)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes (default: one for each core)")
    parser.add_argument("--record", action="store_true", help="make the trials the project's results")
    parser.add_argument("--check", action="store_true", help="drive nothing; exit 1 if a text is out of date")
    options = parser.parse_args(arguments)
    return run_for_exit_code(parser.prog, lambda: check() if options.check else reproduce(options))


def reproduce(options: argparse.Namespace) -> int:
    """Drive what is missing, print the table, and write what was asked for; returns the exit code."""
    for method in SUITE.methods:
        print(f"{method}: {options.trials} trials in {' and '.join(SUITE.scenarios)}", flush=True)
        words = ["--suite", "table1", "--method", method, "--trials", str(options.trials), "--jobs", str(options.jobs)]
        if failed := benchmark([*words, "--json", str(OUT / f"{method}.jsonl"), "--resume", "--quiet"]):
            return failed
    results = read_results(files(OUT))
    print(table(results))
    if options.record:
        store(options.trials)
        draw_figures(read_results(files(FOLDER)), PICTURES)
        (FOLDER / "segments.md").write_text(segments_table(scans=100, seed=0) + "\n", encoding="utf-8")
        for path, text in texts().items():
            path.write_text(text, encoding="utf-8")
        print(f"wrote {', '.join(str(path.relative_to(ROOT)) for path in (FOLDER, PICTURES, *texts()))}")
    return REACHED


def check() -> int:
    """Name the texts that are out of date; returns the exit code."""
    outdated = [path for path, text in texts().items() if stale(path, text)]
    for path in outdated:
        print(f"{path.relative_to(ROOT)} is out of date; run {SECTION[1]} --record", file=sys.stderr)
    return NOT_REACHED if outdated else REACHED


def files(folder: Path) -> list[Path]:
    """The files of trials in a folder, in the order of the methods of Table I."""
    return [path for method in SUITE.methods if (path := folder / f"{method}.jsonl").is_file()]


def store(trials: int) -> None:
    """Copy the first trials of each method into the folder of results, or as many as there are."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    for path in files(OUT):
        header, records = read_trials(path)
        kept = [header, *(record for record in records if record["trial"] < trials)]
        with replace_file(FOLDER / path.name) as temporary:
            temporary.write_text("".join(json.dumps(entry) + "\n" for entry in kept), encoding="utf-8")


def texts() -> dict[Path, str]:
    """The content of each file that depends on the results."""
    results = read_results(files(FOLDER))
    readme, page = ROOT / "README.md", ROOT / "docs" / "paper.md"
    text = with_section(page.read_text(encoding="utf-8"), *SECTION, table(results))
    return {
        FOLDER / "environment.json": environment(results),
        readme: with_section(readme.read_text(encoding="utf-8"), *SECTION, short_table(results)),
        page: with_section(text, *SEGMENTS, (FOLDER / "segments.md").read_text(encoding="utf-8").rstrip()),
    }


def table(results: Results) -> str:
    """Table I with all figures, Markdown."""
    return format_markdown_table(*make_suite_table(SUITE, results.records))


def short_table(results: Results) -> str:
    """Success in both worlds beside the published rate, and times and paths to those of `star`, Markdown."""
    found = {(s.scenario, s.method): s for s in summarize_records(results.records)}
    rows = []
    for method in results.methods:
        cells = []
        for scenario in (name for name in WORLDS if name in results.scenarios):
            case, paper = found.get((scenario, method)), SUITE.published.get((scenario, method))
            ran = case is not None and case.trials > 0
            ratio = compare_trials(results.of(scenario, method), results.of(scenario, "star"))
            cells += [
                f"{case.reached} of {case.trials}" if case is not None and ran else "-",
                format_number(paper.success_percent if paper else None, 1),
                f"{format_number(ratio.time_ratio, 0, 100.0)} / {format_number(ratio.path_ratio, 0, 100.0)}",
            ]
        rows.append((method, *cells))
    head = [
        text
        for name in WORLDS
        if name in results.scenarios
        for text in (f"{WORLDS[name]}: reached", "paper, %", "TTR / PLR to star, %")
    ]
    return format_markdown_table(("method", *head), rows)


if __name__ == "__main__":
    sys.exit(main())
