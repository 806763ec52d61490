"""The weighted mean of directions as angles about a reference direction.

A mean of vectors vanishes where two of them oppose each other; a mean of angles about the nominal direction does not.
Source: Huber, Billard and Slotine, "Avoidance of convex and concave obstacles with convergence ensured through
contraction", RA-L 2019.
"""

import math

from numba import njit

PARALLEL = 1e-5
"""A direction whose cosine to the reference is nearer than this to 1 or -1 counts as parallel or opposite to it."""


@njit(cache=True)
def directional_mean(reference_x, reference_y, vectors, weights):
    """The mean direction of `vectors`.

    Args:
        reference_x, reference_y: unit vector from which angles are counted.
        vectors: shape (n, 2), of any length; those of length 0 add no angle, so their weight goes to the reference.
        weights: shape (n,), not negative, of sum 1.

    Returns:
        (x, y), a unit vector.
    """
    angle = total = 0.0
    counted = last = 0
    for i in range(len(weights)):
        length = math.hypot(vectors[i, 0], vectors[i, 1])
        if weights[i] <= 0.0 or length == 0.0:
            continue
        counted += 1
        last = i
        total += weights[i]
        cosine = (reference_x * vectors[i, 0] + reference_y * vectors[i, 1]) / length
        sine = (reference_x * vectors[i, 1] - reference_y * vectors[i, 0]) / length
        if cosine <= PARALLEL - 1.0:
            angle += weights[i] * math.pi  # the left turn, whatever rounding says about the side
        elif cosine < 1.0 - PARALLEL:
            angle += weights[i] * math.atan2(sine, cosine)
    if counted == 1 and total >= 1.0:
        length = math.hypot(vectors[last, 0], vectors[last, 1])
        return vectors[last, 0] / length, vectors[last, 1] / length
    cosine, sine = math.cos(angle), math.sin(angle)
    return cosine * reference_x - sine * reference_y, sine * reference_x + cosine * reference_y
