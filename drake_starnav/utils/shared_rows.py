"""Arrays that grow by rows, shared by immutable values that extend one another."""

import numpy as np


class SharedRows:
    """Arrays with spare rows; of the values that share them, the first to use a row owns it."""

    def __init__(self, arrays: tuple[np.ndarray, ...], used: int) -> None:
        """
        Args:
            arrays: each with at least `used` rows.
            used: rows in use.
        """
        self.arrays, self.used = arrays, used

    @staticmethod
    def copied(arrays: tuple[np.ndarray, ...], rows: np.ndarray, spare: int = 0) -> "SharedRows":
        """Copies of some rows, shape (n,), with room for `spare` more and for as many again."""
        used = len(rows)
        larger = tuple(np.empty((2 * (used + spare) + 16, *array.shape[1:]), array.dtype) for array in arrays)
        for new, old in zip(larger, arrays, strict=True):
            np.take(old, rows, axis=0, out=new[:used], mode="clip")
        return SharedRows(larger, used)

    def extended(self, known: int, count: int, rows: tuple) -> "SharedRows":
        """The first `known` rows and `count` more, in the same memory if what lies behind them is unused.

        Args:
            known: rows of the value that is extended.
            count: new rows.
            rows: their values, for each array.
        """
        shared = self
        if self.used != known or known + count > len(self.arrays[0]):
            shared = SharedRows.copied(self.arrays, np.arange(known), count)
        for array, new in zip(shared.arrays, rows, strict=True):
            array[known : known + count] = new
        shared.used = known + count
        return shared

    @property
    def in_use(self) -> tuple[np.ndarray, ...]:
        """The rows in use of each array; views."""
        return tuple(array[: self.used] for array in self.arrays)
