"""What docs/recordings.md tells to type exists, and its links lead somewhere."""

import re
from pathlib import Path

import pytest

from drake_starnav.command_line import COMMANDS
from drake_starnav.drawing import LAYERS

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "recordings.md"
TEXT = PAGE.read_text(encoding="utf-8")
LINES = [line.partition("#")[0] for block in re.findall(r"```sh\n(.*?)```", TEXT, flags=re.DOTALL)
         for line in block.splitlines()]  # fmt: skip


@pytest.mark.parametrize("line", LINES)
def test_a_command_names_a_script_and_options_that_it_has(line: str, capsys) -> None:
    program, script, *words = line.split()
    assert program == "python" and (ROOT / script).is_file()
    with pytest.raises(SystemExit):
        COMMANDS[Path(script).stem](["--help"])
    known = capsys.readouterr().out
    options = [word for word in words if word.startswith("--")]
    assert all(re.search(rf"{option}\b", known) for option in options), line


def test_links_lead_somewhere() -> None:
    links = [link.partition("#")[0] for link in re.findall(r"\]\(([^)]+)\)", TEXT) if not link.startswith("http")]
    assert links
    assert all((PAGE.parent / link).exists() for link in links)


def test_every_layer_is_explained() -> None:
    for layer in LAYERS:
        assert f"`{layer}`" in TEXT or f"`{layer.rpartition('/')[2]}`" in TEXT, layer
