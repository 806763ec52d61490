"""Reports on many trials: tables, plots, trajectories and recordings, on a page that opens offline."""

from drake_starnav.evaluation.report.page import write_page
from drake_starnav.evaluation.report.recordings import Recording, chosen_trials, record_chosen
from drake_starnav.evaluation.report.results import Results, read_results
from drake_starnav.evaluation.report.tables import result_tables, summary_csv, tables_markdown

__all__ = [
    "Recording",
    "Results",
    "chosen_trials",
    "read_results",
    "record_chosen",
    "result_tables",
    "summary_csv",
    "tables_markdown",
    "write_page",
]
