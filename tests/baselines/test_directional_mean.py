import math

import numpy as np
import pytest

from drake_starnav.baselines.directional_mean import directional_mean


def mean_angle(degrees, weights):
    angles = np.radians(degrees)
    x, y = directional_mean(np.array((1.0, 0.0)), np.column_stack((np.cos(angles), np.sin(angles))), np.array(weights))
    return math.degrees(math.atan2(y, x))


@pytest.mark.parametrize(
    ("degrees", "weights", "mean"),
    [
        ([30.0, 60.0], [0.5, 0.5], 45.0),
        ([-170.0, 170.0], [0.5, 0.5], 0.0),  # angles about the reference, not the shorter way round
        ([120.0, -60.0], [0.75, 0.25], 75.0),  # opposed vectors still have a mean
        ([180.0, 0.0], [0.5, 0.5], 90.0),
        ([33.0, 99.0], [1.0, 0.0], 33.0),
    ],
)
def test_mean_of_angles(degrees, weights, mean):
    assert mean_angle(degrees, weights) == pytest.approx(mean)


def test_a_vanished_vector_leaves_its_weight_to_the_reference():
    vectors = np.array([(0.0, 0.0), (0.0, 1.0)])
    x, y = directional_mean(np.array((1.0, 0.0)), vectors, np.array([0.5, 0.5]))
    assert math.atan2(y, x) == pytest.approx(math.pi / 4.0)
