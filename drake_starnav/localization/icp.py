"""Alignment of points with the surfaces of a scan: point-to-line ICP with a prior.

Source: A. Censi, An ICP variant using a point-to-line metric, ICRA 2008; the prior: this project.
"""

import math

import numpy as np
from numba import njit

ITERATIONS = 15
FLATNESS = 0.15
"""Hits lie on a line if their variance across it is at most this share of that along it."""
OBSERVABLE = 0.05
"""A direction in which the lines' normals have less than this share of their weight is unobservable: the noise of the
normals would always suggest zero motion."""
UNOBSERVABLE_WEIGHT = 1e12
"""Inverse variance of the guess in an unobservable direction, 1/m^2."""


@njit(cache=True)
def surfaces(points, increment, wrap, width):
    """Lines through each point's neighbours on one surface: an anchor point and a normal each, 0 if there is none.

    Args:
        points: shape (n, 2), end points of the beams of a scan, m; infinity without a hit.
        increment: bearing step between beams, rad.
        wrap: whether the last beam's neighbour is the first one.
        width: neighbours are at most this far off, or a few times the distance between beams, m.

    Returns:
        anchor and normal, shape (n, 2).
    """
    n = len(points)
    anchor, normal = np.zeros((n, 2)), np.zeros((n, 2))
    for i in range(n):
        if points[i, 0] == np.inf:
            continue
        x, y = points[i]
        apart = math.hypot(x, y) * increment
        near, chord = max(width, 2.5 * apart), max(0.5 * width, 3.0 * apart)
        count, sx, sy, sxx, sxy, syy = 1, 0.0, 0.0, 0.0, 0.0, 0.0
        for side in (-1, 1):
            lx, ly = x, y
            for k in range(1, n // 4):
                j = i + side * k
                if not wrap and not 0 <= j < n:
                    break
                px, py = points[j % n]
                if px == np.inf or math.hypot(px - lx, py - ly) > chord or math.hypot(px - x, py - y) > near:
                    break
                lx, ly = px, py
                dx, dy = px - x, py - y
                count, sx, sy = count + 1, sx + dx, sy + dy
                sxx, sxy, syy = sxx + dx * dx, sxy + dx * dy, syy + dy * dy
        if count < 3:
            continue
        mx, my = sx / count, sy / count
        a, b, c = sxx / count - mx * mx, sxy / count - mx * my, syy / count - my * my
        spread = _spread(a, b, c)
        least, most = 0.5 * (a + c) - spread, 0.5 * (a + c) + spread
        if most < 1e-12 or least > FLATNESS * most:
            continue  # a corner or a cloud
        along = 0.5 * math.atan2(2.0 * b, a - c)
        anchor[i, 0], anchor[i, 1] = x + mx, y + my
        normal[i, 0], normal[i, 1] = -math.sin(along), math.cos(along)
    return anchor, normal


@njit(cache=True)
def _spread(a, b, c):
    """Half the difference of the eigenvalues of the matrix ((a, b), (b, c))."""
    return math.sqrt(0.25 * (a - c) ** 2 + b * b)


@njit(cache=True)
def aligned(points, guess, weight, known, anchor, normal, angle_min, increment, wrap, sigma, gate, last_gate):
    """The pose of a set of points in the frame of known points, near a guess, and the number of inliers.

    Gauss-Newton on the distances to the lines of the nearest known points, with Geman-McClure weights. Where all lines
    are parallel, as in a corridor, the guess is kept along them.

    Args:
        points: shape (k, 2), m.
        guess: (x, y, yaw) of the points' frame, m and rad.
        weight: shape (3,), inverse variances of the guess.
        known: shape (n, 2), points as for `surfaces`; the nearest are found by their beams.
        anchor, normal: shape (n, 2), from `surfaces`.
        angle_min, increment, wrap: bearing of the first beam and step between beams, rad; whether they cover a full
            circle.
        sigma: standard deviation of a point's distance from its line, m; an inlier is within three of them.
        gate, last_gate: points farther than this from all known points are ignored, in the first and in the last
            iterations, m.

    Returns:
        (x, y, yaw), and the number of inliers.
    """
    n, turn = len(known), 2.0 * math.pi / increment
    x, y, yaw = guess
    inliers = 0
    for _ in range(ITERATIONS):
        h = np.zeros((3, 3))
        g = np.zeros(3)
        h[0, 0], h[1, 1], h[2, 2] = weight
        g[0], g[1], g[2] = weight[0] * (x - guess[0]), weight[1] * (y - guess[1]), weight[2] * (yaw - guess[2])
        cosine, sine = math.cos(yaw), math.sin(yaw)
        scale = max(3.0 * sigma, 0.3 * gate) ** 2
        inliers = 0
        for i in range(len(points)):
            rx, ry = points[i, 0] * cosine - points[i, 1] * sine, points[i, 0] * sine + points[i, 1] * cosine
            px, py = x + rx, y + ry
            away = math.hypot(px, py)
            middle = int(round(((math.atan2(py, px) - angle_min) % (2.0 * math.pi)) / increment))
            if not wrap and middle > 0.5 * (n + turn):
                middle -= int(turn)  # just before the first beam
            reach = min(int(math.ceil(gate / max(away, gate) / increment)), n // 4)
            best, nearest = -1, gate * gate
            for k in range(middle - reach, middle + reach + 1):
                if not wrap and not 0 <= k < n:
                    continue
                dx, dy = known[k % n, 0] - px, known[k % n, 1] - py
                squared = dx * dx + dy * dy
                if squared < nearest:
                    best, nearest = k % n, squared
            if best < 0 or (normal[best, 0] == 0.0 and normal[best, 1] == 0.0):
                continue
            nx, ny = normal[best]
            residual = nx * (px - anchor[best, 0]) + ny * (py - anchor[best, 1])
            if abs(residual) < 3.0 * sigma:
                inliers += 1
            w = (scale / (scale + residual * residual)) ** 2 / (sigma * sigma)
            j = np.array((nx, ny, ny * rx - nx * ry))
            for a in range(3):
                g[a] += w * residual * j[a]
                for b in range(3):
                    h[a, b] += w * j[a] * j[b]
        # eigenvalues of the points' part of h: the smallest belongs to the direction along the lines
        a, b, c = h[0, 0] - weight[0], h[0, 1], h[1, 1] - weight[1]
        if 0.5 * (a + c) - _spread(a, b, c) < OBSERVABLE * (a + c):
            along = 0.5 * math.atan2(2.0 * b, a - c) + 0.5 * math.pi
            ux, uy = math.cos(along), math.sin(along)
            away = ux * (x - guess[0]) + uy * (y - guess[1])
            g[0], g[1] = g[0] + UNOBSERVABLE_WEIGHT * away * ux, g[1] + UNOBSERVABLE_WEIGHT * away * uy
            h[0, 0], h[1, 1] = h[0, 0] + UNOBSERVABLE_WEIGHT * ux * ux, h[1, 1] + UNOBSERVABLE_WEIGHT * uy * uy
            h[0, 1], h[1, 0] = h[0, 1] + UNOBSERVABLE_WEIGHT * ux * uy, h[1, 0] + UNOBSERVABLE_WEIGHT * ux * uy
        change = np.linalg.solve(h, -g)
        x, y, yaw = x + change[0], y + change[1], yaw + change[2]
        if gate <= last_gate and max(abs(change[0]), abs(change[1]), abs(change[2])) < 1e-4:
            break
        gate = max(0.6 * gate, last_gate)
    return np.array((x, y, yaw)), inliers
