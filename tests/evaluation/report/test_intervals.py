"""Bootstrap intervals hold the true ratio as often as they should."""

import numpy as np
import pytest

from drake_starnav.evaluation.report.intervals import ratio_interval


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


def test_it_holds_the_truth_of_few_and_skewed_paths_more_often_than_percentiles_of_resamples() -> None:
    """Detours of a few worlds make the mean; those percentiles hold it in 74 % of such samples of ten."""
    rng = np.random.default_rng(1)
    truth, held = 1.0 + np.exp(-2.0 + 0.5 * 1.2**2), 0
    for _ in range(300):
        shortest = rng.uniform(8.0, 20.0, 10)
        _, low, high = ratio_interval(shortest * (1.0 + rng.lognormal(-2.0, 1.2, 10)), shortest)
        held += low <= truth <= high
    assert held / 300 >= 0.87


def test_too_few_trials_have_no_interval() -> None:
    ratio, low, high = ratio_interval([2.0, 3.0, 4.0, 5.0], [1.0, 2.0, 3.0, 4.0])
    assert ratio == 1.4
    assert not np.isfinite([low, high]).any()


def test_one_trial_that_differs_does_not_tell_how_much_the_others_might() -> None:
    values = np.full(20, 5.0)
    ratio, low, high = ratio_interval([6.0, *values[1:]], values)
    assert ratio == pytest.approx(1.01)
    assert low <= ratio and not np.isfinite(high)
