"""Tests mirror the rooms: tests/room/test_module.py tests drake_starnav/room/module.py."""

from pathlib import Path

import drake_starnav
from tests.project.test_import_direction import WITHOUT_DRAKE

PACKAGE, TESTS = Path(drake_starnav.__file__).parent, Path(__file__).parents[1]
OTHERS = {
    "benchmarks": "benchmarks/",
    "fuzz": "scans of arbitrary content",
    "helpers": "shared by tests; contains none",
    "integration": "several modules or rooms together",
    "project": "the repository as a whole",
    "proof": "the lemmas of docs/proof.md",
    "scripts": "scripts/",
}
"""Folders of tests that mirror no room, and what they test."""
DECLARATIONS = "parameters"
"""Modules of this name only declare parameters, which `tests/test_parameters.py` tests."""


def modules() -> set[str]:
    """Modules and rooms of the package, as paths without suffix."""
    files = [path.relative_to(PACKAGE) for path in PACKAGE.rglob("*.py") if "share" not in path.parts]
    found = {path.with_suffix("").as_posix() for path in files if path.name != "__init__.py"}
    return found | {path.parent.as_posix() for path in files if path.name == "__init__.py"}


def names_of_tests() -> dict[str, Path]:
    """Test files of rooms by the module that their name stands for."""
    files = [path.relative_to(TESTS) for path in TESTS.rglob("test_*.py")]
    return {
        (path.parent / path.stem.removeprefix("test_")).as_posix(): path
        for path in files
        if path.parts[0] not in OTHERS
    }


def test_no_test_is_an_orphan() -> None:
    assert not {str(path) for module, path in names_of_tests().items() if module not in modules()}


def test_each_module_of_the_numerics_has_a_test_of_its_name() -> None:
    numerics = {
        path.relative_to(PACKAGE).with_suffix("").as_posix()
        for room in WITHOUT_DRAKE
        for path in [PACKAGE / f"{room}.py", *(PACKAGE / room).rglob("*.py")]
        if path.is_file() and path.stem not in ("__init__", DECLARATIONS)
    }
    assert not numerics - set(names_of_tests())


def test_helpers_of_tests_are_in_one_folder() -> None:
    shared = {path.relative_to(TESTS) for path in TESTS.rglob("*.py") if not path.name.startswith("test_")}
    assert {path.parts[0] for path in shared} == {"helpers", "conftest.py"}
