import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_starnav.surroundings.piecewise_cubic import (
    JUMP,
    SMALLEST_SPLIT,
    PiecewiseCubic,
    fit_piecewise_cubic,
    fit_segments,
)
from tests.helpers.scans import RADIUS, seeds


def bumpy(seed: int, count: int = 720) -> np.ndarray:
    """A positive profile with curves, corners, jumps and noise."""
    rng = np.random.default_rng(seed)
    theta = 2.0 * math.pi / count * np.arange(count)
    samples = 2.5 + sum(rng.normal(0.0, 0.3) * np.cos(k * theta + rng.uniform(0.0, 6.3)) for k in range(1, 9))
    for _ in range(6):
        first, width = rng.integers(0, count), rng.integers(1, 90)
        samples[first : first + width] += rng.normal(0.0, 0.6)
    return np.maximum(samples + rng.normal(0.0, 0.002, count), 0.05)


def segments(fit: PiecewiseCubic, count: int) -> list[tuple[int, int]]:
    return list(zip(fit.starts, np.append(fit.starts[1:], count), strict=True))


def polynomials(fit: PiecewiseCubic, samples: np.ndarray) -> np.ndarray:
    """The least-squares cubic of each segment at its samples, by NumPy."""
    out = []
    for first, end in segments(fit, len(samples)):
        s = np.linspace(-1.0, 1.0, end - first) if end - first > 1 else np.zeros(1)
        out.append(np.polyval(np.polyfit(s, samples[first:end], min(3, end - first - 1)), s))
    return np.concatenate(out)


def equal(samples: np.ndarray, count: int = 16, one_sided: bool = True) -> PiecewiseCubic:
    """The fit of that many segments of equal length."""
    return fit_segments(samples, np.linspace(0, len(samples), count + 1).astype(np.int64), np.inf, one_sided)


def adaptive(samples: np.ndarray, one_sided: bool = True) -> PiecewiseCubic:
    return fit_piecewise_cubic(samples, RADIUS, one_sided=one_sided)


FITS = st.sampled_from([adaptive, equal])


@settings(max_examples=40)
@given(seeds, st.sampled_from([0.04, 0.12, 0.4]))
def test_adaptive_segments_keep_the_tolerance(seed, tolerance):
    samples = bumpy(seed)
    fit = fit_piecewise_cubic(samples, RADIUS, tolerance, one_sided=False)
    error = polynomials(fit, samples) - samples
    for first, end in segments(fit, 720):
        assert end - first <= 90
        assert np.abs(np.diff(samples[first:end])).max(initial=0.0) <= JUMP * RADIUS
        if end - first >= SMALLEST_SPLIT:
            assert np.ptp(error[first:end]) <= tolerance * RADIUS + 1e-9
    one_sided = fit_piecewise_cubic(samples, RADIUS, tolerance)
    assert (one_sided.starts == fit.starts).all()


@settings(max_examples=60)
@given(seeds, FITS, st.booleans(), st.sampled_from([0.0, 2.5]))
def test_each_segment_is_the_least_squares_cubic_lowered_by_its_overshoot_if_one_sided(seed, fitted, one_sided, less):
    """Also of an erosion down to zero, where it stays at zero or above."""
    samples = np.maximum(bumpy(seed) - less, 0.0)
    fit = fitted(samples, one_sided=one_sided)
    cubics = polynomials(fit, samples)
    for first, end in segments(fit, 720):
        over = one_sided * max((cubics - samples)[first:end].max(), 0.0)
        np.testing.assert_allclose(fit.values[first:end], np.maximum(cubics[first:end] - over, 0.0), atol=1e-8)
    assert np.isfinite(fit.slopes).all()
