"""What holds for every test: the same examples in each run, one thread, and no lines that depend on the machine."""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before scikit-learn is loaded: its threads cost more than they save

from hypothesis import settings  # noqa: E402

from drake_starnav.utils import progress  # noqa: E402

progress.FIRST_LINE = 3600.0  # it comes when a task takes long
settings.register_profile("repeatable", derandomize=True, deadline=None, database=None)
settings.load_profile("repeatable")
