"""Files of trials: a header line that describes the run, then one JSON line for each finished trial."""

import hashlib
import importlib
import json
import os
import platform
import re
import shutil
import subprocess
from collections.abc import Sequence
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from drake_starnav.errors import StarnavError
from drake_starnav.evaluation.jobs import Case, Key, Record
from drake_starnav.scenario.shipped import METHODS
from drake_starnav.utils.files import explain_read_errors, make_write_error, read_bytes

Header = dict[str, Any]
WORLD_TAG = re.compile(r"^world: !(\S+:\S+)", re.MULTILINE)
"""Of a world of the user's, in the text of a scenario."""
HEADER_KEYS = {"versions", "machine", "seed", "overrides", "cases"}


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
        cases, seed, overrides: see `make_cases` and `derive_trial_seed`.
        suite: name of the suite that the cases belong to; a report then shows its table.
        in_worlds: whether the number of a trial is the number of its world.
        command: that was typed; empty if there was none.
    """
    return {
        "versions": find_versions(),
        "machine": {"system": platform.platform(), "processor": find_processor_name(), "cores": os.cpu_count()},
        "seed": seed,
        "suite": suite,
        "in_worlds": in_worlds,
        "overrides": list(overrides),
        "cases": [dict(vars(case)) for case in cases],
        "code": hash_own_code(cases),
        "command": command,
    }


def find_versions() -> dict[str, str]:
    """Versions that a trial's result may depend on; one file holds trials of the same versions only."""
    return {
        "drake_starnav": _find_version("drake-starnav"),
        "git": find_git_commit(),
        "python": platform.python_version(),
        **{name: _find_version(name) for name in ("drake", "numpy", "scipy", "shapely", "numba", "scikit-learn")},
    }


def hash_own_code(cases: Sequence[Case]) -> dict[str, str]:
    """Return a hash of the file of each module, outside of this package, from which cases have a method or a world."""
    named_modules = [
        name for case in cases for name in (METHODS.get(case.method, case.method), *WORLD_TAG.findall(case.text))
    ]
    functions = {name.__module__ for name in named_modules if callable(name)}
    modules = functions | {name.partition(":")[0] for name in named_modules if isinstance(name, str) and ":" in name}
    own_modules = sorted(name for name in modules if not name.startswith("drake_starnav."))
    files = {name: getattr(importlib.import_module(name), "__file__", None) for name in own_modules}
    return {name: hashlib.sha256(Path(file).read_bytes()).hexdigest()[:16] for name, file in files.items() if file}


@cache
def find_git_commit() -> str:
    """The commit of the checkout, with `-dirty` where files differ from it; empty for an installed wheel."""
    root = Path(__file__).parents[2]
    git_command = ["git", "-C", str(root), "--no-optional-locks", "describe", "--always", "--dirty", "--abbrev=12"]
    if not (root / ".git").exists() or shutil.which("git") is None:
        return ""
    return subprocess.run([*git_command, "--exclude=*"], capture_output=True, text=True, check=False).stdout.strip()


def find_processor_name() -> str:
    """The processor's name from /proc/cpuinfo on Linux, elsewhere from Python's `platform`."""
    try:
        cpu_info = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        cpu_info = ""
    name_match = re.search(r"^model name\s*: (.*)$", cpu_info, re.MULTILINE)
    return name_match[1] if name_match else platform.processor() or platform.machine()


def _find_version(distribution: str) -> str:
    try:
        return version(distribution)
    except PackageNotFoundError:
        return "not installed as a package"


def make_record_key(record: Record) -> Key:
    """Identifies a record within its file."""
    return record["scenario"], record["method"], record["trial"]


class TrialFile:
    """A file of trials that is being written: what has been appended stays, whatever happens to this process."""

    def __init__(self, path: Path, header: Header, *, resume: bool = False) -> None:
        """Begin a new file, or if `resume` continue one with this header; see `make_header`.

        A last line that was cut off is removed.

        Raises:
            StarnavError: the file cannot be written, holds something and `resume` is false, is not a file of trials,
                or one of other versions or settings. It is left as it was.
        """
        self.path, self._records = path, dict[Key, Record]()
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            file_content = path.read_bytes() if path.exists() else b""
            if file_content and not resume:
                raise StarnavError(f"{path} exists and is not empty; allowed: a new file, or --resume to continue it")
            if file_content:
                found_header, records = read_trials(path)
                check_same(found_header, header, str(path))
                self._records = {make_record_key(record): record for record in records}
            self._file = open(path, "ab")  # noqa: SIM115 (closed by close)
            self._file.truncate(file_content.rfind(b"\n") + 1)
        except OSError as error:
            raise make_write_error(path, error) from None
        if not file_content:
            self._write(header)

    @property
    def records(self) -> list[Record]:
        """The trials in the file, each once, in the order of their first lines."""
        return list(self._records.values())

    def append(self, record: Record) -> None:
        """Write the record of a finished trial; it replaces one with the outcome `error`."""
        self._write(record)
        self._records[make_record_key(record)] = record

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
            raise make_write_error(self.path, error) from None


def read_trials(path: Path) -> tuple[Header, list[Record]]:
    """Header and records of a file; a last line that was cut off is ignored.

    A trial with the outcome `error` may have run again: its later line counts.

    Raises:
        StarnavError: the file cannot be read, or is not a file of trials.
    """
    file_name, allowed_text = f"file of trials {path}", "a file written by `starnav benchmark --json`"
    file_content = read_bytes(path, file_name, allowed_text)
    with explain_read_errors(file_name, allowed_text):
        entries = [json.loads(line) for line in file_content.decode().split("\n")[:-1]]
        if not entries or not isinstance(entries[0], dict) or not entries[0].keys() >= HEADER_KEYS:
            raise ValueError("it has no header")
        return entries[0], list({make_record_key(record): record for record in entries[1:]}.values())


def check_same(found: Header, wanted: Header, place: str) -> None:
    """Raise `StarnavError` unless trials of two headers may share a file; the number of trials may differ."""
    compared_values = [(name, found["versions"].get(name), value) for name, value in wanted["versions"].items()]
    compared_values += [(name, found.get(name), wanted[name]) for name in ("seed", "in_worlds", "overrides")]
    case_names = [", ".join(f"{c['scenario']} {c['method']}" for c in header["cases"]) for header in (found, wanted)]
    compared_values.append(("cases", case_names[0], case_names[1]))
    changed_keys = [f"{name} {one}, now {other}" for name, one, other in compared_values if one != other]
    for name, code_hash in wanted["code"].items():
        if (previous_code := found.get("code", {}).get(name)) != code_hash:
            changed_keys.append(f"other code of {name} ({previous_code or 'not noted'}, now {code_hash})")
    if not changed_keys and found["cases"] != wanted["cases"]:
        changed_keys = ["other parameters"]
    if changed_keys:
        raise StarnavError(
            f"{place} was written with {'; '.join(changed_keys)}; allowed: --resume with the same, or another file"
        )
