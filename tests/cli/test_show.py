"""The command prints every term of the sum that is not 0, and what follows from it."""

import re

import pytest

from drake_starnav.cli.show import margins
from drake_starnav.scenario.error_budget import SYMBOLS, TERMS, evaluate_error_budget
from drake_starnav.scenario.margins import derive_margins
from drake_starnav.scenario.scenario_file import load_scenario

CHANGES = ("lidar.noise=0.03", "localization.drift=0.02", "drive.slip=0.05")


def test_each_term_that_counts_is_printed_and_they_add_up(capsys) -> None:
    assert margins(["maze", *(word for change in CHANGES for word in ("--set", change))]) == 0
    terms, symbols, derived = capsys.readouterr().out.rstrip("\n").split("\n\n")
    *rows, others, last, thinnest = re.findall(r"^ *([\d.]+) mm  (.*)$", terms, re.MULTILINE)
    scenario = load_scenario("maze", overrides=CHANGES)
    counting = [term for term, value in zip(TERMS, evaluate_error_budget(scenario).terms, strict=True) if value > 0.0]
    assert [text for _, text in rows] == [f"{term.text}: {term.meaning}" for term in counting]
    assert others == ("0.00", f"the other {len(TERMS) - len(counting)} terms that SAFETY.md lists")
    kept = derive_margins(scenario)
    assert sum(float(value) for value, _ in rows) == pytest.approx(float(last[0]), abs=0.05)
    assert float(last[0]) == pytest.approx(1e3 * kept.safety, abs=0.005)
    assert thinnest == (f"{1e3 * kept.thinnest:.2f}", "the thinnest obstacle that is certain to be seen")
    assert re.findall(r"  (\w) = ", symbols) == list(SYMBOLS)
    printed = {name: value for value, name in map(str.split, derived.splitlines())}
    retention = {f"retention.{name}": value for name, value in kept.retention._asdict().items()}
    values = {name: value for name, value in (vars(kept) | retention).items() if name != "retention"}
    assert {
        name: str(round(value, 6)) if isinstance(value, float) else str(value) for name, value in values.items()
    } == printed
