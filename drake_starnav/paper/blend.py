"""III-C.3, Eq. (15): the modulated vector, blended near obstacles with one for the nearest hit."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.ndimage import median_filter

from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.paper import choices


class Nearest(NamedTuple):
    """The nearest hit p_n.

    Attributes:
        away: unit vector from it to p, shape (2,).
        clearance: |p - p_n| - r, m.
    """

    away: np.ndarray
    clearance: float


def smooth_distances(scan: LaserScan) -> np.ndarray:
    """Return the median of the distances of NEAREST_BEAMS neighbouring beams, shape (n,), m, in which p_n is sought."""
    return median_filter(scan.distances, int(choices.NEAREST_BEAMS), mode="wrap" if scan.full_circle else "nearest")


def find_nearest_hit(position: np.ndarray, hits: np.ndarray, radius: float) -> Nearest | None:
    """Return p_n of hits, shape (n, 2), for a robot of this radius, m; None without any."""
    if not len(hits):
        return None
    offset = position - hits
    hit_distances = np.hypot(offset[:, 0], offset[:, 1])
    n = int(np.argmin(hit_distances))
    return Nearest(offset[n] / max(hit_distances[n], 1e-9), float(hit_distances[n]) - radius)


def combine_vectors(vector: np.ndarray, guide: np.ndarray, nearest: Nearest) -> np.ndarray:
    """Eq. (15): p* = (1 - a) p~* + a p~_n*,  a = min(rho / (|p - p_n| - r), 1); shape (2,), W, m.

    Corrected: a is 1 inside the radius r, where the printed one is negative. p~_n* is not defined, see
    `nearest_vector`. Arguments: p~* of `modulate_vector`, p~ of `guiding_vector`, p_n.
    """
    share = compute_blend_share(nearest.clearance)
    return (1.0 - share) * vector + share * nearest_vector(nearest, vector, guide)


def compute_blend_share(clearance: float) -> float:
    """Return a of Eq. (15) at |p - p_n| - r, m."""
    return 1.0 if clearance <= choices.RHO else choices.RHO / clearance


def compute_vector_away(nearest: Nearest, vector: np.ndarray, guide: np.ndarray) -> np.ndarray:
    """p~_n*, first reading: away from p_n, as long as p~*."""
    return float(np.hypot(*vector)) * nearest.away


def compute_vector_along(nearest: Nearest, vector: np.ndarray, guide: np.ndarray) -> np.ndarray:
    """p~_n*, second reading: the direction of M(p_n) p~ if r is the normal at p_n: Gamma is 1 and lambda_r 0 there.

    The boundary's normal at the nearest hit is p - p_n. As long as p~*.
    """
    tangential_part = guide - (guide @ nearest.away) * nearest.away
    return float(np.hypot(*vector)) * tangential_part / max(float(np.hypot(*tangential_part)), 1e-9)


def compute_vector_along_and_away(nearest: Nearest, vector: np.ndarray, guide: np.ndarray) -> np.ndarray:
    """p~_n*, third reading: the second with a push away from p_n, as in the authors' code.

    Below rho of clearance the second fades, so that nothing leads on where the robot does not fit through.
    """
    share = min(max(nearest.clearance / choices.RHO, 0.0), 1.0)
    return share * compute_vector_along(nearest, vector, guide) + choices.PUSH * compute_vector_away(
        nearest, vector, guide
    )


nearest_vector: Callable[[Nearest, np.ndarray, np.ndarray], np.ndarray] = compute_vector_along_and_away
"""The reading of p~_n* that is used; see `choices.NEAREST_VECTOR`."""
