"""Trials of one or several files, with the scenarios and methods they belong to."""

import re
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from drake_starnav.errors import StarnavError, shown
from drake_starnav.evaluation.jobs import Record
from drake_starnav.evaluation.suites import SUITES
from drake_starnav.evaluation.trial_file import Header, make_record_key, read_trials
from drake_starnav.loading import parse_scenario
from drake_starnav.parameters import unknown_name
from drake_starnav.scenario.schema import Scenario, select_world
from drake_starnav.scenario.shipped import list_scenario_names


@dataclass(frozen=True)
class Results:
    """Headers of at least one file, all with the same seed, and each trial once, by scenario, method and number."""

    headers: tuple[Header, ...]
    records: tuple[Record, ...]
    given_references: tuple[str, ...] = ()

    @cached_property
    def scenarios(self) -> list[str]:
        """Names, in the order of the headers."""
        return list(dict.fromkeys(case["scenario"] for header in self.headers for case in header["cases"]))

    @cached_property
    def methods(self) -> list[str]:
        """Names, in the order of the headers."""
        return list(dict.fromkeys(case["method"] for header in self.headers for case in header["cases"]))

    @cached_property
    def suites(self) -> list[str]:
        """Names of the suites that the files belong to, if any."""
        return list(dict.fromkeys(header["suite"] for header in self.headers if header.get("suite")))

    @cached_property
    def references(self) -> list[str]:
        """Methods that the others are compared with: those given, or those of the suites, or else the first."""
        named_methods = self.given_references or [
            m for name in self.suites if name in SUITES for m in SUITES[name].references
        ]
        return [method for method in dict.fromkeys(named_methods) if method in self.methods] or self.methods[:1]

    @cached_property
    def texts(self) -> dict[tuple[str, str], str]:
        """The YAML text of each scenario and method."""
        return {(c["scenario"], c["method"]): c["text"] for header in self.headers for c in header["cases"]}

    def of(self, scenario: str, method: str) -> list[Record]:
        """The records of one case."""
        return [r for r in self.records if (r["scenario"], r["method"]) == (scenario, method)]

    @cached_property
    def cases(self) -> dict[tuple[str, str], list[Record]]:
        """The records of each scenario and method that have any."""
        pairs = [(scenario, method) for scenario in self.scenarios for method in self.methods]
        return {pair: case for pair in pairs if (case := self.of(*pair))}

    def scenario(self, record: Record) -> Scenario:
        """The scenario of a record."""
        _, case = self._find_origin(record)
        return select_world(
            parse_scenario(case["text"], name=record["scenario"], method=_describe_driver(case)), record.get("world")
        )

    def _find_origin(self, record: Record) -> tuple[Header, dict[str, str]]:
        """The header of the file that a record is from, and its case there."""
        pair = record["scenario"], record["method"]
        cases = ((header, case) for header in self.headers for case in header["cases"])
        return next(each for each in cases if (each[1]["scenario"], each[1]["method"]) == pair)

    def list_commands(self) -> list[str]:
        """The commands that ran the trials, one for each file, as they were typed; empty if none was."""
        return [header.get("command", "") for header in self.headers]

    def make_trial_command(self, record: Record) -> str:
        """The command that runs one trial again and records it."""
        header, case = self._find_origin(record)
        name = record["scenario"]
        source = case.get("source") or (name if name in list_scenario_names() else f"{name}.yaml")
        command_parts = [source, "--method", _describe_driver(case), "--seed", str(record["seed"])]
        command_parts += [part for override in header["overrides"] for part in ("--set", override)]
        if "world" in record:
            command_parts += ["--set", f"world.id={record['world']}"]
        command_parts += ["--html", f"out/{make_page_name(record)}"]
        program, _, typed_arguments = header.get("command", "").partition(" benchmark ")
        return f"{program if typed_arguments else 'starnav'} simulate {shlex.join(command_parts)}"


def make_page_name(record: Record) -> str:
    """The file name of a trial's recording, of plain characters."""
    name, method, trial = make_record_key(record)
    plain_name, method = (re.sub(r"[^\w-]+", "_", text)[:60] for text in (name, method))
    return f"{plain_name}_{method}_{trial}.html"


def make_results(headers: Sequence[Header], records: Sequence[Record], references: Sequence[str] = ()) -> Results:
    """Headers and records of files, sorted.

    Raises:
        StarnavError: none of the trials is of a method of `references`; see `Results.references`.
    """
    results = Results(tuple(headers), (), tuple(references))
    for name in references:
        if name not in results.methods:
            raise unknown_name(f"--reference {shown(name)}", name, results.methods)
    case_order = {key: k for k, key in enumerate((s, m) for s in results.scenarios for m in results.methods)}
    ranked_records = sorted(records, key=lambda r: (case_order[r["scenario"], r["method"]], r["trial"]))
    return Results(results.headers, tuple(ranked_records), results.given_references)


def read_results(paths: Sequence[Path], references: Sequence[str] = ()) -> Results:
    """Read the trials of files; for `references` see `make_results`.

    Where files have the same scenario and method with other overrides, a method is called by them, too.

    Raises:
        StarnavError: a file is not a file of trials, its seed differs from the first one's, it repeats a trial of
            another file, or it has a scenario of another file with different worlds, or, without an override that says
            so, with a different robot or simulation.
    """
    headers: list[Header] = []
    records: list[Record] = []
    case_files: dict[tuple[str, str], Path] = {}
    tasks: dict[str, tuple[Path, dict[str, Any]]] = {}
    trial_files = [read_trials(path) for path in paths]
    file_settings = _find_settings([header for header, _ in trial_files])
    for path, (header, found_records), setting in zip(paths, trial_files, file_settings, strict=True):
        if setting:
            header = {**header, "cases": [_rename_method(case, setting) for case in header["cases"]]}
            found_records = [_rename_method(record, setting) for record in found_records]
        if headers and header["seed"] != headers[0]["seed"]:
            raise StarnavError(
                f"{path} has seed {header['seed']}, {paths[0]} has {headers[0]['seed']}; allowed: the same, as only "
                "then the same numbers are the same trials"
            )
        for case in header["cases"]:
            name = case["scenario"], case["method"]
            if name in case_files:
                raise StarnavError(f"{path} has {' '.join(name)}, and so has {case_files[name]}; allowed: each once")
            case_files[name], task = path, _describe_task(case, header, compares_settings=any(file_settings))
            first, first_task = tasks.setdefault(name[0], (path, task))
            if changed_keys := [key for key in task if task[key] != first_task[key]]:
                raise StarnavError(
                    f"{first} and {path} have other {', '.join(changed_keys)} in scenario {name[0]}; allowed: the same "
                    "worlds, robot and simulation for all methods, as else their trials are not comparable"
                )
        headers.append(header)
        records += found_records
    if not records:
        raise StarnavError(f"{', '.join(map(str, paths))}: no trial has ended yet; allowed: at least one")
    return make_results(headers, records, references)


def _find_settings(headers: Sequence[Header]) -> list[str]:
    """The overrides in which each file differs from the others; empty where no two have the same case."""
    case_pairs = [{(case["scenario"], case["method"]) for case in header["cases"]} for header in headers]
    if sum(map(len, case_pairs)) == len(set().union(*case_pairs)):
        return [""] * len(headers)
    common_overrides = set.intersection(*(set(header["overrides"]) for header in headers))
    return [" ".join(each for each in header["overrides"] if each not in common_overrides) for header in headers]


def _rename_method(entry: dict[str, Any], setting: str) -> dict[str, Any]:
    """A case or a record, also of several robots, whose method is called by a setting as well."""
    robots = {"robots": [_rename_method(each, setting) for each in entry["robots"]]} if "robots" in entry else {}
    return {**entry, **robots, "method": f"{entry['method']} {setting}", "driver": entry["method"]}


def _describe_driver(case: Mapping[str, str]) -> str:
    """The method of a case without its settings."""
    return case.get("driver", case["method"])


def _describe_task(case: Mapping[str, str], header: Header, *, compares_settings: bool) -> dict[str, Any]:
    """What must be equal for all methods in a scenario, so that trials of the same number are the same task."""
    scenario = parse_scenario(case["text"], name=case["scenario"], method=_describe_driver(case))
    robot = scenario.robot
    shared_task: dict[str, Any] = {"world": scenario.world, "numbers of trials": header["in_worlds"]}
    if compares_settings:  # the worlds are made for what the robot covers
        return shared_task | {"robot.radius": robot.radius, "robot.footprint": robot.footprint}
    return shared_task | {"robot": robot, "simulation": scenario.simulation}
