"""A page inside a notebook."""

from html.parser import HTMLParser
from pathlib import Path

from drake_starnav.plotting import InlinePage

PAGE = '<!doctype html><p title="quoted">a &amp; b</p>'


def test_the_page_is_within_the_cell_s_output(tmp_path: Path) -> None:
    found: list[dict] = []

    class Frames(HTMLParser):
        def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
            found.append({"tag": tag, **dict(attrs)})

    path = tmp_path / "page.html"
    path.write_text(PAGE, encoding="utf-8")
    shown = InlinePage(path, height=300)
    path.unlink()
    Frames().feed(shown._repr_html_())
    (frame,) = found
    assert frame["tag"] == "iframe" and frame["srcdoc"] == PAGE and "300px" in frame["style"]
