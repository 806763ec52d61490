"""Files of trials: a header line that describes the run, then one JSON line for each finished trial."""

import contextlib
import fcntl
import hashlib
import json
import lzma
import os
import platform
import re
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import IO, Any

from drake_starnav.errors import StarnavError
from drake_starnav.evaluation.jobs import Case, Key, Record
from drake_starnav.evaluation.trial_checks import header_fault, record_fault
from drake_starnav.scenario.scenario_file import differences, parse_scenario
from drake_starnav.scenario.schema import KEYS
from drake_starnav.scenario.source_files import source_files
from drake_starnav.utils.files import check_regular, reason_of, unwritable
from drake_starnav.utils.resources import model_path
from drake_starnav.utils.yaml_text import LARGEST_TEXT

PACKED = ".xz"
"""Suffix of compressed files."""
FORMAT = 1
"""Version of the file format, which the header states under the key `format`."""
Header = dict[str, Any]


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
        "format": FORMAT,
        "versions": versions(),
        "machine": {"system": platform.platform(), "processor": processor_name(), "cores": os.cpu_count()},
        "seed": seed,
        "suite": suite,
        "in_worlds": in_worlds,
        "overrides": list(overrides),
        "cases": [dict(vars(case)) for case in cases],
        "files": file_hashes(cases),
        "command": command,
    }


def case_files(case: Case) -> set[Path]:
    """Files that define a case's world and robot; see `source_files`."""
    return source_files(parse_scenario(case.text, name=case.scenario, method=case.method))


def file_hashes(cases: Sequence[Case]) -> dict[str, str]:
    """Hashes of the files that define the worlds and robots of cases, by path; for shipped ones see `models_hash`."""
    shipped = model_path().resolve()
    paths = {path for case in cases for path in case_files(case)}
    return {
        str(path): hashlib.sha256(path.read_bytes()).hexdigest()[:12]
        for path in sorted(paths)
        if not path.is_relative_to(shipped)
    }


def versions() -> dict[str, str]:
    """Versions that a trial's result may depend on; one file holds trials of the same versions only."""
    return {
        "drake_starnav": _version("drake-starnav"),
        "source": source_hash(),
        "models": models_hash(),
        "python": platform.python_version(),
        **{name: _version(name) for name in ("drake", "numpy", "scipy", "shapely", "numba", "scikit-learn")},
    }


@cache
def source_hash() -> str:
    """The first 12 digits of the SHA-256 of the package's code, which changes with every edit."""
    return _folder_hash(Path(__file__).parents[1], "*.py")


@cache
def models_hash() -> str:
    """The corresponding hash of the shipped robots, worlds, maps and scenarios."""
    return _folder_hash(model_path(), "*")


def _folder_hash(folder: Path, pattern: str) -> str:
    digest = hashlib.sha256()
    for path in sorted(path for path in folder.rglob(pattern) if path.is_file()):
        digest.update(path.relative_to(folder).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:12]


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
    """A file of trials that is being written: what has been appended is on the disk, whatever happens next.

    `repaired` is what had to be repaired on opening, as a sentence; empty if nothing.
    """

    def __init__(self, path: Path, header: Header, *, resume: bool = False) -> None:
        """Begin a new file, or if `resume` continue one with this header; see `make_header`.

        Raises:
            StarnavError: the file cannot be written, is in use, holds something and `resume` is false, is not a file
                of trials, or one of other versions or settings. It is left as it was.
        """
        if path.suffix == PACKED:
            raise StarnavError(f"cannot write {path}: files of trials are written as they are; allowed: a name that "
                               f"does not end in {PACKED}, of which only compressed ones are read")  # fmt: skip
        self.path = path
        self.repaired = ""
        self._records: dict[Key, Record] = {}
        try:
            check_regular(path)
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = open(path, "a+b", buffering=0)  # noqa: SIM115 (closed by close)
        except (OSError, ValueError) as error:
            raise unwritable(path, error) from None
        try:
            self._lock()
            self._read(header, resume)
        except BaseException:
            self.close()
            raise

    @property
    def records(self) -> list[Record]:
        """The trials in the file, each once, in the order of their first lines."""
        return list(self._records.values())

    def append(self, record: Record) -> None:
        """Write the record of a finished trial to the disk; it replaces one with the outcome `error`."""
        self._write(record)
        self._records[record_key(record)] = record

    def close(self) -> None:
        """Close the file."""
        with contextlib.suppress(OSError):  # a failed write has been reported already
            self._file.close()

    def __enter__(self) -> "TrialFile":
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def _lock(self) -> None:
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise StarnavError(f"{self.path} is being written by another process; allowed: one at a time") from None
        except OSError:
            pass  # a file system without locks

    def _read(self, header: Header, resume: bool) -> None:
        self._file.seek(0)
        data = self._file.read()
        if not resume and data:
            raise StarnavError(f"{self.path} exists and is not empty; allowed: a new file, or --resume to continue it")
        size = data.rfind(b"\n") + 1
        if size > 0:
            found, records = parse_trials(data[:size].splitlines(), str(self.path))
            self._records = {record_key(record): record for record in records}
            check_same(found, header, str(self.path))
        elif not json.dumps(header).encode().startswith(data):
            raise StarnavError(
                f"{self.path} is not a file of trials; allowed: one written by `starnav benchmark --json`"
            )
        if len(data) > size:
            self._file.truncate(size)
            cut = "the last line was cut off and is removed; its trial runs again"
            self.repaired = f"{self.path}: {cut if size else 'the header was cut off and is written again'}"
        if size == 0:
            self._write(header)

    def _write(self, entry: dict[str, Any]) -> None:
        """Add a line, or nothing: if the disk is full, the written part is removed again."""
        size = os.fstat(self._file.fileno()).st_size
        rest = memoryview(json.dumps(entry, allow_nan=False).encode() + b"\n")
        try:
            while rest:
                rest = rest[self._file.write(rest) :]
            os.fsync(self._file.fileno())
        except OSError as error:
            with contextlib.suppress(OSError):
                self._file.truncate(size)
                if size == 0:
                    self.path.unlink()
            raise unwritable(self.path, error) from None


def read_trials(path: Path) -> tuple[Header, list[Record]]:
    """Header and records of a file, compressed if its name ends in .xz; a truncated last line is ignored.

    Raises:
        StarnavError: the file cannot be read, or is not a file of trials.
    """
    try:
        check_regular(path)
        with lzma.open(path) if path.suffix == PACKED else open(path, "rb") as file:
            header, records = parse_trials(_whole_lines(file), str(path))
    except StarnavError:
        raise
    except (OSError, EOFError, ValueError, lzma.LZMAError) as error:
        raise StarnavError(
            f"cannot read {path}: {reason_of(error)}; allowed: a file written by `starnav benchmark --json`"
        ) from None
    if header["format"] != FORMAT:
        raise StarnavError(f"{path} has format {header['format']}; allowed: {FORMAT}, as this version writes it")
    return header, records


def _whole_lines(file: IO[bytes]) -> Iterator[bytes]:
    """The lines of a file without a truncated last one; raises OSError for a line longer than `LARGEST_TEXT`."""
    while (line := file.readline(LARGEST_TEXT)).endswith(b"\n"):
        yield line
    if len(line) == LARGEST_TEXT:
        raise OSError(f"it has a line of more than {LARGEST_TEXT} bytes")


def parse_trials(lines: Iterable[bytes], place: str) -> tuple[Header, list[Record]]:
    """Header and records of whole lines; `place` names them in the messages of a `StarnavError`.

    A trial with the outcome `error` may have run again: its later line counts.
    """
    entries = []
    for number, line in enumerate(lines, start=1):
        try:
            entry = json.loads(line)
            fault = header_fault(entry) if number == 1 else record_fault(entry)
        except (ValueError, RecursionError):
            fault = "it is not JSON; allowed: a file written by `starnav benchmark --json`"
        if fault:
            what = "the header of a file of trials" if number == 1 else "a trial"
            raise StarnavError(f"{place} line {number} is not {what}: {fault}")
        entries.append(entry)
    if not entries:
        raise StarnavError(f"{place} is empty; allowed: a file written by `starnav benchmark --json`")
    header, *records = entries
    cases = [(case["scenario"], case["method"]) for case in header["cases"]]
    trials: dict[Key, Record] = {}
    for number, record in enumerate(records, start=2):
        if record_key(record)[:2] not in cases:
            names = f"{record['scenario']} {record['method']}"
            known = ", ".join(" ".join(case) for case in cases)
            raise StarnavError(f"{place} line {number} is a trial of {names}; allowed: as its header has, {known}")
        if trials.get(record_key(record), {"outcome": "error"})["outcome"] != "error":
            raise StarnavError(f"{place} line {number} repeats a trial; allowed: each once")
        trials[record_key(record)] = record
    return header, list(trials.values())


def check_same(found: Header, wanted: Header, place: str) -> None:
    """Raise `StarnavError` unless trials of two headers may share a file; the number of trials may differ."""
    ways = ["by world" if header.get("in_worlds") else "by seed" for header in (found, wanted)]
    pairs = [(name, found["versions"].get(name), value) for name, value in wanted["versions"].items()]
    pairs += [(name, found[name], wanted[name]) for name in ("format", "seed")]
    changed = [f"{name} {one}, now {other}" for name, one, other in (*pairs, ("trials", *ways)) if one != other]
    before, now = ({f"{c['scenario']} {c['method']}": c["text"] for c in h["cases"]} for h in (found, wanted))
    if before.keys() != now.keys():
        changed.append(f"cases {', '.join(before)}, now {', '.join(now)}")
    else:
        for name in now:
            if before[name] != now[name]:
                parameters = differences(before[name], now[name], KEYS) or ["names of files"]
                changed.append(f"other parameters of {name} ({', '.join(parameters)})")
    files, wanted_files = found.get("files", {}), wanted["files"]
    changed += [
        f"other content of {name}" for name in {**files, **wanted_files} if files.get(name) != wanted_files.get(name)
    ]
    if changed:
        raise StarnavError(
            f"{place} was written with {'; '.join(changed)}; allowed: --resume with the same, or another file"
        )
