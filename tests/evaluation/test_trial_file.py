"""Files of trials: nothing that is in them gets lost, and nothing gets in that does not belong."""

import json
import re
from pathlib import Path

import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.evaluation.jobs import Case, make_error_record, make_jobs
from drake_starnav.evaluation.trial_file import TrialFile, make_header, read_trials
from tests.helpers.trials import record

CASES = [Case("forest", "star", "world: !Forest {}\nrobot: {radius: 0.25}\n")]
HEADER = make_header(CASES, seed=3)
RECORDS = [make_error_record(job, "for the test") for job in make_jobs(CASES, 3, 3)]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "new" / "trials.jsonl"
    with TrialFile(path, HEADER) as file:
        for each in RECORDS:
            file.append(each)
            assert read_trials(path)[1][-1] == each  # it is there at once
    return path


def test_what_was_appended_is_read_back_and_continued(path: Path) -> None:
    assert read_trials(path) == (HEADER, RECORDS)
    with TrialFile(path, {**HEADER, "machine": {"system": "another"}}, resume=True) as file:
        assert file.records == RECORDS


def test_wherever_a_kill_cuts_a_line_whole_lines_stay(path: Path) -> None:
    data = path.read_bytes()
    for size in [*range(data.index(b"\n") + 1, len(data), 97), len(data) - 1]:
        path.write_bytes(data[:size])
        whole = data[:size].count(b"\n") - 1
        with TrialFile(path, HEADER, resume=True) as file:
            assert file.records == RECORDS[:whole]
            for each in RECORDS[whole:]:
                file.append(each)
        assert path.read_bytes() == data


def test_a_trial_that_could_not_run_is_replaced_by_one_that_did(path: Path) -> None:
    again = record(trial=1, seed=RECORDS[1]["seed"])
    with TrialFile(path, HEADER, resume=True) as file:
        file.append(again)
        assert file.records == [RECORDS[0], again, RECORDS[2]]
    assert read_trials(path) == (HEADER, [RECORDS[0], again, RECORDS[2]])


def test_a_file_is_not_overwritten(path: Path) -> None:
    before = path.read_bytes()
    with pytest.raises(StarnavError, match="not empty; allowed: a new file, or --resume"):
        TrialFile(path, HEADER)
    assert path.read_bytes() == before


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"seed": 4}, "seed 4, now 3"),
        ({"overrides": ["robot.radius=0.3"]}, "overrides ['robot.radius=0.3'], now []"),
        ({"versions": {**HEADER["versions"], "git": "0123"}}, "git 0123, now"),
        ({"versions": {**HEADER["versions"], "drake": "1.0"}}, "drake 1.0, now"),
        (
            {"cases": [vars(CASES[0]), dict(vars(CASES[0]), method="star_paper")]},
            "cases forest star, forest star_paper, now forest star",
        ),
        ({"cases": [dict(vars(CASES[0]), text="world: !Forest {}\n")]}, "written with other parameters"),
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


def test_other_code_of_an_own_method_or_world_is_not_mixed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(tmp_path))
    module = tmp_path / "mine_alone.py"
    module.write_text("GAIN = 1.0\n\ndef method(scenario):\n    return {}\n")
    for case in (
        Case("forest", "mine_alone:method", CASES[0].text),
        Case("ring", "star", "world: !mine_alone:Ring {}\n"),
    ):
        path = tmp_path / f"{case.scenario}.jsonl"
        TrialFile(path, make_header([case], seed=3)).close()
        TrialFile(path, make_header([case], seed=3), resume=True).close()
        module.write_text(module.read_text() + "# changed\n")
        with pytest.raises(StarnavError, match="other code of mine_alone .*; allowed: --resume with the same"):
            TrialFile(path, make_header([case], seed=3), resume=True)
