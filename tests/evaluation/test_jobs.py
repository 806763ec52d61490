"""Trials as text and numbers: their seeds, their order, and what becomes of those that cannot be run."""

import json
import pickle
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_starnav.errors import StarnavError
from drake_starnav.evaluation.jobs import Case, Job, check_worlds, derive_trial_seed, make_cases, make_jobs, run_job
from drake_starnav.scenario.scenario_file import load_scenario, parse_scenario


def test_seeds_are_the_same_for_good() -> None:
    assert [derive_trial_seed(1000, k) for k in range(3)] == [1484808508, 3739256933, 2822786858]


@given(st.integers(1, 20), st.integers(1, 20), st.integers(1, 3))
def test_trials_do_not_depend_on_how_many_there_are(few: int, more: int, kinds: int) -> None:
    cases = [Case(f"world{k}", "star", "") for k in range(kinds)]
    alone = make_jobs(cases[:1], few, 7)
    together = make_jobs(cases, few + more, 7)
    assert set(alone) <= set(together)
    assert len({job.key for job in together}) == len(together) == kinds * (few + more)


def test_worlds_number_the_trials() -> None:
    case = Case("barn", "star", "")
    jobs = make_jobs([case], [4, 7], 9, {("barn", "star", 7)})
    assert jobs == [Job(case, 4, derive_trial_seed(9, 4), in_world=True)]
    (job,) = make_jobs(make_cases(["barn"], ["star"], ["simulation.timeout=0.1"]), [3], 0)
    record = run_job(job)
    assert (record["trial"], record["outcome"], record["score"]) == (3, "timeout", 0.0)
    other = run_job(make_jobs([job.case], [4], 0)[0])
    assert other["shortest_path_m"] != record["shortest_path_m"]


def test_a_trial_of_several_robots_is_one_record_with_theirs_in_it() -> None:
    (job,) = make_jobs(make_cases(["six_robots"], ["star"], ["simulation.timeout=0.1"]), 1, 0)
    record = run_job(job)
    assert (record["scenario"], record["trial"], record["outcome"]) == ("six_robots", 0, "timeout")
    assert [robot["robot"] for robot in record["robots"]][:3] == ["starbot_1", "jackal_2", "carrier_3"]
    assert {"seed", "time_s", "command", "path"} <= record.keys() and json.loads(json.dumps(record)) == record


def test_only_numbered_worlds_that_exist_can_be_asked_for() -> None:
    barn, forest = make_cases(["barn", "forest"], ["star"])
    check_worlds([barn], [0, 5, 11])
    with pytest.raises(StarnavError, match=r"world\.id is 12; allowed: a world of .*: \[0, 1, 2"):
        check_worlds([barn], [0, 12])
    with pytest.raises(StarnavError, match="--worlds with scenario forest, whose world !Forest has no number; allowed"):
        check_worlds([barn, forest], [0])


def test_a_job_is_text_and_numbers_that_say_everything() -> None:
    (case,) = make_cases(["forest"], ["star_paper"], ["robot.radius=0.3"])
    (job,) = make_jobs([case], 1, 5)
    assert pickle.loads(pickle.dumps(job)) == job
    expected = load_scenario("forest", method="star_paper", overrides=["robot.radius=0.3"])
    assert parse_scenario(job.case.text, name="forest", method="star_paper") == expected


def test_cases_of_one_name_are_refused(tmp_path: Path) -> None:
    (tmp_path / "forest.yaml").write_text("world: !Forest {width: 30}\n")
    with pytest.raises(StarnavError, match="forest with method star is given twice"):
        make_cases(["forest", str(tmp_path / "forest.yaml")], ["star"])


@pytest.mark.parametrize(
    ("method", "text", "outcome", "message"),
    [
        ("star", "{cylinders: [[0.2, 0, 0.3]]}", "error", "Obstacles.start"),
        ("star", "{goal: [1.0, 0.0]}\nrobot: {model: nobody}", "error", "nobody"),
        ("dsm", "{polygons: [[[2, 1], [3, 1], [3, 2]]], goal: [4.0, 0.0]}", "unsupported", "1 polygon"),
    ],
)
def test_a_trial_that_cannot_be_run_is_recorded(method: str, text: str, outcome: str, message: str) -> None:
    record = run_job(Job(Case("broken", method, f"world: !Obstacles {text}"), 4, 99))
    assert record["outcome"] == outcome and message in record["message"]
    assert (record["scenario"], record["method"], record["trial"], record["seed"]) == ("broken", method, 4, 99)


def test_a_fault_that_nobody_foresaw_is_recorded_with_its_kind(monkeypatch) -> None:
    def fail(*args: object, **kwargs: object) -> None:
        raise ZeroDivisionError("float division")

    monkeypatch.setattr("drake_starnav.simulation.records.run_trial", fail)
    record = run_job(Job(Case("empty", "star", "world: !Obstacles {}"), 0, 0))
    assert (record["outcome"], record["message"]) == ("error", "ZeroDivisionError: float division")
