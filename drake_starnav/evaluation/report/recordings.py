"""Choose trials worth a closer look, run them again and record them beside the report."""

import json
import logging
from collections.abc import Callable, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from drake_starnav.errors import StarnavError
from drake_starnav.evaluation.jobs import NEVER_RAN, Record
from drake_starnav.evaluation.report.results import Results, make_page_name
from drake_starnav.evaluation.trial_file import read_trials
from drake_starnav.evaluation.workers import start_local_processes
from drake_starnav.scenario.schema import Scenario
from drake_starnav.utils.files import read_text


@dataclass(frozen=True)
class Recording:
    """A chosen trial and its recording.

    Attributes:
        record: of the trial.
        reason: why it was chosen.
        file: path of the recording relative to the report; empty without one.
        remark: e.g. why there is no recording.
    """

    record: Record
    reason: str
    file: str = ""
    remark: str = ""


def choose_trials(results: Results) -> list[Recording]:
    """Every failure, and for each scenario and method the median and the worst success by time over shortest path."""
    chosen = []
    for case in results.cases.values():
        chosen += [Recording(r, r["outcome"]) for r in case if r["outcome"] not in ("reached", *NEVER_RAN)]
        reached_records = [r for r in case if r["outcome"] == "reached"]
        reached_records.sort(key=lambda r: r["time_s"] / (r["shortest_path_m"] or 1.0))
        if reached_records:
            chosen.append(Recording(reached_records[(len(reached_records) - 1) // 2], "median success"))
        if len(reached_records) > 1:
            chosen.append(Recording(reached_records[-1], "worst success"))
    return chosen


def read_trial(path: Path, line: int | None = None) -> dict[str, Any]:
    """One trial of a file by `simulate --json` or `benchmark --json`: its record, and as `text` its scenario, if any.

    Raises:
        StarnavError: the file cannot be read, has no trial in this line, from 1, or has several and no line is given.
    """
    try:
        single_trial = json.loads(read_text(path))
    except ValueError:
        single_trial = None
    if isinstance(single_trial, dict) and "cases" not in single_trial:
        if missing := [name for name in ("scenario", "method", "seed") if name not in single_trial]:
            raise StarnavError(f"{path} has no {missing[0]}; allowed: as `simulate --json` writes it")
        return single_trial
    header, records = read_trials(path)
    if line is None and len(records) == 1:
        line = 2
    if line is None or not 2 <= line <= len(records) + 1:
        line_text = "which trial is not said" if line is None else f"there is no trial in line {line}"
        raise StarnavError(f"{path}: {line_text}; allowed: --line 2 to --line {len(records) + 1}")
    chosen = records[line - 2]
    scenario_texts = {(case["scenario"], case["method"]): case["text"] for case in header["cases"]}
    return {**chosen, "text": scenario_texts[chosen["scenario"], chosen["method"]]}


def record_chosen(
    results: Results,
    chosen: Sequence[Recording],
    folder: Path,
    *,
    failures: int,
    jobs: int,
    progress: Callable[[int, int], None] | None = None,
) -> list[Recording]:
    """Run the chosen trials again, on this machine, and record them into a folder; returns them with their files.

    Args:
        results, chosen: with the trials, and as in `choose_trials`.
        folder: for the recordings; it is created.
        failures: most failures to record of each scenario and method.
        progress: called after each trial with the number done and the number of all.
    """
    recordings = list(chosen)
    failure_counts: dict[tuple[str, str], int] = {}
    wanted_trials = {}
    for k, recording in enumerate(chosen):
        key = recording.record["scenario"], recording.record["method"]
        if recording.record["outcome"] != "reached":
            failure_counts[key] = failure_counts.get(key, 0) + 1
        if recording.record["outcome"] == "reached" or failure_counts[key] <= failures:
            wanted_trials[k] = make_page_name(recording.record)
    if not wanted_trials:
        return recordings
    folder.mkdir(parents=True, exist_ok=True)
    with start_local_processes(min(jobs, len(wanted_trials))) as executor:
        futures = {}
        for k, name in wanted_trials.items():
            record = chosen[k].record
            futures[executor.submit(_record_again, results.scenario(record), record, folder / name)] = k
        for done, future in enumerate(as_completed(futures), start=1):
            k = futures[future]
            remark = future.result() if future.exception() is None else "not recorded: a worker process died"
            recorded_file = f"{folder.name}/{wanted_trials[k]}" if (folder / wanted_trials[k]).is_file() else ""
            recordings[k] = replace(chosen[k], file=recorded_file, remark=remark)
            if progress is not None:
                progress(done, len(futures))
    return recordings


def _record_again(scenario: Scenario, record: Record, path: Path) -> str:
    """Run one trial again and record it; returns a remark if its run differs or cannot be recorded."""
    from drake_starnav.simulation.records import make_driven_record  # late: only workers need Drake

    logging.getLogger("drake").setLevel(logging.WARNING)  # Meshcat would log its port for each
    try:
        path.unlink(missing_ok=True)
        driven_again = make_driven_record(scenario, method=record["method"], seed=record["seed"], html=path)
    except StarnavError as error:
        return str(error)
    except Exception as error:  # a failed recording must not end the report
        return f"{type(error).__name__}: {error}"
    if driven_again["state_hash"] != record["state_hash"]:
        return (
            f"not the same run: {driven_again['outcome']} after {driven_again['time_s']:.1f} s with this "
            "version on this machine"
        )
    return ""
