"""Store a run as the project's results, and write the sections of the docs that quote them.

Run: python scripts/maintenance/record_results.py FILE...

Without a file only the texts are written again, from what benchmarks/results holds.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from drake_starnav.cli.options import run_for_exit_code
from drake_starnav.errors import StarnavError
from drake_starnav.evaluation.report.results import Results, read_results
from drake_starnav.evaluation.report.tables import format_tables_markdown
from drake_starnav.evaluation.summary import (
    Summary,
    compare_trials,
    format_markdown_table,
    format_number,
    summarize_records,
)
from drake_starnav.utils.files import replace_file

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "benchmarks" / "results"
SECTION = "results", "python scripts/maintenance/record_results.py"
"""Name of the sections of README and docs/benchmark.md, and the command that writes them."""
README_METHODS = ("star", "dwa", "star_paper")
"""What README compares, in this order: the default, the method most used on robots, the paper's own."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Store files and write the texts, or only compare them; returns the exit code."""
    parser = argparse.ArgumentParser(prog="record_results.py", description=(__doc__ or "").partition(":")[0])
    parser.add_argument("file", nargs="*", type=Path, help="files that benchmark.py --json wrote; they replace the old")
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 if a text is out of date")
    options = parser.parse_args(arguments)
    return run_for_exit_code(parser.prog, lambda: record(options))


def record(options: argparse.Namespace) -> int:
    """Store the files, and write the texts or name those out of date; returns the exit code."""
    if options.file and not options.check:
        store(options.file)
    outdated = {path: text for path, text in texts().items() if stale(path, text)}
    for path, text in outdated.items():
        if options.check:
            print(f"{path.relative_to(ROOT)} is out of date; run {SECTION[1]}", file=sys.stderr)
        else:
            path.write_text(text, encoding="utf-8")
            print(f"wrote {path.relative_to(ROOT)}")
    return 1 if outdated and options.check else 0


def store(files: Sequence[Path]) -> None:
    """Copy files of trials into the folder of results, in place of those that are there.

    Raises:
        StarnavError: they do not belong together, see `read_results`, or share a name.
    """
    read_results(files)
    copies: dict[str, bytes] = {}
    for path in files:
        if path.name in copies:
            raise StarnavError(f"two files are called {path.name}; allowed: different names")
        data = path.read_bytes()
        copies[path.name] = data[: data.rfind(b"\n") + 1]
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name, data in copies.items():
        with replace_file(FOLDER / name) as temporary:
            temporary.write_bytes(data)
    for path in stored():
        if path.name not in copies:
            path.unlink()


def stored() -> list[Path]:
    """The files of trials in the folder of results."""
    return sorted(FOLDER.glob("*.jsonl"))


def texts() -> dict[Path, str]:
    """The content of each file that depends on the results."""
    results = read_results(stored())
    readme, page = ROOT / "README.md", ROOT / "docs" / "benchmark.md"
    return {
        FOLDER / "environment.json": environment(results),
        FOLDER / "summary.md": summary(results),
        readme: with_section(readme.read_text(encoding="utf-8"), *SECTION, readme_section(results)),
        page: with_section(page.read_text(encoding="utf-8"), *SECTION, benchmark_section(results)),
    }


def environment(results: Results) -> str:
    """Commands, versions and machine of the trials, as JSON."""
    kept = ("versions", "machine", "seed", "overrides")
    entries = [
        {"command": command, **{name: header[name] for name in kept}}
        for command, header in zip(results.list_commands(), results.headers, strict=True)
    ]
    return json.dumps(entries, indent=2) + "\n"


def summary(results: Results) -> str:
    """The report's tables as a Markdown page."""
    commands = "\n".join(f"    {command}" for command in results.list_commands())
    return f"# Results of the last full run\n\n{commands}\n\n{format_tables_markdown(results)}\n"


def readme_section(results: Results) -> str:
    """The section of README: a row for each of `README_METHODS` that was run."""
    summaries = {(s.scenario, s.method): s for s in summarize_records(results.records)}
    methods = [method for method in README_METHODS if method in results.methods]
    head = ("method", *(f"{scenario}: reached" for scenario in results.scenarios), "collisions",
            "path / shortest")  # fmt: skip
    return format_markdown_table(head, [_readme_row(method, results.scenarios, summaries) for method in methods])


def benchmark_section(results: Results) -> str:
    """The section of docs/benchmark.md: the commands of the run, and the results of all methods."""
    summaries = {(s.scenario, s.method): s for s in summarize_records(results.records)}
    commands = "\n".join(results.list_commands())
    return "\n\n".join(
        (
            f"On {results.headers[0]['machine']['processor']} by",
            f"```sh\n{commands}\n```",
            f"Mean of time and path length over those of `{results.methods[0]}`, where both reached the goal:",
            _methods_table(results, summaries),
        )
    )


def _readme_row(method: str, scenarios: Sequence[str], summaries: dict[tuple[str, str], Summary]) -> tuple[str, ...]:
    cases = [summaries[scenario, method] for scenario in scenarios if (scenario, method) in summaries]
    counts = {case.scenario: f"{case.reached} of {case.trials}" for case in cases}
    return (
        method,
        *(counts.get(scenario, "-") for scenario in scenarios),
        str(sum(case.failures.get("collision", 0) for case in cases)),
        ", ".join(format_number(case.path_mean, 2) for case in cases),
    )


def _methods_table(results: Results, summaries: dict[tuple[str, str], Summary]) -> str:
    first = [r for r in results.records if r["method"] == results.methods[0]]
    rows = []
    for method in results.methods:
        rates = []
        for scenario in results.scenarios:
            s = summaries.get((scenario, method))
            rates.append(f"{100.0 * s.reached / s.trials:.1f} %" if s and s.trials else "-")
        pair = compare_trials([r for r in results.records if r["method"] == method], first)
        ratios = (format_number(ratio, 1, 100.0) for ratio in (pair.time_ratio, pair.path_ratio))
        rows.append((method, *rates, *ratios))
    head = ("method", *(f"{scenario}: reached" for scenario in results.scenarios), "time, %", "path length, %")
    return format_markdown_table(head, rows)


def with_section(text: str, name: str, command: str, content: str) -> str:
    """A Markdown text with the content of a section, which is enclosed by comments, replaced.

    Raises:
        StarnavError: the text has no such section.
    """
    begin, end = f"<!-- {name}: written by `{command}` -->", f"<!-- end of {name} -->"
    before, found, rest = text.partition(begin)
    _, ended, after = rest.partition(end)
    if not (found and ended):
        raise StarnavError(f"there is no section between {begin} and {end}; allowed: a text that has one")
    return f"{before}{begin}\n\n{content}\n\n{end}{after}"


def stale(path: Path, text: str) -> bool:
    """Whether a file's content differs from a text."""
    return not path.is_file() or path.read_text(encoding="utf-8") != text


if __name__ == "__main__":
    sys.exit(main())
