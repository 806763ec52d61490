import re

import numpy as np
from numba import njit

from drake_starnav.geometry.compiled import put
from drake_starnav.surroundings.region_union import covers


@njit
def _covered(center, bearing_0, values, places):
    count = 0
    for i in range(len(places)):
        count += covers(center, bearing_0, values, 0, places[i, 0], places[i, 1], 0.0)
    return count


def test_a_loop_over_a_leaf_counts_no_references():
    assert _covered(np.zeros((1, 2)), np.zeros(1), np.ones((1, 8)), np.array(((0.5, 0.0), (2.0, 0.0)))) == 1
    (compiled,) = _covered.inspect_llvm().values()
    assert not re.search(r"call void @NRT_incref", compiled)


def test_a_tuple_is_put_into_a_row():
    rows = np.zeros((2, 3))
    put(rows, 1, (1.0, 2.0, 3.0))
    np.testing.assert_array_equal(rows, [[0.0, 0.0, 0.0], [1.0, 2.0, 3.0]])
