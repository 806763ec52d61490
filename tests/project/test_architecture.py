"""The map for newcomers agrees with the code: rooms, the path of a scan, and every file that it names."""

import re
from pathlib import Path

import pytest

from scripts.maintenance import draw_architecture
from tests.project.test_import_direction import TABLE

ROOT = Path(__file__).resolve().parents[2]
PAGE = draw_architecture.PAGE.read_text(encoding="utf-8")
FOLDERS = ("drake_starnav", "docs", "models", "scripts", "tests", "benchmarks")
NAMED = sorted({name for name in re.findall(r"`([\w./]+/[\w./]*)`", PAGE) if name.startswith(FOLDERS)})


@pytest.mark.parametrize("path", draw_architecture.texts(), ids=lambda path: path.name)
def test_page_and_picture_are_up_to_date(path: Path) -> None:
    assert not draw_architecture.stale(path, draw_architecture.texts()[path]), f"run {draw_architecture.SECTION[1]}"


def test_the_page_has_a_row_for_each_room() -> None:
    rows = re.findall(r"^\| `(\w+)(?:/|\.py)` \|", PAGE, re.MULTILINE)
    assert rows == list(TABLE)


@pytest.mark.parametrize("name", NAMED)
def test_a_named_file_exists(name: str) -> None:
    assert (ROOT / name).exists()


def test_each_addition_names_its_files() -> None:
    additions = re.split(r"^\*\*", PAGE.partition("## Where to add")[2], flags=re.MULTILINE)[1:]
    assert {text.partition(".")[0] for text in additions} >= {"A world", "A sensor", "A certificate", "A planner"}
    for text in additions:
        assert re.search(r"`[\w./]+\.py`", text), text


@pytest.mark.parametrize(
    ("above", "known", "said"),
    [
        ([], [], ""),
        (["a", "b"], ["a", "b"], "all above"),
        (["a", "b", "c"], ["a", "c"], "all above but b"),
        (["a", "b", "c"], ["a"], "a"),
    ],
)
def test_what_a_room_may_import_is_said_shortly(above: list[str], known: list[str], said: str) -> None:
    assert draw_architecture._listed(above, known) == said


def test_signals_that_share_a_lane_do_not_overlap() -> None:
    ports = [draw_architecture.Port("a", name) for name in "pqrs"]
    spans = dict(zip(ports, [(0, 10), (12, 20), (5, 15), (0, 30)], strict=True))
    lanes = draw_architecture._lanes(spans)
    assert lanes[ports[0]] == lanes[ports[1]] == 0
    assert len({lanes[ports[k]] for k in (0, 2, 3)}) == 3
