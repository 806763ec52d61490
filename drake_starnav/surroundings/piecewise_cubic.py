"""Least-squares piecewise cubics over a bearing grid: the boundary Phi(theta) of a star-shaped region.

Each segment is a polynomial c0 + c1 s + c2 s^2 + c3 s^3 in its own abscissa s in [-1, 1], which keeps the normal
equations well conditioned; with powers of theta, as in the paper, they are not.
"""

import math
from dataclasses import dataclass

import numpy as np

from drake_starnav.geometry.compiled import kernel

SMALLEST_SPLIT = 5
"""Segments with fewer samples are not bisected."""
LARGEST_SHARE = 8
"""No adaptive segment is longer than one turn divided by this."""
JUMP = 0.48
"""A step between neighbouring samples larger than this separates surfaces, in radii of the robot; smoothing stops at
such a step, too."""
TOLERANCE = 0.12
"""Largest overshoot plus undershoot of an adaptive cubic, in radii: as much as the planner's usual margin."""


@dataclass(frozen=True)
class PiecewiseCubic:
    """Cubic segments on M samples of a full turn.

    Attributes:
        starts: shape (k,), index of each segment's first sample; increasing, the first is 0.
        values: shape (M,), Phi at the samples, m, never negative.
        slopes: shape (M,), Phi' = dPhi/dtheta at the samples, m/rad.
    """

    starts: np.ndarray
    values: np.ndarray
    slopes: np.ndarray


def fit_piecewise_cubic(
    samples: np.ndarray, radius: float, tolerance: float = TOLERANCE, one_sided: bool = True
) -> PiecewiseCubic:
    """Fit the samples of one full turn; segments begin at jumps, and are bisected until they keep the tolerance.

    Args:
        samples: shape (M,), free range at the bearings of a uniform grid, m.
        radius: of the robot, m.
        tolerance: largest overshoot plus undershoot of a cubic, in radii.
        one_sided: lower every cubic until it lies inside the free range.

    Source: paper, section III-B.1, Eq. (3) and (4); breaks and the one-sided fit: this project.
    """
    return PiecewiseCubic(*fit_adaptively(samples, (JUMP * radius, tolerance * radius), one_sided))


def fit_segments(samples: np.ndarray, breaks: np.ndarray, tolerance: float, one_sided: bool) -> PiecewiseCubic:
    """Fit given segments; arguments as for `fit_piecewise_cubic`.

    Args:
        samples, one_sided: likewise.
        breaks: shape (k + 1,), increasing from 0 to M; the first sample of each segment, and M.
        tolerance: in m; with an infinite one no segment is bisected.
    """
    return PiecewiseCubic(*_fit(samples, breaks, tolerance, one_sided))


@kernel
def fit_adaptively(samples, lengths, one_sided):
    """Return the fields of the `PiecewiseCubic` of `fit_piecewise_cubic`; `lengths` are jump and tolerance, m."""
    jump, tolerance = lengths
    count, longest = len(samples), max(len(samples) // LARGEST_SHARE, 1)
    breaks = np.zeros(count + 1, np.int64)
    n = 1
    for i in range(1, count):
        if abs(samples[i] - samples[i - 1]) > jump or i - breaks[n - 1] >= longest:
            breaks[n] = i
            n += 1
    breaks[n] = count
    return _fit(samples, breaks[: n + 1], tolerance, one_sided)


@kernel
def _fit(samples, breaks, tolerance, one_sided):
    """Return the fields of a `PiecewiseCubic` with segments between some breaks, as `fit_segments`."""
    count = len(samples)
    starts, values, slopes = np.empty(count, np.int64), np.empty(count), np.empty(count)
    stack, abscissa = np.empty((64, 2), np.int64), np.empty(count)
    segments = 0
    sample_angle = 2.0 * math.pi / count
    for b in range(len(breaks) - 1):
        if breaks[b + 1] <= breaks[b]:
            continue
        stack[0, 0], stack[0, 1] = breaks[b], breaks[b + 1]
        depth = 1
        while depth > 0:
            depth -= 1
            first, end = stack[depth, 0], stack[depth, 1]
            n = end - first
            half = 0.5 * (n - 1) if n > 1 else 1.0
            for i in range(n):
                abscissa[i] = (i - 0.5 * (n - 1)) / half
            c0, c1, c2, c3 = _solve_least_squares(samples[first:end], abscissa)
            largest_above, largest_below = -np.inf, -np.inf
            for i in range(n):
                s = abscissa[i]
                error = c0 + s * (c1 + s * (c2 + s * c3)) - samples[first + i]
                largest_above = max(largest_above, error)
                largest_below = max(largest_below, -error)
            if largest_above + largest_below > tolerance and n >= SMALLEST_SPLIT:
                middle_sample = (first + end + 1) // 2
                stack[depth, 0], stack[depth, 1] = middle_sample, end
                stack[depth + 1, 0], stack[depth + 1, 1] = first, middle_sample
                depth += 2
                continue
            if one_sided and largest_above > 0.0:
                c0 -= largest_above
            starts[segments] = first
            segments += 1
            for i in range(n):
                s = abscissa[i]
                values[first + i] = max(c0 + s * (c1 + s * (c2 + s * c3)), 0.0)
                slopes[first + i] = (c1 + s * (2.0 * c2 + 3.0 * s * c3)) / (half * sample_angle)
    return starts[:segments].copy(), values, slopes


@kernel
def _solve_least_squares(samples, abscissa):
    """Return the cubic fit of samples (n,) on a symmetric abscissa, its first n: even and odd coefficients decouple."""
    n = len(samples)
    if n == 1:
        return samples[0], 0.0, 0.0, 0.0
    m2 = m4 = m6 = 0.0
    b0 = b1 = b2 = b3 = 0.0
    for i in range(n):
        s, y = abscissa[i], samples[i]
        s2 = s * s
        m2 += s2
        m4 += s2 * s2
        m6 += s2 * s2 * s2
        b0 += y
        b1 += y * s
        b2 += y * s2
        b3 += y * s2 * s
    if n == 2:
        return b0 / 2.0, b1 / 2.0, 0.0, 0.0
    even = n * m4 - m2 * m2
    c0 = (m4 * b0 - m2 * b2) / even
    c2 = (n * b2 - m2 * b0) / even
    if n == 3:
        return c0, b1 / m2, c2, 0.0
    odd = m2 * m6 - m4 * m4
    return c0, (m6 * b1 - m4 * b3) / odd, c2, (m2 * b3 - m4 * b1) / odd
