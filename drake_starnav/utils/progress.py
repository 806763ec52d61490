"""How far something is and how long it will take yet: a bar on a terminal, elsewhere a line a minute."""

import multiprocessing
import shutil
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

SILENCE = 60.0
"""Time between two lines where there is no terminal, s."""


class Progress:
    """Shows one task on standard error until it is closed, whenever something is reported about it."""

    silent = multiprocessing.parent_process() is not None
    """Whether nothing is shown; by default it is not in the workers of another process."""

    def __init__(self, label: str) -> None:
        """Begins a task of that label."""
        from tqdm import tqdm  # late: few need it

        tqdm.set_lock(threading.RLock())  # its own holds a semaphore of the machine, which Ctrl-C would leave
        self._label, self._spoken = label, time.monotonic()
        self.silent = self.silent or sys.stderr is None
        columns, rows = shutil.get_terminal_size()  # 80 x 24 where the terminal says 0
        bar_look = {"bar_format": "{desc} {bar} {elapsed} so far{postfix}", "ncols": columns, "nrows": rows}
        is_hidden = self.silent or not sys.stderr.isatty()
        self._bar: Any = tqdm(total=1.0, desc=label, leave=False, disable=is_hidden, smoothing=0.0, **bar_look)

    def restart(self) -> None:
        """Count the time from now on."""
        self._bar.reset()

    def show(self, share: float, detail: str = "") -> None:
        """Report which share of the task is done, 0 to 1, and where it is, in words."""
        self._bar.n = min(share, 1.0)
        self._bar.set_postfix_str(detail)
        if self._bar.disable and time.monotonic() > self._spoken + SILENCE:
            self._spoken = time.monotonic()
            self.say(f"{self._label}: {detail}")

    def count(self, done: int, total: int) -> None:
        """Report how many of equal parts are done."""
        self.show(done / max(total, 1), f"{done} of {total}")

    def say(self, text: str) -> None:
        """Print a line, above the bar if there is one."""
        if not self.silent:
            self._bar.write(text, file=sys.stderr)

    def hide(self) -> None:
        """Remove the bar until the next report."""
        if not self._bar.disable:
            self._bar.clear()

    def __enter__(self) -> "Progress":
        return self

    def __exit__(self, *error: object) -> None:
        self._bar.close()


@contextmanager
def silence_progress(whether: bool) -> Iterator[None]:
    """A block in which no progress is shown, if `whether`."""
    was_silent = Progress.silent
    Progress.silent = was_silent or whether
    try:
        yield
    finally:
        Progress.silent = was_silent
