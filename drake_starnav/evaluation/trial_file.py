"""Files of trials: a header line that describes the run, then one JSON line for each finished trial."""

import contextlib
import json
import os
import platform
import re
import subprocess
from collections.abc import Iterable, Sequence
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from drake_starnav.errors import StarnavError
from drake_starnav.evaluation.jobs import NEVER_RAN, Case, Key, Record
from drake_starnav.scenario.scenario_file import differences
from drake_starnav.scenario.schema import KEYS
from drake_starnav.utils.files import check_regular, reason_of, unwritable
from drake_starnav.utils.stopwatch import STEPS

Header = dict[str, Any]
HEADER_KEYS = ("versions", "machine", "seed", "overrides", "cases")
RECORD_KEYS = ("scenario", "method", "trial", "seed", "outcome")
RUN_KEYS = (
    "time_s", "path_length_m", "shortest_path_m", "straight_line_m", "tightest_gap_m", "min_clearance_m", "wall_s",
    "state_hash", "path", *STEPS,
)  # fmt: skip
"""What a trial that ran has besides `RECORD_KEYS`."""


def make_header(
    cases: Sequence[Case],
    seed: int,
    overrides: Sequence[str] = (),
    *,
    suite: str | None = None,
    in_worlds: bool = False,
    command: str = "",
) -> Header:
    """The header of a file: the versions that ran its trials, and everything that defines them.

    Args:
        cases, seed, overrides: see `make_cases` and `trial_seed`.
        suite: name of the suite that the cases belong to; a report then shows its table.
        in_worlds: whether the number of a trial is the number of its world.
        command: that was typed; empty if there was none.
    """
    return {
        "versions": versions(),
        "machine": {"system": platform.platform(), "processor": processor_name(), "cores": os.cpu_count()},
        "seed": seed,
        "suite": suite,
        "in_worlds": in_worlds,
        "overrides": list(overrides),
        "cases": [dict(vars(case)) for case in cases],
        "command": command,
    }


def versions() -> dict[str, str]:
    """Versions that a trial's result may depend on; one file holds trials of the same versions only."""
    return {
        "drake_starnav": _version("drake-starnav"),
        "git": git_commit(),
        "python": platform.python_version(),
        **{name: _version(name) for name in ("drake", "numpy", "scipy", "shapely", "numba", "scikit-learn")},
    }


@cache
def git_commit() -> str:
    """The commit of the checkout, with `-dirty` where files differ from it; empty for an installed wheel."""
    root = Path(__file__).parents[2]
    command = [
        "git",
        "-C",
        str(root),
        "--no-optional-locks",
        "describe",
        "--always",
        "--dirty",
        "--abbrev=12",
        "--exclude=*",
    ]
    try:
        return (
            subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip()
            if (root / ".git").exists()
            else ""
        )
    except OSError:  # there is no git
        return ""


def processor_name() -> str:
    """The processor's name from /proc/cpuinfo on Linux, elsewhere from Python's `platform`."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        text = ""
    name = re.search(r"^model name\s*: (.*)$", text, re.MULTILINE)
    return name[1] if name else platform.processor() or platform.machine()


def _version(distribution: str) -> str:
    try:
        return version(distribution)
    except PackageNotFoundError:
        return "not installed as a package"


def record_key(record: Record) -> Key:
    """Identifies a record within its file."""
    return record["scenario"], record["method"], record["trial"]


class TrialFile:
    """A file of trials that is being written: what has been appended stays, whatever happens to this process.

    `repaired` is what had to be repaired on opening, as a sentence; empty if nothing.
    """

    def __init__(self, path: Path, header: Header, *, resume: bool = False) -> None:
        """Begin a new file, or if `resume` continue one with this header; see `make_header`.

        Raises:
            StarnavError: the file cannot be written, holds something and `resume` is false, is not a file of trials,
                or one of other versions or settings. It is left as it was.
        """
        self.path, self.repaired = path, ""
        self._records: dict[Key, Record] = {}
        try:
            check_regular(path)
            path.parent.mkdir(parents=True, exist_ok=True)
            data = path.read_bytes() if path.exists() else b""
            if data and not resume:
                raise StarnavError(f"{path} exists and is not empty; allowed: a new file, or --resume to continue it")
            whole = data[: data.rfind(b"\n") + 1]
            if data:
                found, records = parse_trials(whole.splitlines(), str(path))
                check_same(found, header, str(path))
                self._records = {record_key(record): record for record in records}
            self._file = open(path, "ab")  # noqa: SIM115 (closed by close)
            if whole != data:
                self._file.truncate(len(whole))
                self.repaired = f"{path}: the last line was cut off and is removed; its trial runs again"
            if not data:
                try:
                    self._write(header)
                except StarnavError:  # the disk is full
                    path.unlink()
                    raise
        except (OSError, ValueError) as error:
            raise unwritable(path, error) from None

    @property
    def records(self) -> list[Record]:
        """The trials in the file, each once, in the order of their first lines."""
        return list(self._records.values())

    def append(self, record: Record) -> None:
        """Write the record of a finished trial; it replaces one with the outcome `error`."""
        self._write(record)
        self._records[record_key(record)] = record

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def __enter__(self) -> "TrialFile":
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def _write(self, entry: dict[str, Any]) -> None:
        try:
            self._file.write(json.dumps(entry, allow_nan=False).encode() + b"\n")
            self._file.flush()
        except OSError as error:
            with contextlib.suppress(OSError):  # what is still in its buffer has no room either
                self._file.close()
            raise unwritable(self.path, error) from None


def read_trials(path: Path) -> tuple[Header, list[Record]]:
    """Header and records of a file; a truncated last line is ignored.

    Raises:
        StarnavError: the file cannot be read, or is not a file of trials.
    """
    try:
        check_regular(path)
        with open(path, "rb") as file:
            return parse_trials((line for line in file if line.endswith(b"\n")), str(path))
    except StarnavError:
        raise
    except (OSError, ValueError) as error:
        raise StarnavError(
            f"cannot read {path}: {reason_of(error)}; allowed: a file written by `starnav benchmark --json`"
        ) from None


def parse_trials(lines: Iterable[bytes], place: str) -> tuple[Header, list[Record]]:
    """Header and records of whole lines; `place` names them in the messages of a `StarnavError`.

    A trial with the outcome `error` may have run again: its later line counts.
    """
    header: Header | None = None
    cases: list[tuple[str, str]] = []
    trials: dict[Key, Record] = {}
    for number, line in enumerate(lines, start=1):
        if header is None:
            header = _entry(line, HEADER_KEYS, f"{place} line {number} is not the header of a file of trials")
            cases = [(case["scenario"], case["method"]) for case in header["cases"]]
            continue
        record = _entry(line, RECORD_KEYS, f"{place} line {number} is not a trial")
        if record_key(record)[:2] not in cases:
            names, known = f"{record['scenario']} {record['method']}", ", ".join(" ".join(case) for case in cases)
            raise StarnavError(f"{place} line {number} is a trial of {names}; allowed: as its header has, {known}")
        if trials.get(record_key(record), {"outcome": "error"})["outcome"] != "error":
            raise StarnavError(f"{place} line {number} repeats a trial; allowed: each once")
        trials[record_key(record)] = record
    if header is None:
        raise StarnavError(f"{place} is not a file of trials; allowed: one written by `starnav benchmark --json`")
    return header, list(trials.values())


def _entry(line: bytes, keys: Sequence[str], fault: str) -> dict[str, Any]:
    """The mapping in a line, with these keys, and as the record of a trial that ran, with all figures."""
    try:
        entry = json.loads(line)
    except (ValueError, RecursionError):
        entry = None
    if not isinstance(entry, dict):
        raise StarnavError(f"{fault}: it is not a mapping in JSON; allowed: as `starnav benchmark --json` writes it")
    ran = "outcome" in entry and entry["outcome"] not in NEVER_RAN
    lacking = [key for key in (*keys, *(RUN_KEYS if ran else ())) if key not in entry]
    if lacking:
        raise StarnavError(f"{fault}: it has no {lacking[0]}; allowed: as `starnav benchmark --json` writes it")
    return entry


def check_same(found: Header, wanted: Header, place: str) -> None:
    """Raise `StarnavError` unless trials of two headers may share a file; the number of trials may differ."""
    ways = ["by world" if header.get("in_worlds") else "by seed" for header in (found, wanted)]
    pairs = [(name, found["versions"].get(name), value) for name, value in wanted["versions"].items()]
    pairs += [("seed", found["seed"], wanted["seed"]), ("trials", ways[0], ways[1])]
    changed = [f"{name} {one}, now {other}" for name, one, other in pairs if one != other]
    before, now = ({f"{c['scenario']} {c['method']}": c["text"] for c in h["cases"]} for h in (found, wanted))
    if before.keys() != now.keys():
        changed.append(f"cases {', '.join(before)}, now {', '.join(now)}")
    else:
        for name in now:
            if before[name] != now[name]:
                parameters = differences(before[name], now[name], KEYS) or ["names of files"]
                changed.append(f"other parameters of {name} ({', '.join(parameters)})")
    if changed:
        raise StarnavError(
            f"{place} was written with {'; '.join(changed)}; allowed: --resume with the same, or another file"
        )
