"""The report in a real browser: it asks nothing of a network, fits 1100 pixels, and shows all its parts."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import pytest

from drake_starnav.evaluation.report.page import write_page
from drake_starnav.evaluation.report.recordings import Recording, choose_trials
from drake_starnav.evaluation.report.results import Results
from tests.helpers.browser import browser_missing, find_chromium
from tests.helpers.trials import made_up


class Report(NamedTuple):
    """What a page is made of."""

    results: Results
    recordings: Sequence[Recording] = ()
    worlds: int = 4


@pytest.fixture(scope="module")
def report() -> Report:
    results = made_up(trials=10, mean_clearance_m=0.4)
    recordings = choose_trials(results)
    recordings[0] = replace(recordings[0], file="report recordings/one & two.html", remark="<not the same>")
    return Report(results, recordings)


@pytest.fixture(scope="module")
def text(report) -> str:
    return write_page(*report)


@pytest.fixture(scope="module")
def page(text, tmp_path_factory):
    api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    if browser_missing() is not None:
        pytest.skip(f"there is no {browser_missing()}")
    file = tmp_path_factory.mktemp("page") / "report.html"
    file.write_text(text, encoding="utf-8")
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=find_chromium(), headless=True, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1100, "height": 800})
        page.requests, page.complaints = [], []
        page.on("request", lambda request: page.requests.append(request.url))
        page.on("console", lambda message: page.complaints.append(message.text))
        page.goto(file.as_uri())
        yield page
        browser.close()


@pytest.mark.slow
def test_without_error_and_network_it_fits_its_width_and_every_picture_is_drawn(page) -> None:
    assert page.complaints == []
    assert [url for url in page.requests if not url.startswith(("file:", "data:"))] == []
    assert page.evaluate("document.documentElement.scrollWidth") <= 1100
    widths = page.evaluate("[...document.images].map(image => image.complete && image.naturalWidth)")
    assert len(widths) == 5  # success, difficulty, path, two scenarios' trajectories
    assert all(width > 900 for width in widths)


@pytest.mark.slow
def test_on_a_narrow_screen_everything_fits_and_cells_have_labels(page) -> None:
    page.set_viewport_size({"width": 420, "height": 800})
    width = page.evaluate("document.documentElement.scrollWidth")
    pictures = page.evaluate("[...document.images].map(image => image.getBoundingClientRect().right)")
    label = "getComputedStyle(document.querySelector('#trials tbody td'), '::before').content"
    before = page.evaluate(label)
    page.set_viewport_size({"width": 1100, "height": 800})
    assert width <= 420
    assert max(pictures) <= 420
    assert (before, page.evaluate(label)) == ('"scenario"', "none")


@pytest.mark.slow
def test_tables_have_the_numbers(page, report) -> None:
    rows = page.evaluate("[...document.querySelectorAll('#success tbody tr')].map(r => r.innerText.split('\\t'))")
    results = report.results
    cases = [(s, m) for s in results.scenarios for m in results.methods]
    assert [tuple(row[:2]) for row in rows] == cases
    for row, case in zip(rows, cases, strict=True):
        assert int(row[3]) == sum(r["outcome"] == "reached" for r in results.of(*case))


@pytest.mark.slow
def test_chosen_trials_are_linked_or_say_how_to_see_them_and_all_how_to_reproduce_them(page, report) -> None:
    rows = page.query_selector_all("#trials tbody tr")
    assert len(rows) == len(report.recordings)
    link = rows[0].query_selector("a")
    assert link.get_attribute("href") == "report%20recordings/one%20%26%20two.html"
    assert "<not the same>" in rows[0].inner_text()
    assert report.results.make_trial_command(report.recordings[1].record) in rows[1].inner_text()

    text = page.inner_text("#reproduce")
    assert report.results.list_commands()[0] in text
    for value in report.results.headers[0]["versions"].values():
        assert value in text


@pytest.fixture
def few() -> Report:
    return Report(made_up(scenarios=("room",), trials=1), worlds=1)


def test_a_suite_s_table_stands_in_a_section_of_its_own(few) -> None:
    assert 'id="published"' not in write_page(*few)
    header = {**few.results.headers[0], "suite": "table1"}
    text = write_page(*few._replace(results=replace(few.results, headers=(header,))))
    published, success, cost = (text.index(f'<section id="{name}">') for name in ("published", "success", "cost"))
    assert published < text.index("<h3>Table I of") < success < text.index("<h3>How the trials ended") < cost


def test_files_of_different_versions_are_told_apart(few) -> None:
    first = few.results.headers[0]
    assert "different versions" not in write_page(*few)
    other = {**first, "versions": {**first["versions"], "git": "0123456789ab"}}
    text = write_page(*few._replace(results=replace(few.results, headers=(first, other))))
    assert f"({first['versions']['git']})" in text and "(0123456789ab)" in text
    assert "files of different versions" in text
