"""III-C.3, Eq. (15): the modulated vector, blended near obstacles with one for the nearest hit."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from drake_starnav.paper import choices


class Nearest(NamedTuple):
    """The nearest hit p_n.

    Attributes:
        place: p_n, shape (2,), W, m.
        away: unit vector from it to p, shape (2,).
        distance: |p - p_n|, m.
    """

    place: np.ndarray
    away: np.ndarray
    distance: float


def nearest_hit(position: np.ndarray, hits: np.ndarray) -> Nearest | None:
    """Return p_n of the scan L, shape (n, 2), or None of an empty one."""
    if not len(hits):
        return None
    offset = position - hits
    distances = np.hypot(offset[:, 0], offset[:, 1])
    n = int(np.argmin(distances))
    return Nearest(hits[n], offset[n] / max(distances[n], 1e-9), float(distances[n]))


def combined_vector(vector: np.ndarray, guide: np.ndarray, nearest: Nearest, radius: float) -> np.ndarray:
    """Eq. (15): p* = (1 - a) p~* + a p~_n*,  a = min(rho / (|p - p_n| - r), 1); shape (2,), W, m.

    Corrected: a is 1 inside the radius r, where the printed one is negative. p~_n* is not defined, see
    `nearest_vector`. Arguments: p~* of `modulated_vector`, p~ of `guiding_vector`, p_n, r.
    """
    share = blend_share(nearest.distance - radius)
    return (1.0 - share) * vector + share * nearest_vector(nearest, vector, guide)


def blend_share(clearance: float) -> float:
    """Return a of Eq. (15) at |p - p_n| - r, m."""
    return 1.0 if clearance <= choices.RHO else choices.RHO / clearance


def vector_away(nearest: Nearest, vector: np.ndarray, guide: np.ndarray) -> np.ndarray:
    """p~_n*, first reading: away from p_n, as long as p~*."""
    return float(np.hypot(*vector)) * nearest.away


def vector_along(nearest: Nearest, vector: np.ndarray, guide: np.ndarray) -> np.ndarray:
    """p~_n*, second reading: M(p_n) p~, by the notation. At p_n Gamma is 1, so lambda_r is 0: it is tangential there.

    The boundary's normal at the nearest hit is p - p_n. As long as p~*.
    """
    along = guide - (guide @ nearest.away) * nearest.away
    return float(np.hypot(*vector)) * along / max(float(np.hypot(*along)), 1e-9)


def vector_along_and_away(nearest: Nearest, vector: np.ndarray, guide: np.ndarray) -> np.ndarray:
    """p~_n*, third reading: the second with a push away from p_n, as in the authors' code."""
    return vector_along(nearest, vector, guide) + choices.PUSH * vector_away(nearest, vector, guide)


nearest_vector: Callable[[Nearest, np.ndarray, np.ndarray], np.ndarray] = vector_along_and_away
"""The reading of p~_n* that is used; see `choices.NEAREST_VECTOR`."""
