"""What holds for every test: the same examples in each run, one thread, and no lines that depend on the machine."""

import os
import time

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before scikit-learn is loaded: its threads cost more than they save

import pytest  # noqa: E402
from hypothesis import settings  # noqa: E402

from drake_starnav.utils import progress  # noqa: E402

progress.FIRST_LINE = 3600.0  # it comes when a task takes long
settings.register_profile("repeatable", derandomize=True, deadline=None, database=None)
settings.register_profile("random", deadline=None)  # of `make fuzz`; what it finds is kept in .hypothesis
settings.load_profile("repeatable")


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip what would begin after the time of `make fuzz`."""
    if time.time() > float(os.environ.get("FUZZ_UNTIL", "inf")):
        pytest.skip("the time is over")
