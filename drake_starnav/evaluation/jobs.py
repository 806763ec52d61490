"""One trial as plain text and numbers, so that any process on any machine can run it."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drake_starnav.errors import StarnavError, UnsupportedError
from drake_starnav.loading import load_scenario, parse_scenario
from drake_starnav.scenario.scenario_file import format_scenario
from drake_starnav.scenario.schema import Scenario, select_world

Record = dict[str, Any]
"""A finished trial as stored in a file: the fields of a `Trial` and its number."""
Key = tuple[str, str, int]
"""Identifies a trial within a file: scenario, method, number."""
NEVER_RAN = ("error", "unsupported")
"""Outcomes of trials that could not be run."""


@dataclass(frozen=True)
class Case:
    """A scenario driven by a method, which is repeated with different seeds.

    Attributes:
        scenario: its name.
        method: its name.
        text: the scenario as YAML with every parameter written out, including the method's and the overrides.
        source: the name of the shipped scenario, or the path, from which it was loaded.
    """

    scenario: str
    method: str
    text: str
    source: str = ""

    def read(self) -> Scenario:
        """The scenario."""
        return parse_scenario(self.text, name=self.scenario, method=self.method)


@dataclass(frozen=True)
class Job:
    """One trial to run: the `trial`-th of a case, with its own seed; `in_world`: its number replaces the case's
    `world.id`."""

    case: Case
    trial: int
    seed: int
    in_world: bool = False

    @property
    def key(self) -> Key:
        """Identifies the trial within a file."""
        return self.case.scenario, self.case.method, self.trial


def derive_trial_seed(seed: int, trial: int) -> int:
    """The seed of a trial, by its number from 0 and that of the batch, >= 0, whatever other trials the batch has."""
    return int(np.random.SeedSequence(entropy=seed, spawn_key=(trial,)).generate_state(1)[0])


def make_cases(scenarios: Sequence[str], methods: Sequence[str], overrides: Sequence[str] = ()) -> list[Case]:
    """Every scenario, of a shipped name or a path, with every method and all "dotted.key=value" overrides.

    Raises:
        StarnavError: as in `load_scenario`, or two cases have the same names.
    """
    cases = []
    for name in scenarios:
        for method in methods:
            scenario = load_scenario(name, method=method, overrides=overrides)
            cases.append(Case(scenario.name, method, format_scenario(scenario), name))
    case_names = [(case.scenario, case.method) for case in cases]
    for scenario_name, method in case_names:
        if case_names.count((scenario_name, method)) > 1:
            raise StarnavError(
                f"scenario {scenario_name} with method {method} is given twice; allowed: each once, under its own name"
            )
    return cases


def check_worlds(cases: Sequence[Case], worlds: Sequence[int]) -> None:
    """Raise `StarnavError` unless every case can be driven in each of the numbered worlds."""
    for case in cases:
        kind = case.read().world
        if not hasattr(kind, "check_numbers"):
            raise StarnavError(
                f"--worlds with scenario {case.scenario}, whose world !{type(kind).__name__} has no number; "
                "allowed: scenarios with numbered worlds, as !Barn"
            )
        kind.check_numbers(worlds)


def make_jobs(cases: Sequence[Case], trials: int | Sequence[int], seed: int, done: Collection[Key] = ()) -> list[Job]:
    """The trials still to run, alternating between the cases, so that an interrupted batch compares them fairly.

    Args:
        cases, seed: of the batch.
        trials: number of trials of each case, or the numbers of the worlds, with one trial in each.
        done: keys of the trials to leave out.
    """
    in_world = not isinstance(trials, int)
    trial_numbers = range(trials) if isinstance(trials, int) else trials
    jobs = [Job(case, trial, derive_trial_seed(seed, trial), in_world) for trial in trial_numbers for case in cases]
    return [job for job in jobs if job.key not in done]


def run_job(job: Job) -> Record:
    """Run one trial; if it cannot be run, the record has the outcome `error` and a message.

    If the method does not support the trial's world, the outcome is `unsupported`.
    """
    from drake_starnav.simulation.records import make_driven_record  # late: only workers need Drake

    try:
        scenario = select_world(job.case.read(), job.trial if job.in_world else None)
        record = make_driven_record(scenario, seed=job.seed)
    except UnsupportedError as error:
        return {**make_error_record(job, str(error)), "outcome": "unsupported"}
    except StarnavError as error:
        return make_error_record(job, str(error))
    except Exception as error:  # a fault in one trial must not end the others
        return make_error_record(job, f"{type(error).__name__}: {error}")
    world = {"world": job.trial} if job.in_world else {}
    return {"trial": job.trial, **world, **record}


def make_error_record(job: Job, message: str) -> Record:
    """The record of a trial that could not be run."""
    return {
        "trial": job.trial,
        "scenario": job.case.scenario,
        "method": job.case.method,
        "seed": job.seed,
        "outcome": "error",
        "message": message,
    }
