"""How far something is and how long it will take yet: a bar on a terminal, elsewhere a line from time to time."""

import multiprocessing
import shutil
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

REFRESH = 0.5
"""Period of the bar while nothing is reported, s."""
TERMINAL = 80, 24
"""Columns and rows of a terminal that says that it has none, as those that programs open for others."""
FIRST_LINE, LONGEST_SILENCE = 10.0, 600.0
"""Without a terminal, the first line comes after so long, each next one after twice the time, at most the second, s."""


class Progress:
    """Shows one task on standard error until it is closed; of several that are open, the newest."""

    silent = multiprocessing.parent_process() is not None
    """Whether new ones show nothing; by default they do not in the workers of another process."""
    _open: list["Progress"] = []
    _lock = threading.RLock()

    def __init__(self, label: str) -> None:
        """Begins a task of that label."""
        self._label, self._share, self._detail, self._bound = label, 0.0, "", "about"
        self._begun = time.monotonic()
        self._gap, self._next = FIRST_LINE, self._begun + FIRST_LINE
        self._bar: Any = None
        self._closed = threading.Event()
        if self.silent or sys.stderr is None:
            self._closed.set()
            return
        with self._lock:
            if sys.stderr.isatty():
                from tqdm import tqdm  # late: few need it

                if self._open and self._open[-1]._bar is not None:
                    self._open[-1]._bar.clear()
                columns = shutil.get_terminal_size(TERMINAL)[0]
                look = {"bar_format": "{desc} {bar} {postfix}", "ncols": columns, "nrows": TERMINAL[1]}
                self._bar = tqdm(total=1.0, leave=False, file=sys.stderr, **look)
            self._open.append(self)
            self._draw()
        threading.Thread(target=self._tick, daemon=True).start()

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
        with self._lock:
            self._share, self._detail, self._bound = share, detail, "at most" if at_most else "about"
            self._draw()

    def count(self, done: int, total: int) -> None:
        """Report that so many of equal parts are done."""
        self.show(done / max(total, 1), f"{done} of {total}")

    def left(self) -> float | None:
        """Time that the rest takes, s; None if unknown."""
        return (time.monotonic() - self._begun) * (1.0 / self._share - 1.0) if self._share > 0.0 else None

    def say(self, text: str) -> None:
        """Print a line, above the bar if there is one."""
        with self._lock:
            if self._closed.is_set():
                return
            if self._bar is not None:
                self._bar.write(text, file=sys.stderr)
            else:
                print(text, file=sys.stderr, flush=True)

    def close(self) -> None:
        """Remove the bar; its time is no part of the task below, of what is compiled on the way."""
        with self._lock:
            self._closed.set()
            if self in self._open:
                self._open.remove(self)
                for below in self._open[-1:]:
                    below._begun += time.monotonic() - max(self._begun, below._begun)
            if self._bar is not None:
                self._bar.close()
                self._bar = None

    def __enter__(self) -> "Progress":
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def _tick(self) -> None:
        while not self._closed.wait(REFRESH):
            with self._lock:
                self._draw()

    def _draw(self) -> None:
        """Draw the bar, or print a line if one is due; the lock is held."""
        if self not in self._open[-1:]:
            return
        now = time.monotonic()
        words = [f"{duration_text(now - self._begun)} so far"]
        left = self.left()
        if left is not None:
            words.append(f"{self._bound} {duration_text(max(left, 1.0))} left")
        if self._bar is not None:
            self._bar.n = min(self._share, 1.0)
            self._bar.set_description_str(": ".join(filter(None, (self._label, self._detail))), refresh=False)
            self._bar.set_postfix_str(", ".join(words), refresh=False)
            self._bar.refresh()
        elif now >= self._next:
            self._gap = min(2.0 * self._gap, LONGEST_SILENCE)
            self._next = now + self._gap
            self.say(f"{self._label}: {', '.join(filter(None, (self._detail, *words)))}")


@contextmanager
def silence(whether: bool) -> Iterator[None]:
    """A block in which no progress is shown, if `whether`."""
    before = Progress.silent
    Progress.silent = before or whether
    try:
        yield
    finally:
        Progress.silent = before


def duration_text(seconds: float) -> str:
    """A time in words, with two digits."""
    for size, unit in ((3600.0, "h"), (60.0, "min")):
        if seconds >= 1.5 * size:
            return f"{seconds / size:.1f} {unit}" if seconds < 9.95 * size else f"{seconds / size:.0f} {unit}"
    return f"{seconds:.0f} s"
