import re

import numpy as np
from numba import njit

from drake_starnav.regions.star_region import covers_offset


@njit
def _covered(bearing_0, values, k, offsets):
    count = 0
    for i in range(len(offsets)):
        count += covers_offset(bearing_0, values, k, offsets[i, 0], offsets[i, 1])
    return count


def test_a_loop_over_a_leaf_counts_no_references():
    assert _covered(np.zeros(1), np.ones((1, 8)), 0, np.array(((0.5, 0.0), (2.0, 0.0)))) == 1
    (compiled,) = _covered.inspect_llvm().values()
    assert not re.search(r"call void @NRT_incref", compiled)
