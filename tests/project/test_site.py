"""The documentation builds as a site without a warning, and the site works offline."""

import importlib.util
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import pytest

from tests.helpers.browser import browser_missing, find_chromium

DOCS = Path(__file__).resolve().parents[2] / "docs"

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        any(importlib.util.find_spec(name) is None for name in ("sphinx", "myst_nb", "furo")),
        reason="building the site takes sphinx, myst-nb and furo: install the extra docs",
    ),
]

LOADING = {"script": "src", "img": "src", "link": "href", "iframe": "src", "source": "src", "video": "src"}
"""Elements that make a browser load something, and the attribute that names it."""


class Page(HTMLParser):
    """What a page loads, its links and its anchors."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.loads: list[str] = []
        self.leads: list[str] = []
        self.anchors: set[str] = set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        if values.get("id"):
            self.anchors.add(str(values["id"]))
        if tag in LOADING and values.get(LOADING[tag]):
            self.loads.append(str(values[LOADING[tag]]))
        if tag == "a" and values.get("href"):
            self.leads.append(str(values["href"]))


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, freshly built; any warning fails, such as a link to a page or heading that does not exist.

    The notebooks are not run for it, as `test_notebooks.py` does.
    """
    folder = tmp_path_factory.mktemp("site")
    options = ("-W", "--keep-going", "-q", "-D", "nb_execution_mode=off")
    done = subprocess.run(
        [sys.executable, "-m", "sphinx", *options, str(DOCS), str(folder)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return folder


def test_every_page_is_in_the_menu(site: Path) -> None:
    menu = set(Page(site / "index.html").leads)
    pages = [page.relative_to(DOCS).with_suffix(".html").as_posix() for page in DOCS.rglob("*.md")]
    assert set(pages) - {"index.html"} <= menu


def test_types_of_ours_and_of_drake_are_links(site: Path) -> None:
    leads = Page(site / "api.html").leads
    assert "#drake_starnav.Scenario" in leads
    assert any(lead.startswith("https://drake.mit.edu/pydrake/pydrake.systems.framework.html#") for lead in leads)


def test_pages_load_only_local_files_that_exist(site: Path) -> None:
    for path in site.rglob("*.html"):
        for target in Page(path).loads:
            if not target.startswith("data:"):
                assert "//" not in target, f"{path.name} loads {target}"
                assert (path.parent / target.partition("?")[0].partition("#")[0]).exists(), f"{path.name}: {target}"
    for style in site.rglob("*.css"):
        text = re.sub(r"url\((?!['\"]?data:)", "load(", style.read_text(encoding="utf-8"))
        assert not re.search(r"load\(['\"]?(https?:)?//|@import", text), style.name


def test_links_between_pages_have_their_anchors(site: Path) -> None:
    pages = {path.resolve(): Page(path) for path in site.rglob("*.html")}
    for path, page in pages.items():
        for target in page.leads:
            file, _, anchor = target.partition("#")
            led = (path.parent / file).resolve() if file else path
            if "//" not in target and led.suffix == ".html":
                assert led in pages, f"{path.name}: {target}"
                assert not anchor or anchor in pages[led].anchors, f"{path.name}: {target}"


@pytest.mark.skipif(browser_missing() is not None, reason=str(browser_missing()))
def test_a_browser_shows_every_picture_and_requests_only_the_site(site: Path) -> None:
    from playwright.sync_api import sync_playwright

    asked: list[str] = []
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=find_chromium(), args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1100, "height": 800})
        page.on("request", lambda request: asked.append(request.url))
        for name in ("index", "architecture", "method", "ports", "parameters", "coming_from", "examples/index"):
            page.goto((site / f"{name}.html").as_uri())
            broken = page.evaluate("[...document.images].filter(i => !i.naturalWidth).map(i => i.src)")
            assert broken == [], "pictures are missing"
            overhang = page.evaluate("document.documentElement.scrollWidth - window.innerWidth")
            assert overhang <= 0, f"{name} is wider than its window"
        browser.close()
    assert asked and all(url.startswith(("file:", "data:")) for url in asked)
