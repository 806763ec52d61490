"""Dynamical system modulation: a guiding vector bent so that it never leads out of the star-shaped regions.

    M = E D E^-1,   E = [r_hat  t] (columns),   D = diag(lambda_r, lambda_e)

r_hat points from the region's reference point to p, t is the boundary's tangent at the bearing of p,
t ~ [Phi' cos - Phi sin, Phi' sin + Phi cos]. lambda_r = 1 - 1/Gamma for an outward radial part, 1 for an inward one;
lambda_e = 1 + 1/Gamma. A region counts only where it contains p (Gamma > 1), and M = I at its reference point.
Source: paper, section III-C.3, Eq. (8) to (14). E by columns and t from Phi' are corrections, without which vectors
lead outwards; weights and the damping of outward motion alone are this project's.
"""

import math

from drake_starnav.geometry.compiled import kernel, leaf

SIGMA = 2.0
"""Exponent sigma of Gamma: what is damped grows with the square of the way to the boundary."""
CENTER = 0.08
"""Nearer than this to its reference point a region does not modulate, in radii of the robot."""
FARTHEST = 12.0
"""Farther than this from its reference point a region does not modulate, in radii of the robot."""


@leaf
def evaluate_boundary(values, slopes, bearing_0, theta):
    """Phi and Phi' of one region at a bearing, linear between samples."""
    samples = len(values)
    position = (theta - bearing_0) * samples / (2.0 * math.pi)
    sample_below = math.floor(position)
    sample_share = position - sample_below
    left_sample = int(sample_below) % samples
    right_sample = left_sample + 1 if left_sample + 1 < samples else 0
    phi = (1.0 - sample_share) * values[left_sample] + sample_share * values[right_sample]
    return phi, (1.0 - sample_share) * slopes[left_sample] + sample_share * slopes[right_sample]


@kernel
def modulate_direction(x, y, ux, uy, regions, radius):
    """The mean direction of the unit vector (ux, uy), modulated by each region that contains (x, y).

    `regions` is a union, `radius` the robot's, m. The weights Gamma - 1 are continuous where the position enters or
    leaves a region. A unit vector; (ux, uy) itself where no region contains the position.
    """
    sum_x = sum_y = weight_sum = 0.0
    nearest_distance, farthest_distance = CENTER * radius, FARTHEST * radius
    center, bearing_0, values, slopes = regions.center, regions.bearing_0, regions.values, regions.slopes
    for k in range(len(center)):
        dx, dy = x - center[k, 0], y - center[k, 1]
        distance = math.sqrt(dx * dx + dy * dy)
        if distance > farthest_distance:
            continue
        if distance < nearest_distance:
            return ux, uy
        phi, slope = evaluate_boundary(values[k], slopes[k], bearing_0[k], math.atan2(dy, dx))
        gamma = (phi / distance) ** SIGMA
        cosine, sine = dx / distance, dy / distance
        tx, ty = slope * cosine - phi * sine, slope * sine + phi * cosine
        length = math.sqrt(tx * tx + ty * ty)
        if gamma <= 1.0 or length < 1e-12:
            continue
        tx, ty = tx / length, ty / length
        determinant = cosine * ty - sine * tx  # phi / length: positive
        if determinant < 1e-6:
            continue
        radial = (ux * ty - uy * tx) / determinant
        tangential = (cosine * uy - sine * ux) / determinant * (1.0 + 1.0 / gamma)
        if radial > 0.0:
            radial *= 1.0 - 1.0 / gamma
        vx, vy = radial * cosine + tangential * tx, radial * sine + tangential * ty
        length = math.sqrt(vx * vx + vy * vy)
        if length > 1e-9:
            weight = gamma - 1.0
            sum_x += weight * vx / length
            sum_y += weight * vy / length
            weight_sum += weight
    length = math.sqrt(sum_x * sum_x + sum_y * sum_y)
    if length < 1e-3 * weight_sum or weight_sum <= 0.0:
        return ux, uy
    return sum_x / length, sum_y / length
