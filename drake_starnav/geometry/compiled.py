"""How small functions are compiled that loops call."""

from numba import njit

leaf = njit(cache=True, error_model="numpy", forceinline=True)
"""For functions that divide by nothing that may be zero: inlined, and without exceptions, they let Numba leave out the
counting of references to the arrays that a loop passes to them, which would cost more than what they do."""


@leaf
def put(rows, k, values):
    """As `rows[k] = values` of a tuple, which takes Numba 2 s to compile; a literal k would compile it once more."""
    for j in range(len(values)):
        rows[k, j] = values[j]


@njit(cache=True)
def largest(values):
    """The largest of some numbers (n,), n >= 1; the array's own `max` takes Numba ten times as long to compile."""
    most = values[0]
    for value in values:
        most = max(most, value)
    return most
