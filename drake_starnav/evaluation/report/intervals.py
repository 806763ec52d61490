"""Confidence intervals of ratios, by bootstrap."""

from collections.abc import Sequence

import numpy as np

RESAMPLES = 2000
"""With this number the ends of an interval are accurate to about a tenth of its width."""
LEAST_PAIRS = 5
"""With fewer pairs the scatter cannot be estimated."""


def ratio_interval(numerators: Sequence[float], denominators: Sequence[float]) -> tuple[float, float, float]:
    """The ratio of the sums of two paired samples, and its 95 % confidence interval; reproducible.

    If a few long paths dominate the ratio, the interval is still too narrow: for two such distributions of synthetic
    trials it covered the true ratio in 74 and 91 % of samples of 10, and in 94 and 92 % of samples of 100. Other
    intervals covered it less often in samples of 10: percentiles of the ratio 57 and 74 %, BCa 61 and 78 %, Student's
    t of the linearised ratio 59 and 78 %.

    Args:
        numerators, denominators: n >= 1 positive values each; the k-th of both belong to one trial.

    Returns:
        Ratio, lower end, upper end; the ends are not finite if the sample does not determine them: with fewer than
        `LEAST_PAIRS` trials, or if almost all trials have the same ratio.

    Source: the bootstrap-t method, of the ratio's logarithm, of B. Efron and R. Tibshirani, An introduction to the
    bootstrap, 1993, 12.5.
    """
    pairs = np.column_stack((numerators, denominators)).astype(float)
    ratio, error = (float(x) for x in _log_ratio(pairs))
    if len(pairs) < LEAST_PAIRS:
        return float(np.exp(ratio)), np.nan, np.nan
    if error < 1e-9:
        return (float(np.exp(ratio)),) * 3
    drawn = np.random.default_rng(0).integers(len(pairs), size=(RESAMPLES, len(pairs)))
    ratios, errors = _log_ratio(pairs[drawn])
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        high, low = np.percentile((ratios - ratio) / errors, (2.5, 97.5), method="nearest")
        ends = np.exp(ratio - error * np.array((low, high)))
    return float(np.exp(ratio)), float(ends[0]), float(ends[1])


def _log_ratio(pairs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The logarithm of the ratio of sums and its standard error, each of shape (...), of pairs (..., n, 2)."""
    above, below = pairs.sum(axis=-2)[..., 0], pairs.sum(axis=-2)[..., 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        residuals = pairs[..., 0] / above[..., None] - pairs[..., 1] / below[..., None]
        n = pairs.shape[-2]
        return np.log(above / below), np.sqrt((residuals**2).sum(axis=-1) * n / max(n - 1, 1))
