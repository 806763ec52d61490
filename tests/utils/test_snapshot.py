"""Snapshots are themselves, and nobody else."""

import copy

import numpy as np
from pydrake.common.value import Value

from drake_starnav import LaserScan, World
from drake_starnav.utils.snapshot import snapshot


@snapshot
class Seen:
    hits: np.ndarray
    time: float = 0.0


def test_a_snapshot_is_equal_to_itself_alone() -> None:
    one, other = Seen(np.zeros(3)), Seen(np.zeros(3))
    assert one == one and one != other and one in [other, one]
    assert len({one, other}) == 2
    for make in (LaserScan.nothing, lambda: World("w", (0, 0, 0), (1, 0), cylinders=[(5, 5, 1), (7, 5, 1)])):
        first, second = make(), make()
        assert first == first and first != second


def test_a_copy_is_itself_for_drake_too() -> None:
    seen = Seen(np.zeros(3), time=1.0)
    assert copy.deepcopy(seen) is seen
    assert Value(seen).Clone().get_value() is seen
