"""III-C.3: the guiding vector, modulated by each star-shaped region that contains the robot."""

import math
from typing import NamedTuple

import numpy as np

from drake_starnav.control.modulation import evaluate_boundary
from drake_starnav.paper import choices
from drake_starnav.surroundings.region_union import RegionUnion

LARGEST_GAMMA = 1e6
"""Gamma at a reference point, where it has no bound: M is the identity there."""


class Level(NamedTuple):
    """A region as seen from p.

    Attributes:
        gamma: Gamma(p).
        outward: unit vector from p_ref to p, shape (2,).
        tangent: unit vector along the boundary at the bearing of p, shape (2,).
    """

    gamma: float
    outward: np.ndarray
    tangent: np.ndarray


def guiding_vector(position: np.ndarray, short_term_goal: np.ndarray) -> np.ndarray:
    """Eq. (7): p~ = p_sg - p. As printed."""
    return short_term_goal - position


def evaluate_level(position: np.ndarray, regions: RegionUnion, k: int) -> Level:
    """The text after Eq. (12): Gamma(p) = (Phi(theta) / |p - p_ref|)^sigma, infinite at p_ref. As printed."""
    offset = position - regions.center[k]
    distance = max(math.hypot(offset[0], offset[1]), 1e-9)
    theta = math.atan2(offset[1], offset[0])  # Eq. (11): the printed arctan of a ratio loses half the plane
    phi, slope = evaluate_boundary(regions.values[k], regions.slopes[k], regions.bearing_0[k], theta)
    gamma = min((phi / distance) ** choices.SIGMA, LARGEST_GAMMA)
    return Level(gamma, np.array((math.cos(theta), math.sin(theta))), compute_boundary_tangent(theta, phi, slope))


def compute_boundary_tangent(theta: float, phi: float, slope: float) -> np.ndarray:
    """Eq. (10) and (11): e = (cos theta-bar, sin theta-bar), shape (2,).

    With tan theta-bar = (Phi' sin theta + Phi cos theta) / (Phi' cos theta - Phi sin theta). Corrected: the printed
    theta-bar is the ratio itself, and the printed e = (cos, -sin) is no tangent.
    """
    across = slope * math.sin(theta) + phi * math.cos(theta)
    x_slope = slope * math.cos(theta) - phi * math.sin(theta)
    length = math.hypot(x_slope, across)
    return np.array((x_slope, across)) / length if length > 0.0 else np.array((-math.sin(theta), math.cos(theta)))


def compute_eigenvalues(gamma: float) -> tuple[float, float]:
    """Eq. (12): lambda_r = 1 - 1 / Gamma,  lambda_e = 1 + 1 / Gamma. As printed."""
    return 1.0 - 1.0 / gamma, 1.0 + 1.0 / gamma


def make_modulation_matrix(level: Level) -> np.ndarray:
    """Eq. (9), with M = E D E^-1 of the text after Eq. (8): E = [r, e],  D = diag(lambda_r, lambda_e); shape (2, 2).

    Corrected: r and e are the columns of E; with the printed rows, vectors lead out of the region. At p_ref, where r
    has no direction, M is the identity.
    """
    if level.gamma >= LARGEST_GAMMA:
        return np.eye(2)
    (rx, ry), (ex, ey) = level.outward, level.tangent  # the sign of r does not matter
    along_r, along_e = compute_eigenvalues(level.gamma)
    determinant = rx * ey - ry * ex
    inverse_matrix = np.array(((ey, -ex), (-ry, rx))) / determinant
    return np.array(((rx, ex), (ry, ey))) @ (np.array(((along_r,), (along_e,))) * inverse_matrix)


def modulate_at_level(level: Level, vector: np.ndarray) -> np.ndarray:
    """Eq. (8): p~* = M(p) p~, shape (2,). As printed."""
    return make_modulation_matrix(level) @ vector


def compute_weights(gammas: np.ndarray) -> np.ndarray:
    """Eq. (13): w_k = max(Gamma_k, 1) / sum_k max(Gamma_k, 1), shape (n,). As printed."""
    largest = np.maximum(gammas, 1.0)
    return largest / largest.sum()


def modulate_vector(position: np.ndarray, vector: np.ndarray, regions: RegionUnion) -> np.ndarray:
    """Eq. (14): p~* = sum_k w_k M_k(p) p~, over the regions that contain p; shape (2,), W, m.

    As printed; the sum begins at the first region, not at the printed 0. Where no region contains p, p~ itself.
    """
    offset = position - regions.center
    is_near = np.hypot(*offset.T) < regions.values.max(axis=1, initial=0.0)
    levels = [evaluate_level(position, regions, k) for k in np.flatnonzero(is_near).tolist()]
    levels = [each for each in levels if each.gamma > 1.0]
    if not levels:
        return vector
    shares = compute_weights(np.array([each.gamma for each in levels]))
    return np.sum([share * modulate_at_level(each, vector) for share, each in zip(shares, levels, strict=True)], axis=0)
