"""The weighted mean of directions as angles about a reference direction.

A mean of vectors vanishes where two of them oppose each other; a mean of angles about the nominal direction does not.
Source: Huber, Billard and Slotine, "Avoidance of convex and concave obstacles with convergence ensured through
contraction", RA-L 2019.
"""

import math

import numpy as np

from drake_starnav.geometry.se2 import placed

PARALLEL = 1e-5
"""A direction whose cosine to the reference is nearer than this to 1 or -1 counts as parallel or opposite to it."""


def directional_mean(reference: np.ndarray, vectors: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """The mean direction of vectors, a unit vector of shape (2,).

    Args:
        reference: unit vector from which angles are counted, shape (2,).
        vectors: shape (n, 2), of any length; those of length 0 add no angle, so their weight goes to the reference.
        weights: shape (n,), not negative, of sum 1.
    """
    length = np.hypot(*vectors.T)
    counted = (weights > 0.0) & (length > 0.0)
    units, shares = vectors[counted] / length[counted, None], weights[counted]
    if len(shares) == 1 and shares[0] >= 1.0:
        return units[0]
    cosine, sine = units @ reference, reference[0] * units[:, 1] - reference[1] * units[:, 0]
    angle = np.where(cosine < 1.0 - PARALLEL, np.arctan2(sine, cosine), 0.0)
    angle[cosine <= PARALLEL - 1.0] = math.pi  # the left turn, whatever rounding says about the side
    return placed(np.array((0.0, 0.0, shares @ angle)), reference[None])[0]
