"""Run many trials through an executor, store them in a file, summarise them."""

from drake_starnav.evaluation.cluster import dask_pool
from drake_starnav.evaluation.jobs import Case, Job, check_worlds, make_cases, make_jobs, run_job, trial_seed
from drake_starnav.evaluation.suites import SUITES, Suite, find_suite, suite_table
from drake_starnav.evaluation.summary import Comparison, Summary, compare, summarise, wilson_interval
from drake_starnav.evaluation.trial_file import TrialFile, case_files, make_header, read_trials
from drake_starnav.evaluation.workers import Pool, local_pool, run_batch, run_jobs

__all__ = [
    "Case",
    "Comparison",
    "Job",
    "Pool",
    "SUITES",
    "Suite",
    "Summary",
    "TrialFile",
    "case_files",
    "check_worlds",
    "compare",
    "dask_pool",
    "find_suite",
    "local_pool",
    "make_cases",
    "make_header",
    "make_jobs",
    "read_trials",
    "run_batch",
    "run_job",
    "run_jobs",
    "suite_table",
    "summarise",
    "trial_seed",
    "wilson_interval",
]
