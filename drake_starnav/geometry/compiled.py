"""How small functions are compiled that loops call."""

from numba import njit

leaf = njit(cache=True, error_model="numpy", forceinline=True)
"""For functions that divide by nothing that may be zero: inlined, and without exceptions, they let Numba leave out the
counting of references to the arrays that a loop passes to them, which would cost more than what they do."""
