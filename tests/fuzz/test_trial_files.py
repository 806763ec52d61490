"""Whatever a file of trials holds, resuming it goes on or refuses in one sentence, and loses nothing."""

import json
import tempfile
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_starnav.errors import StarnavError
from drake_starnav.evaluation.jobs import Case, error_record, make_jobs
from drake_starnav.evaluation.report.results import read_results
from drake_starnav.evaluation.report.tables import tables_markdown
from drake_starnav.evaluation.trial_file import TrialFile, make_header, read_trials
from tests.helpers.inputs import corpus, fuzzed, mutated, values
from tests.helpers.trials import record

CASES = [Case("forest", "star", "world: !Forest {}\nrobot: {radius: 0.25}\n")]
HEADER = make_header(CASES, seed=3)
RECORDS = [record(trial=0), *(error_record(job, "for the test") for job in make_jobs(CASES, 3, 3)[1:])]
VALID = b"".join(json.dumps(entry).encode() + b"\n" for entry in (HEADER, *RECORDS))


def resumed(data: bytes) -> bool:
    """Whether a file is continued; if not, it stays as it was. Any error but StarnavError is a failure."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "trials.jsonl")
        path.write_bytes(data)
        try:
            assert tables_markdown(read_results([path]))
        except StarnavError as error:
            assert str(error)
        try:
            with TrialFile(path, HEADER, resume=True) as file:
                count = len(file.records)
        except StarnavError as error:
            assert str(error)
            assert path.read_bytes() == data
            return False
        assert len(read_trials(path)[1]) == count
        return True


def test_the_undamaged_file_is_continued():
    assert resumed(VALID) and resumed(b"")


@fuzzed
@given(mutated(VALID))
def test_any_damage(data):
    resumed(data)


@fuzzed
@given(st.binary(max_size=80))
def test_any_file(data):
    resumed(data)


@fuzzed
@given(st.dictionaries(st.sampled_from([*HEADER, "other"]), values, max_size=3))
def test_any_header(changes):
    header = {str(key): value for key, value in (HEADER | changes).items()}
    resumed(json.dumps(header, default=str, skipkeys=True).encode() + b"\n" + VALID[VALID.index(b"\n") + 1 :])


@fuzzed
@given(st.dictionaries(st.sampled_from([*RECORDS[0], "other"]), values, max_size=3))
def test_any_record(changes):
    record = {str(key): value for key, value in (RECORDS[0] | changes).items()}
    resumed(json.dumps(HEADER).encode() + b"\n" + json.dumps(record, default=str, skipkeys=True).encode() + b"\n")


@pytest.mark.parametrize("path", corpus("trials"), ids=lambda path: path.name)
def test_the_corpus_is_refused_and_left_as_it_was(path):
    assert not resumed(path.read_bytes())
