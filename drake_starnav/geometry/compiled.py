"""How the package's functions are compiled, and small ones that loops call."""

from numba import njit

from drake_starnav.utils.compilation import SourcesCache


def kernel(function, **options):
    """Have Numba compile a function when it is called first, or load it from the cache.

    A division by zero gives inf or NaN, as in NumPy: exceptions would take longer to compile. A constant that one
    kernel hands to another is an `np.int64` or `np.bool_`: for a literal that would be compiled once more.
    """
    dispatcher = njit(error_model="numpy", **options)(function)
    dispatcher._cache = SourcesCache(function)  # as its `enable_caching` would with Numba's own
    return dispatcher


def leaf(function):
    """The same for what loops call: inlined, it lets Numba leave out the counting of references to the arrays.

    That would cost more than what it does.
    """
    return kernel(function, forceinline=True)


@leaf
def put(rows, k, values):
    """As `rows[k] = values` of a tuple, which takes Numba 2 s to compile."""
    for j in range(len(values)):
        rows[k, j] = values[j]


@kernel
def find_largest(values):
    """The largest of some numbers (n,), n >= 1; the array's own `max` takes Numba ten times as long to compile."""
    greatest_value = values[0]
    for value in values:
        greatest_value = max(greatest_value, value)
    return greatest_value
