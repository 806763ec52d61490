"""The report as one HTML page that requests nothing from a network; its template is page.html."""

import base64
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from drake_starnav.errors import StarnavError
from drake_starnav.evaluation.report import figures
from drake_starnav.evaluation.report.recordings import Recording
from drake_starnav.evaluation.report.results import Results
from drake_starnav.evaluation.report.tables import make_result_tables, make_suite_tables

if TYPE_CHECKING:
    from jinja2 import Template

SECTIONS = {
    "published": "Beside the published figures",
    "success": "Success rates",
    "cost": "Cost",
    "difficulty": "Success against difficulty",
    "trajectories": "Trajectories",
    "trials": "Trials to look at",
    "reproduce": "How to reproduce it",
}
"""Titles of the page's sections; those without content are left out."""
SUCCESS_IMAGE, DIFFICULTY_IMAGE = "success rate of each method", "success rate against difficulty"
PATH_IMAGE = "path over shortest path"
MADE_BY = "drake_starnav {drake_starnav} ({git}), Drake {drake}"

Draw = Callable[[], "figures.Figure | None"]
"""Draws a figure; None where there is nothing to show."""


def write_page(
    results: Results,
    recordings: Sequence[Recording] = (),
    worlds: int = 12,
    progress: Callable[[int, int], None] | None = None,
) -> str:
    """The text of the page; a `StarnavError` if matplotlib or jinja2 is not installed.

    Args:
        results, recordings: the trials, and those of them to be looked at, see `record_chosen`.
        worlds: number of worlds of each scenario that are drawn.
        progress: called after each picture with the number drawn and the number of all.
    """
    template = load_template()
    images = _draw_images(_list_drawings(results, worlds), progress)
    outcome_table, *cost_tables = make_result_tables(results)
    content = {
        "published": make_suite_tables(results),
        "success": images.get(SUCCESS_IMAGE),
        "difficulty": images.get(DIFFICULTY_IMAGE),
        "trajectories": {name: images[name] for name in results.scenarios if name in images},
        "trials": [(chosen, results.make_trial_command(chosen.record)) for chosen in recordings],
    }
    return template.render(
        content,
        sections={name: title for name, title in SECTIONS.items() if content.get(name, True)},
        heading=f"{', '.join(results.methods)} in {', '.join(results.scenarios)}",
        total=len(results.records),
        reached=sum(record["outcome"] == "reached" for record in results.records),
        made_by=list(dict.fromkeys(MADE_BY.format(**header["versions"]) for header in results.headers)),
        ends=[outcome_table],
        costs=cost_tables,
        path_image=images.get(PATH_IMAGE),
        worlds=worlds,
        commands=results.list_commands(),
        facts=_list_facts(results),
        texts=results.texts,
    )


def _list_drawings(results: Results, worlds: int) -> dict[str, Draw]:
    """What draws all pictures, by name; those of trajectories have the names of their scenarios."""
    return {
        SUCCESS_IMAGE: partial(figures.draw_success_figure, results),
        DIFFICULTY_IMAGE: partial(figures.draw_difficulty_figure, results),
        PATH_IMAGE: partial(figures.draw_path_figure, results),
        **{name: partial(figures.draw_trajectory_figure, results, name, worlds) for name in results.scenarios},
    }


def _draw_images(drawings: dict[str, Draw], progress: Callable[[int, int], None] | None) -> dict[str, str]:
    """The pictures as SVG in base64; a picture with nothing to show is left out."""
    images = {}
    for drawn_count, (name, draw) in enumerate(drawings.items(), start=1):
        figure = draw()
        if figure is not None:
            images[name] = base64.b64encode(figures.render_svg(figure).encode()).decode()
        if progress is not None:
            progress(drawn_count, len(drawings))
    return images


def load_template() -> "Template":
    """The template of the page; a `StarnavError` if jinja2 is not installed."""
    try:
        from jinja2 import Environment, FileSystemLoader
    except ImportError:
        raise StarnavError("jinja2 is not installed; allowed: pip install 'drake-starnav[report]'") from None
    template_loader = FileSystemLoader(Path(__file__).parent)
    environment = Environment(loader=template_loader, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    environment.globals["numeric"] = find_numeric_columns
    return environment.get_template("page.html")


def find_numeric_columns(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[bool]:
    """For each column, whether all its cells begin like a number; such columns are aligned to the right."""
    return [all(row[k][:1] in "0123456789-" for row in rows) for k in range(len(head))]


def _list_facts(results: Results) -> list[tuple[str, str]]:
    """Versions, machine and seed of each file, each line once."""
    facts = [{**header["versions"], **header["machine"], "seed": header["seed"]} for header in results.headers]
    return list(dict.fromkeys((name.replace("_", " "), str(value)) for file in facts for name, value in file.items()))
