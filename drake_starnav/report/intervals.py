"""Confidence intervals of means and ratios, by bootstrap."""

from collections.abc import Sequence

import numpy as np

RESAMPLES = 2000
"""So many give the ends of an interval to about a tenth of its width."""


def ratio_interval(numerators: Sequence[float], denominators: Sequence[float]) -> tuple[float, float, float]:
    """The ratio of two paired samples' sums, and its 95 % confidence interval; the same in each run.

    Args:
        numerators, denominators: n >= 1 values each, the denominators positive; the k-th of both are of one trial.

    Returns:
        Ratio, lower end, upper end.

    Source: the percentile method of B. Efron, Bootstrap methods: another look at the jackknife, 1979.
    """
    pairs = np.column_stack((numerators, denominators))
    drawn = np.random.default_rng(0).integers(len(pairs), size=(RESAMPLES, len(pairs)))
    sums = pairs[drawn].sum(axis=1)
    low, high = np.percentile(sums[:, 0] / sums[:, 1], (2.5, 97.5))
    return float(pairs[:, 0].sum() / pairs[:, 1].sum()), float(low), float(high)
