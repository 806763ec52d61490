"""One vocabulary: the glossary's terms are used, and words that were replaced by the field's do not return."""

import functools
import re
import subprocess
import tokenize
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
GLOSSARY = ROOT / "docs" / "glossary.md"
MOST_TERMS = 25
REPLACED = re.compile(
    r"""
    Mover\w*| mover\w*| MOVER\w*| \w+_movers?| _?movers| wary_step| encounters?| Encounter| threats| foresight|
    foreseen_step| foreseen_costs| FORESEEN_MARGIN| sidestep\w*| promises| check_promises| tolerating| sensing_error|
    MotionGrid| motion_grid| courses| COURSE_\w+| hidden_places| HIDDEN_\w+| COUNTED_\w+| STAYS| MOVES| taken_at_once|
    cast_sweep| way_on| next_on| next_part| is_barred| barred_in_vain| BARRED_\w+| closer_look| optimistic_gate|
    gate_in_sight| GATE_ADVANTAGE| GATE_LENGTH| HitMemory| hit_memory| Headway| headway| HEADWAY| Moment| Cause|
    retired| retire_dead_ends| retired_radius| swerved?| max_swerve| pending_count| RobotEquipment| check_equipment
    """,
    re.VERBOSE,
)
"""Identifiers that have other names now."""
PROSE = {
    "be they": "whether",
    "whence": "source",
    "wherefrom": "from which",
    "thereof": "of it",
    "hitherto": "so far",
    "lest": "so that ... not",
    "upon": "on",
    "ought": "should",
    "nobody can": "cannot",
    "of a user's": "a user's",
    "at first sight": "on the first scan",
    "decided on from": "decided when",
    "living frontiers?": "open frontiers",
}
"""Phrases that readers of plain technical English stumble over, as regular expressions, and what to write instead."""
KEEPS = {"test_words.py"}
"""The file that lists them."""


def terms() -> list[str]:
    """The glossary's terms."""
    rows = re.findall(r"^\| ([^|]+) \| ([^|]+) \|$", GLOSSARY.read_text(encoding="utf-8"), re.M)
    return [term for term, _ in rows if term != "term"]


def normalised(text: str) -> str:
    """Lower case, with spaces for hyphens, underscores and the ends of lines."""
    return re.sub(r"[\s_-]+", " ", text.lower())


def files(*patterns: str) -> list[Path]:
    """Tracked files, or all if this is no checkout."""
    found = subprocess.run(
        ["git", "-C", str(ROOT), "ls-files", *patterns], capture_output=True, text=True, check=False
    ).stdout.splitlines()
    paths = [ROOT / name for name in found] or [path for pattern in patterns for path in ROOT.glob(f"**/{pattern}")]
    return [path for path in paths if path.is_file() and path.name not in KEEPS]


def identifiers(path: Path) -> Iterator[tuple[int, str]]:
    """The names of a module, those in backticks or dotted keys in its texts too, and the lines they are in."""
    with tokenize.open(path) as file:
        for token in tokenize.generate_tokens(file.readline):
            if token.type == tokenize.NAME:
                yield token.start[0], token.string
            elif token.type in (tokenize.STRING, tokenize.COMMENT):
                yield from ((token.start[0], name) for name in named(token.string))


def named(text: str) -> list[str]:
    """Names that stand in backticks, or before a dot and a key, in a text."""
    quoted = " ".join(re.findall(r"`([^`\n]+)`", text))
    keys = re.findall(r"\b([a-z_]+)\.([a-z_]+)\b", text)
    return re.findall(r"[A-Za-z_]\w*", quoted) + [name for pair in keys for name in pair]


def prose(path: Path) -> Iterator[tuple[int, str]]:
    """Comments and strings of a module, or all of a page, with single spaces, and the lines they begin in."""
    if path.suffix != ".py":
        yield 1, " ".join(path.read_text(encoding="utf-8", errors="replace").split())
        return
    kinds = {tokenize.STRING, tokenize.COMMENT, getattr(tokenize, "FSTRING_MIDDLE", tokenize.STRING)}
    with tokenize.open(path) as file:
        for token in tokenize.generate_tokens(file.readline):
            if token.type in kinds:
                yield token.start[0], " ".join(token.string.split())


def test_the_glossary_is_short_and_its_terms_are_unique() -> None:
    assert 0 < len(terms()) <= MOST_TERMS and len(set(terms())) == len(terms())
    assert all(len(line) <= 160 for line in GLOSSARY.read_text(encoding="utf-8").splitlines())


@pytest.mark.parametrize("term", terms())
def test_each_term_is_used_in_the_docs(term: str) -> None:
    pages = [ROOT / "README.md", ROOT / "SAFETY.md", *(ROOT / "docs").glob("*.md")]
    text = normalised(" ".join(page.read_text(encoding="utf-8") for page in pages if page != GLOSSARY))
    assert normalised(term) in text


def test_no_replaced_word_is_in_the_code() -> None:
    found = [
        f"{path.relative_to(ROOT)}:{line}: {name}"
        for path in files("*.py")
        for line, name in identifiers(path)
        if REPLACED.fullmatch(name)
    ]
    assert not found


def test_no_replaced_word_is_in_the_docs() -> None:
    found = [
        f"{path.relative_to(ROOT)}: {name}"
        for path in files("*.md", "*.yaml")
        for name in named(path.read_text(encoding="utf-8", errors="replace"))
        if REPLACED.fullmatch(name)
    ]
    assert not found


def test_no_file_has_a_replaced_name() -> None:
    assert not [
        path for path in files("*.py", "*.yaml", "*.svg") if REPLACED.fullmatch(path.stem.removeprefix("test_"))
    ]


@pytest.mark.parametrize("phrase", PROSE)
def test_no_archaic_phrase_is_in_prose(phrase: str) -> None:
    pattern = re.compile(rf"\b{phrase}\b", re.IGNORECASE)
    found = [f"{path.relative_to(ROOT)}:{line}" for path, line, text in all_prose() if pattern.search(text)]
    assert not found, f"write {PROSE[phrase]!r} instead"


@functools.cache
def all_prose() -> list[tuple[Path, int, str]]:
    """The prose of all tracked modules and pages."""
    return [(path, line, text) for path in files("*.py", "*.md") for line, text in prose(path)]
