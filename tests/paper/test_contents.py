"""The map of the paper and the table of choices agree with code and docs."""

import importlib
import inspect
import re
from pathlib import Path

import pytest

from drake_starnav.paper import choices
from drake_starnav.paper.contents import ENTRIES, Entry

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "paper.md").read_text(encoding="utf-8")
READINGS = {"FRONTIER_BEARING": "frontier_points", "NEAREST_VECTOR": "blend", "FOLLOW_VECTOR": "pid"}
"""Choices that are functions, and the module that names the one in use."""


def test_each_equation_line_table_and_figure_has_one_entry() -> None:
    wanted = [f"({k})" for k in range(1, 16)] + [f"line {k}" for k in range(1, 23)]
    assert [entry.name for entry in ENTRIES] == [*wanted, "Table I", *(f"Fig. {k}" for k in (2, 5, 6, 7))]


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.name)
def test_an_entry_exists_and_says_what_became_of_it(entry: Entry) -> None:
    assert f"| {entry.name} | {entry.subject} | `{entry.place}` |" in PAGE
    assert re.match("as printed|corrected|replaced|-$", entry.as_here)
    assert re.match("as printed|corrected|replaced|not used|-$", entry.in_star)
    if ":" not in entry.place:
        assert (ROOT / entry.place).is_file()
        return
    module, name = entry.place.split(":")
    found = getattr(importlib.import_module(module), name)
    if entry.name.startswith("(") and module.startswith("drake_starnav.paper"):
        said = inspect.getdoc(getattr(found, "py_func", found)) or ""
        numbers = re.match(r"Eq\. \(\d+\)(?: and \(\d+\))?|Section IV", said)
        assert numbers and (entry.name in numbers[0] or entry.name == "(4)")
        assert re.search(r"[Aa]s printed|Corrected|authors' code", said)


def test_the_page_lists_each_choice_as_the_code_has_it() -> None:
    for name, choice in choices.CHOICES.items():
        assert f"| `{name}` | `" in PAGE and choice.meaning and choice.printed and choice.reason and choice.others
        if name in READINGS:
            module = importlib.import_module(f"drake_starnav.paper.{READINGS[name]}")
            assert getattr(module, name.lower()) is getattr(module, choice.value)
        elif not isinstance(choice.value, str):
            assert getattr(choices, name) == choice.value
