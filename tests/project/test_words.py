"""One vocabulary: the glossary's terms are used, and prose is plain technical English."""

import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
GLOSSARY = ROOT / "docs" / "glossary.md"
MOST_TERMS = 25
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


def terms() -> list[str]:
    """The glossary's terms."""
    rows = re.findall(r"^\| ([^|]+) \| ([^|]+) \|$", GLOSSARY.read_text(encoding="utf-8"), re.M)
    return [term for term, _ in rows if term != "term"]


def normalised(text: str) -> str:
    """Lower case, with spaces for hyphens, underscores and the ends of lines."""
    return re.sub(r"[\s_-]+", " ", text.lower())


def test_the_glossary_is_short_and_its_terms_are_unique() -> None:
    assert 0 < len(terms()) <= MOST_TERMS and len(set(terms())) == len(terms())


@pytest.mark.parametrize("term", terms())
def test_each_term_is_used_in_the_docs(term: str) -> None:
    pages = [ROOT / "README.md", ROOT / "SAFETY.md", *(ROOT / "docs").glob("*.md")]
    text = normalised(" ".join(page.read_text(encoding="utf-8") for page in pages if page != GLOSSARY))
    assert normalised(term) in text


def test_no_archaic_phrase_is_in_modules_and_pages() -> None:
    names = subprocess.run(
        ["git", "-C", str(ROOT), "ls-files", "*.py", "*.md"], capture_output=True, text=True, check=False
    ).stdout.splitlines()
    archaic = re.compile(rf"\b({'|'.join(PROSE)})\b", re.IGNORECASE)
    for path in (ROOT / name for name in names):
        if path.is_file() and path.name != Path(__file__).name:
            text = " ".join(path.read_text(encoding="utf-8", errors="replace").split())
            assert not archaic.findall(text), f"{path}: write {PROSE}"
