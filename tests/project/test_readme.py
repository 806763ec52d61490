"""The code in README and docs runs as written, and local links exist."""

import contextlib
import io
import re
import subprocess
import sys
from functools import cache
from pathlib import Path
from unittest.mock import patch

import pytest

from drake_starnav.cli.main import MODULES, main
from drake_starnav.cli.options import ENTRY_POINT
from drake_starnav.scenario.scenario_file import parse_scenario
from drake_starnav.worlds import WORLD_KINDS

ROOT = Path(__file__).resolve().parents[2]
README = ROOT / "README.md"
PAGES = [README, *sorted((ROOT / "docs").glob("*.md"))]


def blocks(language: str, page: Path = README) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", page.read_text(encoding="utf-8"), flags=re.DOTALL)


@pytest.mark.parametrize("page", [page for page in PAGES if blocks("python", page)], ids=lambda page: page.name)
def test_python_blocks_run(page: Path, capsys: pytest.CaptureFixture, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)  # some write files
    with patch.dict(WORLD_KINDS):  # a block may register a kind of world
        for code in blocks("python", page):
            exec(compile(code, page.name, "exec"), {"__name__": "documented"})
    assert capsys.readouterr().out.strip()


@pytest.mark.parametrize("page", [README, ROOT / "docs" / "tuning.md"], ids=lambda page: page.name)
def test_yaml_blocks_are_scenarios_or_parts_of_them(page: Path) -> None:
    found = blocks("yaml", page)
    assert found
    for text in found:
        assert parse_scenario(text if "world:" in text else f"world: !Forest\n{text}", name=page.stem).world


@cache
def help_of(program: tuple[str, ...]) -> str:
    """Output of a script or module for --help."""
    if program[:2] == ("-m", "drake_starnav"):
        with contextlib.redirect_stdout(io.StringIO()) as text, contextlib.suppress(SystemExit):
            main([*program[2:], "--help"])
        return text.getvalue()
    return subprocess.run(
        [sys.executable, *program, "--help"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout


def assert_has_options(program: tuple[str, ...], words: list[str]) -> None:
    for option in (word for word in words if word.startswith("--")):
        assert re.search(rf"{option}\b", help_of(program)), (program, option)


@pytest.mark.parametrize("page", [page for page in PAGES if blocks("sh", page)], ids=lambda page: page.name)
def test_commands_name_real_scripts_targets_and_options(page: Path) -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    lines = [line.partition("#")[0].strip() for block in blocks("sh", page) for line in block.splitlines()]
    commands = [line for line in lines if line]
    assert commands
    for command in commands:
        program, target, *rest = *command.split(), ""
        rest = [word for word in rest if word]
        if program == "make":
            assert f"\n{target}:" in makefile
        elif command == "pip install .":
            assert "[project]\n" in project
        elif program == "pip":
            (extra,) = re.findall(r"\[(\w+)\]", rest[0])
            assert f"\n{extra} = [" in project
        elif command == "source .venv/bin/activate":
            assert "VENV ?= .venv\n" in makefile
        elif program == ENTRY_POINT:
            assert target in ("", *MODULES)
            assert_has_options(("-m", "drake_starnav", *([target] if target else [])), rest)
        elif target == "-m":
            module = ROOT / rest[0].replace(".", "/")
            assert program == "python" and (module.with_suffix(".py").is_file() or (module / "__main__.py").is_file())
            assert_has_options(("-m", rest[0]), rest[1:])
        else:
            assert program == "python" and (ROOT / target).is_file()
            assert_has_options((target,), rest)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_local_links_exist(page: Path) -> None:
    prose = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    links = re.findall(r"\]\(([^)]+)\)", prose)
    for link in links:
        assert link.startswith("http") or (page.parent / link.partition("#")[0]).exists(), link
