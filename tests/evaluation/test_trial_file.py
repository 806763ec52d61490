"""Files of trials: nothing that is in them gets lost, and nothing gets in that does not belong."""

import dataclasses
import json
import lzma
import os
import re
import resource
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.evaluation import trial_file
from drake_starnav.evaluation.jobs import Case, error_record, make_cases, make_jobs
from drake_starnav.evaluation.trial_file import TrialFile, make_header, read_trials
from drake_starnav.utils.resources import model_path
from drake_starnav.utils.yaml_text import LARGEST_TEXT
from tests.helpers.trials import record

CASES = [Case("forest", "star", "world: !Forest {}\nrobot: {radius: 0.25}\n")]
HEADER = make_header(CASES, seed=3)
RECORDS = [error_record(job, "for the test") for job in make_jobs(CASES, 3, 3)]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "new" / "trials.jsonl"
    with TrialFile(path, HEADER) as file:
        for record in RECORDS:
            file.append(record)
    return path


def test_what_was_appended_is_read_back(path: Path) -> None:
    assert read_trials(path) == (HEADER, RECORDS)
    with TrialFile(path, HEADER, resume=True) as file:
        assert file.records == RECORDS
        assert file.repaired == ""


def test_a_line_is_on_the_disk_when_append_returns(tmp_path: Path) -> None:
    with TrialFile(tmp_path / "trials.jsonl", HEADER) as file:
        file.append(RECORDS[0])
        assert read_trials(file.path) == (HEADER, RECORDS[:1])


def test_every_cut_is_repaired(path: Path) -> None:
    """Wherever a kill cuts the file, whole lines stay, and what is added next is whole too."""
    data = path.read_bytes()
    for size in [*range(0, len(data), 7), *(k + d for k, c in enumerate(data) if c == 10 for d in (0, 1))]:
        path.write_bytes(data[:size])
        whole = max(data[:size].count(b"\n") - 1, 0)
        with TrialFile(path, HEADER, resume=True) as file:
            assert file.records == RECORDS[:whole]
            assert bool(file.repaired) == (size > 0 and not data[:size].endswith(b"\n"))
            for record in RECORDS[whole:]:
                file.append(record)
        assert path.read_bytes() == data


def test_a_header_that_was_cut_off_is_written_again(tmp_path: Path) -> None:
    path = tmp_path / "trials.jsonl"
    path.write_text(json.dumps(HEADER)[:300])
    with TrialFile(path, HEADER, resume=True) as file:
        assert file.repaired == f"{path}: the header was cut off and is written again"
    assert read_trials(path) == (HEADER, [])


@pytest.mark.parametrize("field", ["time_s", "path_length_m", "min_clearance_m", "state_hash", "path", "command"])
@pytest.mark.parametrize("value", ["lost", True, "a text"])
def test_a_trial_that_ran_has_its_figures(tmp_path: Path, field: str, value: object) -> None:
    path, entry = tmp_path / "trials.jsonl", record()
    entry[field] = 5 if value == "a text" and field == "state_hash" else value
    if value == "lost":
        del entry[field]
    path.write_text(json.dumps(HEADER) + "\n" + json.dumps(record()) + "\n")
    assert read_trials(path)[1] == [record()]
    path.write_text(json.dumps(HEADER) + "\n" + json.dumps(entry) + "\n")
    with pytest.raises(StarnavError, match="line 2 is not a trial"):
        read_trials(path)


STEP = record()["command"]


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"time_s": "20"}, 'time_s is "20"; allowed: a finite number'),
        ({"time_s": float("nan")}, "time_s is NaN; allowed: a finite number"),
        ({"path_length_m": float("inf")}, "path_length_m is Infinity; allowed: a finite number"),
        ({"wall_s": 10**400}, r"wall_s is 10+\.\.\.; allowed: a finite number"),
        ({"score": "0.5"}, 'score is "0.5"; allowed: a finite number or null'),
        ({"nodes": "9"}, 'nodes is "9"; allowed: a finite number or null'),
        ({"laps": float("nan")}, "laps is NaN; allowed: a finite number"),
        ({"command": {**STEP, "p50_s": None}}, "command.p50_s is null; allowed: a finite number"),
        ({"plan": {"count": 1, "p50_s": 1.0}}, "it has no plan.p99_s; allowed: a finite number"),
        ({"scan": []}, r"scan is \[\]; allowed: a mapping"),
        ({"path": [[0.0, 1.0, 2.0]]}, r"path is .*; allowed: a list of \[x, y\]"),
        ({"seed": -1}, "seed is -1; allowed: a whole number >= 0"),
        ({"world": "3"}, 'world is "3"; allowed: a whole number >= 0'),
        ({"outcome": "error", "shortest_path_m": "x"}, 'shortest_path_m is "x"; allowed'),
    ],
)
def test_a_record_of_others_is_refused_by_its_field_and_value(tmp_path: Path, fields: dict, words: str) -> None:
    path = tmp_path / "trials.jsonl"
    path.write_text("\n".join(map(json.dumps, (HEADER, record(trial=1), {**record(), **fields}))) + "\n")
    with pytest.raises(StarnavError, match=rf"trials.jsonl line 3 is not a trial: {words}"):
        read_trials(path)


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"versions": {}}, "it has no versions.drake_starnav; allowed: a text"),
        ({"versions": None}, "versions is null; allowed: a mapping"),
        ({"versions": {**HEADER["versions"], "drake": 1}}, "versions.drake is 1; allowed: a text"),
        ({"machine": {}}, "it has no machine.processor; allowed: a text"),
        ({"in_worlds": "no"}, 'in_worlds is "no"; allowed: true or false'),
        ({"cases": [{**vars(CASES[0]), "text": None}]}, r"cases\[0\].text is null; allowed: a text"),
        ({"cases": ["forest"]}, r'cases\[0\] is "forest"; allowed: a mapping'),
    ],
)
def test_a_header_of_others_is_refused_by_its_field_and_value(tmp_path: Path, fields: dict, words: str) -> None:
    path = tmp_path / "trials.jsonl"
    path.write_text(json.dumps({**HEADER, **fields}) + "\n" + json.dumps(record()) + "\n")
    with pytest.raises(StarnavError, match=f"line 1 is not the header of a file of trials: {words}"):
        read_trials(path)


def test_what_was_not_timed_or_found_may_be_null(tmp_path: Path) -> None:
    none = {"count": 0, "mean_s": None, "p50_s": None, "p99_s": None}
    unknown = dict.fromkeys(("shortest_path_m", "straight_line_m", "tightest_gap_m", "min_clearance_m", "score"))
    path, entry = tmp_path / "trials.jsonl", {**record(), **unknown, "plan": none}
    path.write_text(json.dumps(HEADER) + "\n" + json.dumps(entry) + "\n")
    assert read_trials(path) == (HEADER, [entry])


def test_a_trial_that_could_not_run_is_replaced_by_one_that_did(path: Path) -> None:
    again = record(trial=1, seed=RECORDS[1]["seed"])
    with TrialFile(path, HEADER, resume=True) as file:
        file.append(again)
        assert file.records == [RECORDS[0], again, RECORDS[2]]
    assert read_trials(path) == (HEADER, [RECORDS[0], again, RECORDS[2]])
    with path.open("a") as text:
        text.write(json.dumps(RECORDS[1]) + "\n")
    with pytest.raises(StarnavError, match="line 6 repeats a trial"):
        read_trials(path)


def test_a_name_that_is_read_compressed_is_not_written(tmp_path: Path) -> None:
    with pytest.raises(StarnavError, match=r"cannot write .*trials.jsonl.xz: .*does not end in .xz"):
        TrialFile(tmp_path / "trials.jsonl.xz", HEADER)
    assert not list(tmp_path.iterdir())


def test_a_file_is_not_overwritten(path: Path) -> None:
    before = path.read_bytes()
    with pytest.raises(StarnavError, match="not empty; allowed: a new file, or --resume"):
        TrialFile(path, HEADER)
    assert path.read_bytes() == before


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"seed": 4}, "seed 4, now 3"),
        ({"format": 0}, "format 0, now 1"),
        ({"versions": {**HEADER["versions"], "drake_starnav": "0.0.1"}}, "drake_starnav 0.0.1, now"),
        ({"versions": {**HEADER["versions"], "drake": "1.0"}}, "drake 1.0, now"),
        ({"versions": {**HEADER["versions"], "models": "0123"}}, "models 0123, now"),
        (
            {"cases": [vars(CASES[0]), dict(vars(CASES[0]), method="star_paper")]},
            "cases forest star, forest star_paper, now forest star",
        ),
        (
            {"cases": [dict(vars(CASES[0]), text="world: !Forest {}\nrobot: {radius: 0.3}\n")]},
            "other parameters of forest star (robot.radius 0.3 and 0.25)",
        ),
    ],
)
def test_other_settings_are_refused(path: Path, change: dict, words: str) -> None:
    lines = path.read_text().splitlines(keepends=True)
    lines[0] = json.dumps({**HEADER, **change}) + "\n"
    path.write_text("".join(lines) + '{"half')
    before = path.read_bytes()
    with pytest.raises(StarnavError, match=re.escape(words)):
        TrialFile(path, HEADER, resume=True)
    assert path.read_bytes() == before


def test_an_edited_shipped_model_is_noticed(tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "robots").mkdir()
    (tmp_path / "robots" / "starbot.urdf").write_text("<robot/>")
    monkeypatch.setattr(trial_file, "model_path", lambda: tmp_path)
    before = trial_file.models_hash.__wrapped__()
    assert before == trial_file.models_hash.__wrapped__() != HEADER["versions"]["models"]
    (tmp_path / "robots" / "starbot.urdf").write_text("<robot />")
    assert trial_file.models_hash.__wrapped__() != before


@pytest.mark.parametrize("edited", ["yard.yaml", "yard.pgm"])
def test_an_edited_world_of_one_s_own_is_noticed(tmp_path: Path, edited: str) -> None:
    folder = tmp_path / "maps"
    shutil.copytree(model_path("maps"), folder)
    (folder / "studio.pgm").rename(folder / "yard.pgm")
    world = folder / "yard.yaml"
    world.write_text((folder / "studio.yaml").read_text().replace("studio.pgm", "yard.pgm"))
    path, cases = tmp_path / "trials.jsonl", make_cases(["map"], ["star"], [f"world.file={world}"])
    TrialFile(path, make_header(cases, 3)).close()
    TrialFile(path, make_header(cases, 3), resume=True).close()
    with (folder / edited).open("ab") as file:
        file.write(b"\n")
    with pytest.raises(StarnavError, match=f"was written with other content of {folder / edited}; allowed"):
        TrialFile(path, make_header(cases, 3), resume=True)


def test_the_machine_may_change(path: Path) -> None:
    with TrialFile(path, {**HEADER, "machine": {"system": "another", "cores": 1000}}, resume=True) as file:
        assert file.records == RECORDS


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("a letter to somebody", "not a file of trials"),
        ("a letter\nto somebody\n", "line 1 is not the header"),
        ("[]\n", "line 1 is not the header"),
        ('{"format": 1, "of": "somebody else"}', "not a file of trials"),
        (json.dumps({**HEADER, "seed": 4})[:-30], "not a file of trials"),
        (json.dumps({**HEADER, "overrides": 3}) + "\n", "line 1 is not the header"),
        (json.dumps(HEADER) + "\n" + json.dumps({**RECORDS[0], "seed": "x"}) + "\n", "line 2 is not a trial"),
        (json.dumps(HEADER) + "\n" + json.dumps({**RECORDS[0], "outcome": "reached"}) + "\n", "line 2 is not a trial"),
        (
            json.dumps(HEADER) + "\n" + json.dumps({**RECORDS[0], "method": "apf"}) + "\n",
            "line 2 is a trial of forest apf",
        ),
        (json.dumps(HEADER) + "\nnonsense\n" + json.dumps(RECORDS[0]) + "\n", "line 2 is not a trial"),
        (json.dumps(HEADER) + "\n" + 2 * (json.dumps(record()) + "\n"), "line 3 repeats a trial"),
    ],
)
def test_other_files_are_refused_and_kept(tmp_path: Path, content: str, words: str) -> None:
    path = tmp_path / "other.txt"
    path.write_text(content)
    with pytest.raises(StarnavError, match=words):
        TrialFile(path, HEADER, resume=True)
    assert path.read_text() == content


def test_two_writers_are_refused(path: Path) -> None:
    with (
        TrialFile(path, HEADER, resume=True),
        pytest.raises(StarnavError, match="being written by another"),
    ):
        TrialFile(path, HEADER, resume=True)


def test_a_place_that_cannot_be_written_is_reported(tmp_path: Path) -> None:
    for place in (tmp_path, Path("/proc/forbidden/trials.jsonl")):
        with pytest.raises(StarnavError, match=f"cannot write {place}"):
            TrialFile(place, HEADER)
    with pytest.raises(StarnavError, match="cannot read"):
        read_trials(tmp_path / "missing.jsonl")


FULL_DISK = """
import resource, signal, sys
from pathlib import Path
from drake_starnav.evaluation.jobs import make_cases
from drake_starnav.evaluation.trial_file import TrialFile, make_header
from drake_starnav.errors import StarnavError

signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
header = make_header(make_cases(["room"], ["star"]), 5)
try:
    with TrialFile(Path(sys.argv[1]), header) as file:
        resource.setrlimit(resource.RLIMIT_FSIZE, (8192, 8192))
        file.append({"note": "x" * 9000})
except StarnavError as error:
    print(error)
"""


def test_a_full_disk_is_reported_in_one_sentence(tmp_path: Path) -> None:
    command = [sys.executable, "-c", FULL_DISK, str(tmp_path / "trials.jsonl")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(f"cannot write {tmp_path / 'trials.jsonl'}: File too large")


def test_what_a_full_disk_took_of_a_line_is_removed(path: Path) -> None:
    data, more = path.read_bytes(), error_record(make_jobs(CASES, 4, 3)[3], "for the test")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    with TrialFile(path, HEADER, resume=True) as file:
        resource.setrlimit(resource.RLIMIT_FSIZE, (len(data) + 10, before[1]))
        try:
            with pytest.raises(StarnavError, match=f"cannot write {path}: File too large; allowed"):
                file.append(more)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)
        assert path.read_bytes() == data
        file.append(more)
    assert read_trials(path) == (HEADER, [*RECORDS, more])


@pytest.mark.parametrize(
    "damage",
    [
        lambda data: data[:40] + b"\xff" + data[40:], lambda data: b"\n" + data, lambda data: b"[" * 99999 + b"\n",
        lambda data: data.replace(b'"seed": 3', b'"seed": NaN'), lambda data: data.replace(b'"seed"', b'"sed"', 1),
        lambda data: data.replace(b'"trial": 1', b'"trial": ' + b"9" * 9999), lambda data: data.replace(b"\n", b"\r"),
        lambda data: data + data.splitlines(True)[1].replace(b'"error"', b'"reached"'),
        lambda data: data + b"\0" * 4096 + b"\n", lambda data: data.decode().encode("utf-16"),
    ],
)  # fmt: skip
def test_a_damaged_file_is_neither_continued_nor_touched(damage, path: Path) -> None:
    data = damage(path.read_bytes())
    path.write_bytes(data)
    with pytest.raises(StarnavError, match="allowed") as reported:
        TrialFile(path, HEADER, resume=True)
    assert len(str(reported.value)) < 1000 and path.read_bytes() == data


def test_a_compressed_void_is_not_read_to_its_end(tmp_path: Path) -> None:
    path = tmp_path / "trials.jsonl.xz"
    path.write_bytes(lzma.compress(json.dumps(HEADER).encode() + b"\n" + b" " * (LARGEST_TEXT + 1)))
    with pytest.raises(StarnavError, match="cannot read .*: it has a line of more than"):
        read_trials(path)


def test_each_record_is_synchronised_with_the_disk(tmp_path: Path, monkeypatch) -> None:
    sizes: list[int] = []
    monkeypatch.setattr(os, "fsync", lambda handle: sizes.append(os.fstat(handle).st_size))
    with TrialFile(tmp_path / "trials.jsonl", make_header(CASES, 3)) as file:
        for job in make_jobs(CASES, 4, 3):
            file.append(error_record(job, "for the test"))
            assert sizes[-1] == file.path.stat().st_size
    assert len(set(sizes)) == 5  # the header's and the records'


def test_the_hash_of_the_source_is_of_names_and_contents_in_all_folders(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(trial_file, "__file__", str(tmp_path / "benchmark" / "trial_file.py"))
    hashes = []
    for names, content in ((("a", "b"), "x"), (("a", "b"), "y"), (("a", "c"), "y"), (("a/c",), "y"), (("a/d",), "y")):
        for path in tmp_path.rglob("*.py"):
            path.unlink()
        for name in names:
            path = tmp_path / f"{name}.py"
            path.parent.mkdir(exist_ok=True)
            path.write_text(content)
        hashes.append(trial_file.source_hash.__wrapped__())
        (tmp_path / "notes.txt").write_text(str(names))
        assert trial_file.source_hash.__wrapped__() == hashes[-1]
    assert len(set(hashes)) == len(hashes)


def test_of_sections_of_several_lines_only_the_key_is_named(tmp_path: Path) -> None:
    text = "world: !Model\n  directives: |\n    directives:\n    - add_model:\n        name: a\nrobot: {}\n"
    path, case = tmp_path / "trials.jsonl", Case("mine", "star", text)
    TrialFile(path, make_header([case], 3)).close()
    other = dataclasses.replace(case, text=text.replace("name: a", "name: b"))
    with pytest.raises(StarnavError, match=r"other parameters of mine star \(world\.directives\);"):
        TrialFile(path, make_header([other], 3), resume=True)
