"""How the package's functions are compiled, and small ones that loops call."""

from numba import njit

import drake_starnav.utils.compilation  # noqa: F401  (shows what is compiled)

kernel = njit(cache=True, error_model="numpy")
"""For all of them. A division by zero gives inf or NaN, as in NumPy: exceptions would take longer to compile."""
leaf = njit(cache=True, error_model="numpy", forceinline=True)
"""For what loops call: inlined, it lets Numba leave out the counting of references to the arrays that are passed to it,
which would cost more than what it does."""


@leaf
def put(rows, k, values):
    """As `rows[k] = values` of a tuple, which takes Numba 2 s to compile; a literal k would compile it once more."""
    for j in range(len(values)):
        rows[k, j] = values[j]


@kernel
def largest(values):
    """The largest of some numbers (n,), n >= 1; the array's own `max` takes Numba ten times as long to compile."""
    most = values[0]
    for value in values:
        most = max(most, value)
    return most
