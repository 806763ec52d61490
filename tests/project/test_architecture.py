"""The map for newcomers agrees with the code: rooms, the path of a scan, and every file that it names."""

import re
from pathlib import Path

import pytest

from scripts.maintenance import draw_architecture

ROOT = Path(__file__).resolve().parents[2]
PAGE = draw_architecture.PAGE.read_text(encoding="utf-8")
FOLDERS = ("drake_starnav", "docs", "models", "scripts", "tests", "benchmarks")
NAMED = sorted({name for name in re.findall(r"`([\w./]+/[\w./]*)`", PAGE) if name.startswith(FOLDERS)})


@pytest.mark.parametrize("path", draw_architecture.texts(), ids=lambda path: path.name)
def test_page_and_picture_are_up_to_date(path: Path) -> None:
    assert not draw_architecture.stale(path, draw_architecture.texts()[path]), f"run {draw_architecture.SECTION[1]}"


@pytest.mark.parametrize("name", NAMED)
def test_a_named_file_exists(name: str) -> None:
    assert (ROOT / name).exists()
