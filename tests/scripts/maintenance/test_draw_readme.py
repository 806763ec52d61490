"""README's picture shows what `make demo` drives, and its caption says so."""

from drake_starnav.scenario.scenario_file import load_scenario
from drake_starnav.simulation.run import run_trial
from drake_starnav.simulation.trial import make_caption_lines
from scripts.maintenance import draw_readme

DRAW = f"run {draw_readme.SECTION[1]}"


def test_the_caption_is_that_of_the_picture() -> None:
    assert draw_readme.README.read_text(encoding="utf-8") == draw_readme.text(), DRAW


def test_the_picture_shows_what_the_demo_drives() -> None:
    trial = run_trial(load_scenario("forest"))
    said = ", ".join(make_caption_lines(trial)).replace("\u00a0", " ")
    assert draw_readme.caption() == f"forest, {said}", DRAW
