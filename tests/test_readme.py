"""README's code runs as written, and its links lead somewhere."""

import re
from pathlib import Path

import pytest

from drake_starnav.scenario import parse_scenario

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str, text: str = README) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", text, flags=re.DOTALL)


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


@pytest.mark.parametrize("page", ["README.md", "docs/benchmark.md"])
def test_commands_name_real_scripts_targets_and_options(page: str) -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    options = (ROOT / "drake_starnav" / "command_line.py").read_text(encoding="utf-8")
    text = (ROOT / page).read_text(encoding="utf-8")
    commands = [line.partition("#")[0] for block in blocks("sh", text) for line in block.splitlines() if line]
    assert commands
    for command in commands:
        program, target, *rest = command.split()
        if program == "make":
            assert f"\n{target}:" in makefile
        elif program == "pip":
            (extra,) = re.findall(r"\[(\w+)\]", rest[0])
            assert f"\n{extra} = [" in project
        else:
            assert program == "python" and (ROOT / target).is_file()
            assert all(f'"{option}"' in options for option in rest if option.startswith("--"))


def test_local_links_exist() -> None:
    links = [link for link in re.findall(r"\]\(([^)]+)\)", README) if not link.startswith("http")]
    assert links
    for link in links:
        assert (ROOT / link).exists(), link
