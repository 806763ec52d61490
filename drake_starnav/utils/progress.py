"""How far something is and how long it will take yet: a bar on a terminal, elsewhere a line from time to time."""

import multiprocessing
import shutil
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

FIRST_LINE, LONGEST_SILENCE = 10.0, 600.0
"""Without a terminal, the first line comes after so long, each next one after twice the time, at most the second, s."""


class Progress:
    """Shows one task on standard error until it is closed, whenever something is reported about it."""

    silent = multiprocessing.parent_process() is not None
    """Whether nothing is shown; by default it is not in the workers of another process."""

    def __init__(self, label: str) -> None:
        """Begins a task of that label."""
        self._label, self._share = label, 0.0
        self._bar: Any = None
        self._gap, self._next = FIRST_LINE, time.monotonic() + FIRST_LINE
        self.restart()
        self.show(0.0)

    def restart(self) -> None:
        """Count the time from now on."""
        self._begun = time.monotonic()

    def show(self, share: float, detail: str = "", at_most: bool = False) -> None:
        """Report where the task is; what is left of it takes as long, for its share, as what is done.

        Args:
            share: that is done, 0 to 1; 0 as long as it is unknown.
            detail: where it is, in words.
            at_most: whether the time left is a bound and not an estimate.
        """
        self._share = share
        if self.silent or sys.stderr is None:
            return
        from tqdm import tqdm  # late: few need it

        now, left = time.monotonic(), self.left()
        words = [f"{tqdm.format_interval(now - self._begun)} so far"]
        if left is not None:
            words.append(f"{'at most' if at_most else 'about'} {tqdm.format_interval(max(left, 1.0))} left")
        if sys.stderr.isatty():
            if self._bar is None:
                columns, rows = shutil.get_terminal_size()  # 80 x 24 where the terminal says 0
                look = {"bar_format": "{desc} {bar} {postfix}", "ncols": columns, "nrows": rows}
                self._bar = tqdm(total=1.0, leave=False, file=sys.stderr, **look)
            self._bar.n = min(share, 1.0)
            self._bar.set_description_str(": ".join(filter(None, (self._label, detail))), refresh=False)
            self._bar.set_postfix_str(", ".join(words), refresh=False)
            self._bar.refresh()
        elif now >= self._next:
            self._gap = min(2.0 * self._gap, LONGEST_SILENCE)
            self._next = now + self._gap
            self.say(f"{self._label}: {', '.join(filter(None, (detail, *words)))}")

    def count(self, done: int, total: int) -> None:
        """Report that so many of equal parts are done."""
        self.show(done / max(total, 1), f"{done} of {total}")

    def left(self) -> float | None:
        """Time that the rest takes, s; None if unknown."""
        return (time.monotonic() - self._begun) * (1.0 / self._share - 1.0) if self._share > 0.0 else None

    def say(self, text: str) -> None:
        """Print a line, above the bar if there is one."""
        if self.silent or sys.stderr is None:
            return
        if self._bar is not None:
            self._bar.write(text, file=sys.stderr)
        else:
            print(text, file=sys.stderr, flush=True)

    def close(self) -> None:
        """Remove the bar; a later report shows it again."""
        if self._bar is not None:
            self._bar.close()
            self._bar = None

    def __enter__(self) -> "Progress":
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


@contextmanager
def silence(whether: bool) -> Iterator[None]:
    """A block in which no progress is shown, if `whether`."""
    before = Progress.silent
    Progress.silent = before or whether
    try:
        yield
    finally:
        Progress.silent = before
