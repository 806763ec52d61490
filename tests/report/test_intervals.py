"""Bootstrap intervals hold the true ratio as often as they should."""

import numpy as np
import pytest

from drake_starnav.report.intervals import ratio_interval


def test_equal_samples_have_a_ratio_of_one_without_doubt() -> None:
    values = np.random.default_rng(1).uniform(1.0, 5.0, 20)
    assert ratio_interval(values, values) == (1.0, 1.0, 1.0)
    assert ratio_interval(2.0 * values, values) == pytest.approx((2.0, 2.0, 2.0))


def test_the_interval_holds_the_truth_about_as_often_as_it_says() -> None:
    rng = np.random.default_rng(2)
    held = 0
    for _ in range(200):
        below = rng.uniform(1.0, 3.0, 40)
        ratio, low, high = ratio_interval(below * rng.normal(1.3, 0.2, 40), below)
        assert low <= ratio <= high
        held += low <= 1.3 <= high
    assert 180 <= held <= 198


def test_more_trials_make_it_narrower() -> None:
    rng = np.random.default_rng(3)
    below = rng.uniform(1.0, 3.0, 1600)
    above = below * rng.normal(1.3, 0.2, 1600)
    widths = [high - low for _, low, high in (ratio_interval(above[:n], below[:n]) for n in (25, 100, 400, 1600))]
    assert widths == sorted(widths, reverse=True)
