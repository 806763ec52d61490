"""README's code runs as written, and its links lead somewhere."""

import re
from pathlib import Path

import pytest

from drake_starnav.scenario import parse_scenario

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, flags=re.DOTALL)


def test_python_blocks_run(capsys: pytest.CaptureFixture) -> None:
    found = blocks("python")
    assert found
    for code in found:
        exec(compile(code, "README.md", "exec"), {})
    assert capsys.readouterr().out.strip()


def test_yaml_blocks_are_scenarios() -> None:
    found = blocks("yaml")
    assert found
    for text in found:
        assert parse_scenario(text, name="readme").world


def test_commands_name_real_scripts_and_targets() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    commands = [line for block in blocks("sh") for line in block.splitlines() if line]
    assert commands
    for command in commands:
        program, target = command.split()[:2]
        if program == "make":
            assert f"\n{target}:" in makefile
        else:
            assert program == "python" and (ROOT / target).is_file()


def test_local_links_exist() -> None:
    links = [link for link in re.findall(r"\]\(([^)]+)\)", README) if not link.startswith("http")]
    assert links
    for link in links:
        assert (ROOT / link).exists(), link
