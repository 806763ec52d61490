"""What is a mutant and what is not, and that it is the tests which kill it."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from drake_starnav.scenario.error_budget import SYMBOLS, TERMS
from scripts.maintenance.mutate import EQUIVALENT, GROUPS, ROOT, WANTED, mutants, report

SOURCE = '''"""Less than 2 words."""
from numba import njit

@njit(cache=True)
def nearer(x: float | None, y: float, limit: float = 1.0) -> bool:
    """Whether x + y < limit."""
    if x is None or y > limit:
        return False
    y += 2.0
    return min(x, y) < limit
'''
MODULES = {module: files for modules in GROUPS.values() for module, files in modules.items()}


def changes(source: str) -> set[tuple[int, str]]:
    return {(mutant.line, mutant.after) for mutant in mutants(source)}


def test_operators_numbers_conditions_and_assignments_are_changed_and_nothing_else() -> None:
    found = changes(SOURCE)
    assert {line for line, _ in found} == {5, 7, 8, 9, 10}  # no words, decorators and annotations
    assert all("float | None" in after and ": float" in after for line, after in found if line == 5)
    for expected in (
        (5, "def nearer(x: float | None, y: float, limit: float = 2.0) -> bool:"),
        (7, "if x is None or y <= limit:"),
        (7, "if x is not None or y > limit:"),
        (7, "if x is None:"),
        (7, "if False:"),
        (8, "return True"),
        (9, "y"),
        (10, "return max(x, y) < limit"),
    ):
        assert expected in found


def test_the_formulas_in_texts_are_changed_as_code() -> None:
    source = 'N = 2\ndef ErrorTerm(text, meaning):\n    return text\n\nTERM = ErrorTerm(f"{N} * v^2", "a + b")\n'
    formulas = {mutant.after for mutant in mutants(source) if mutant.line == 5}
    assert {"2 + v^2", "3 * v^2", "2 * v*2"} <= formulas
    assert not any("a" in formula for formula in formulas)


@pytest.mark.slow
def test_a_mutant_is_killed_by_a_test_of_its_module(tmp_path: Path) -> None:
    out = tmp_path / "mutants.jsonl"
    command = [
        sys.executable,
        "scripts/maintenance/mutate.py",
        "control/certificates",
        "--mutants",
        "3",
        "--out",
        str(out),
    ]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    records = [json.loads(line) for line in out.read_text().splitlines()]
    assert len(records) == 3 and {record["seed"] for record in records} == {0}
    assert any("tests/control/test_certificates.py::" in record["killer"] for record in records), done.stderr


def fate(killer: str) -> dict:
    """What became of a mutant that is not listed."""
    facts = {"module": "control/shield", "of": 9, "line": 1, "before": "x", "after": "y"}
    return {**facts, "killer": killer, "seconds": 1.0}


def test_too_many_survivors_are_a_failure() -> None:
    text, enough = report([fate("test")] * 19 + [fate("")])
    assert enough and WANTED == 0.95
    assert "shield: 19 of 20 killed, 95.0 %" in text
    assert not report([fate("test")] * 18 + [fate("")])[1]


def test_equivalent_mutants_do_not_count() -> None:
    module, entry = next((module, entry) for module, entries in listed().items() for entry in entries)
    record = {**fate(""), "module": module, "before": entry["before"], "after": entry["after"][0]}
    text, enough = report([record])
    assert enough and "1 equivalent" in text


def listed() -> dict[str, list[dict]]:
    return yaml.safe_load(EQUIVALENT.read_text(encoding="utf-8"))


def test_each_equivalent_mutant_has_a_reason_and_is_of_a_line_that_is_there() -> None:
    assert set(listed()) == set(MODULES)
    formulas = {term.text for term in (*SYMBOLS.values(), *TERMS)}
    for module, entries in listed().items():
        lines = {line.strip() for line in (ROOT / "drake_starnav" / f"{module}.py").read_text().splitlines()}
        for entry in entries:
            assert len(entry["why"].split()) > 3
            assert entry["before"] in lines | formulas and entry["before"] not in entry["after"], entry


@pytest.mark.parametrize("module", MODULES)
def test_the_tests_of_each_module_exist(module: str) -> None:
    assert all((ROOT / file).is_file() for file in MODULES[module])
