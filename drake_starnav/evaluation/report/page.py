"""The report as one HTML page that asks nothing of a network."""

import base64
import html
from collections.abc import Sequence
from dataclasses import dataclass, field
from urllib.parse import quote

from drake_starnav.evaluation.report import figures
from drake_starnav.evaluation.report.recordings import Recording
from drake_starnav.evaluation.report.results import Results
from drake_starnav.evaluation.report.tables import result_tables, suite_tables
from drake_starnav.evaluation.summary import Table

WORLDS = 12
"""So many worlds of each scenario are drawn."""


@dataclass(frozen=True)
class Report:
    """What a page is made of.

    Attributes:
        results: the trials.
        recordings: the trials chosen to be looked at, see `record_chosen`.
        worlds: how many worlds of each scenario are drawn.
    """

    results: Results
    recordings: Sequence[Recording] = field(default_factory=list)
    worlds: int = WORLDS


def write_page(report: Report) -> str:
    """The text of the page.

    Raises:
        StarnavError: matplotlib is not installed.
    """
    results = report.results
    ends, *costs = result_tables(results)
    sections = [
        ("published", "Beside the published figures", _titled(suite_tables(results))),
        ("success", "Who reaches the goal", _success(results) + _titled([ends])),
        ("cost", "At what cost", _cost(results) + _titled(costs)),
        ("difficulty", "Success against difficulty", _difficulty(results)),
        ("trajectories", "Trajectories", _trajectories(report)),
        ("trials", "Trials to look at", _recordings(report)),
        ("reproduce", "How to reproduce it", _reproduction(results)),
    ]
    sections = [section for section in sections if section[2]]
    links = " · ".join(f'<a href="#{name}">{title}</a>' for name, title, _ in sections)
    body = "".join(f'<section id="{name}"><h2>{title}</h2>{text}</section>' for name, title, text in sections)
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        # The browser itself sees to it that nothing is fetched.
        '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; img-src data:; '
        "style-src 'unsafe-inline'\">"
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{_heading(results)}</title><style>{_STYLE}</style></head>"
        f"<body><h1>{_heading(results)}</h1><p>{_lead(results)}</p><nav>{links}</nav>{body}</body></html>\n"
    )


def _heading(results: Results) -> str:
    return html.escape(f"{', '.join(results.methods)} in {', '.join(results.scenarios)}")


def _lead(results: Results) -> str:
    reached = sum(record["outcome"] == "reached" for record in results.records)
    made = dict.fromkeys(
        f"drake_starnav {v['drake_starnav']} (source {v['source']}), Drake {v['drake']}"
        for v in (header["versions"] for header in results.headers)
    )
    different = ": files of different versions" if len(made) > 1 else ""
    return html.escape(
        f"{len(results.records)} trials, {reached} of which reached the goal; {'; '.join(made)}{different}."
    )


def _titled(tables: Sequence[tuple[str, Table]]) -> str:
    return "".join(f"<h3>{html.escape(title)}</h3>{_table(table)}" for title, table in tables)


def _table(table: Table) -> str:
    """Cells as HTML; those that begin like a number stand to the right."""
    head, rows = table
    numeric = [all(row[k][:1] in "0123456789-" for row in rows) for k in range(len(head))]
    kinds = [' class="number"' if right else "" for right in numeric]
    cells = "".join(f"<th{kind}>{html.escape(cell)}</th>" for kind, cell in zip(kinds, head, strict=True))
    lines = [
        "".join(f"<td{kind}>{html.escape(cell)}</td>" for kind, cell in zip(kinds, row, strict=True)) for row in rows
    ]
    body = "".join(f"<tr>{line}</tr>" for line in lines)
    return f'<div class="wide"><table><thead><tr>{cells}</tr></thead><tbody>{body}</tbody></table></div>'


def _figure(figure: "figures.Figure | None", words: str) -> str:
    """A figure as an image inside the page, or nothing."""
    if figure is None:
        return ""
    data = base64.b64encode(figures.svg(figure).encode()).decode()
    return f'<img alt="{html.escape(words)}" src="data:image/svg+xml;base64,{data}">'


def _success(results: Results) -> str:
    return _figure(
        figures.success_figure(results), "success rates with their intervals; the table below has the numbers"
    )


def _cost(results: Results) -> str:
    pictures = [
        _figure(figures.path_figure(results), "path over shortest path"),
        _figure(figures.comparison_figure(results, "time_s", "time"), "time compared with the first method"),
        _figure(figures.comparison_figure(results, "path_length_m", "path length"), "path compared with the first"),
    ]
    said = (
        "<p>The shortest path is that of an omniscient robot of the same radius from start to goal; a trial ends a "
        "little before the goal, so that the ratio may be below 1. Intervals are of 95 %, by the bootstrap-t method; "
        "there is none where the trials cannot tell it, as fewer than five. Times of steps are medians over the "
        "trials.</p>"
    )
    return said + "".join(pictures)


def _difficulty(results: Results) -> str:
    picture = _figure(figures.difficulty_figure(results), "success rate against two measures of difficulty")
    if not picture:
        return ""
    return (
        "<p>Worlds of all scenarios, in bins of about as many worlds each; a marker stands at the bin's median, its "
        "bar is the 95 % Wilson interval. Left: how much longer the shortest path is than the straight line. Right: "
        "the shortest line between two obstacles through a point of the shortest path (the characteristic dimension of "
        "Perille et al., 2020).</p>" + picture
    )


def _trajectories(report: Report) -> str:
    parts = []
    for scenario in report.results.scenarios:
        picture = _figure(
            figures.trajectory_figure(report.results, scenario, report.worlds), f"driven paths in worlds of {scenario}"
        )
        if picture:
            parts.append(f"<h3>{html.escape(scenario)}</h3>{picture}")
    if not parts:
        return ""
    said = (
        f"<p>The first {report.worlds} worlds of each scenario, whatever happened there. Dot: start; star: goal; "
        "cross: where a trial that failed ended. Above each: the trial, shortest path over straight line, tightest gap "
        "in metres.</p>"
    )
    return said + "".join(parts)


def _recordings(report: Report) -> str:
    if not report.recordings:
        return ""
    rows = []
    for recording in report.recordings:
        record = recording.record
        command = f"<code>{html.escape(report.results.trial_command(record))}</code>"
        link = f'<a href="{quote(recording.file)}">recording</a>' if recording.file else command
        remark = f"<br>{html.escape(recording.remark)}" if recording.remark else ""
        cells = (record["scenario"], record["method"], record["trial"], recording.reason, f"{record['time_s']:.1f}")
        rows.append("".join(f"<td>{html.escape(str(cell))}</td>" for cell in cells) + f"<td>{link}{remark}</td>")
    head = "".join(f"<th>{name}</th>" for name in ("scenario", "method", "trial", "why", "time s", "see it"))
    body = "".join(f"<tr>{row}</tr>" for row in rows)
    return (
        "<p>Each failure, and of each scenario and method the median and the worst success by time over shortest path. "
        "Recordings lie in a folder beside this page and need no network either; a trial without one says how to make "
        f'it.</p><div class="wide"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'
    )


def _reproduction(results: Results) -> str:
    commands = "".join(f"<pre>{html.escape(command)}</pre>" for command in results.commands())
    rows = []
    for header in results.headers:
        facts = {**header["versions"], **header["machine"], "seed": header["seed"]}
        rows += [(name.replace("_", " "), str(value)) for name, value in facts.items()]
    texts = "".join(
        f"<details><summary>parameters of {html.escape(f'{scenario}, {method}')}</summary>"
        f"<pre>{html.escape(text)}</pre></details>"
        for (scenario, method), text in results.texts.items()
    )
    return f"{commands}{_table((('what', 'was'), list(dict.fromkeys(rows))))}{texts}"


_STYLE = (
    "body{max-width:1060px;margin:24px auto;padding:0 20px;color:#1a1a1a;background:#fff;"
    "font:15px/1.5 system-ui,-apple-system,'Segoe UI',sans-serif}"
    "h1{font-size:26px;margin:0 0 4px}h2{font-size:20px;margin:36px 0 8px;border-bottom:1px solid #ccc}"
    "h3{font-size:15px;margin:20px 0 6px}nav{margin:12px 0}a{color:#0050a0}"
    "img{display:block;width:100%;height:auto;margin:10px 0}.wide{overflow-x:auto}"
    "table{border-collapse:collapse;font-size:13px;font-variant-numeric:tabular-nums}"
    "th,td{padding:3px 9px;border-bottom:1px solid #e4e4e4;text-align:left;vertical-align:top}"
    "th{border-bottom:1px solid #888}.number{text-align:right;white-space:nowrap}tbody tr:hover{background:#f4f7fb}"
    "pre,code{background:#f4f4f4;font:12.5px/1.45 ui-monospace,Menlo,Consolas,monospace}"
    "pre{padding:8px 10px;overflow-x:auto;white-space:pre-wrap;overflow-wrap:anywhere}"
    "code{overflow-wrap:anywhere}#trials td:not(:last-child){white-space:nowrap}"
    "details{margin:6px 0}summary{cursor:pointer}"
)
