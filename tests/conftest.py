"""What holds for every test: the same examples in each run, and one thread."""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before scikit-learn is loaded: its threads cost more than they save

from hypothesis import settings  # noqa: E402

settings.register_profile("repeatable", derandomize=True, deadline=None, database=None)
settings.load_profile("repeatable")
