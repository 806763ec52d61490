"""Dynamical system modulation in the frame of a moving obstacle: which velocity leads around it.

Seen from disc k, which moves with u_k, the velocity v is v - u_k. There it is modulated as around a static disc,

    v_k = M_k (v - u_k) + u_k,    M_k = n n' lambda_n + t t' lambda_t,    Gamma_k = (d_k / r_k)^2,
    lambda_n = 1 - 1/Gamma_k towards the disc, 1 away from it,    lambda_t = 1 + 1/Gamma_k,

with n the outward normal, t the tangent and d_k the distance from its centre. On its rim lambda_n = 0: nothing leads
into the disc. Several discs share by w_k ~ 1 / (Gamma_k - 1), so that on the rim of one it alone decides.

Source: after L. Huber, A. Billard, J.-J. Slotine, Avoidance of convex and concave obstacles with convergence ensured
through contraction, 2019, which has star shapes for the discs, and means of speeds and of directions for the sum.
"""

import numpy as np

ON_RIM = 1e-9
"""Gamma - 1 of places on the rim or inside, where weights would be infinite."""


def modulate_around_movers(
    position: np.ndarray, velocity: np.ndarray, centers: np.ndarray, velocities: np.ndarray, radii: np.ndarray
) -> np.ndarray:
    """The velocity modulated around discs that move, shape (2,), W, m/s.

    Args:
        position: shape (2,), W, m; inside of a disc it counts as on its rim.
        velocity: without obstacles, shape (2,), W, m/s.
        centers: shape (n, 2), W, m.
        velocities: of the discs, shape (n, 2), W, m/s.
        radii: including the robot's own clearance, shape (n,), m.
    """
    if not len(radii):
        return velocity.copy()
    offset = position - centers
    distance = np.maximum(np.hypot(offset[:, 0], offset[:, 1]), 1e-9)
    normal = offset / distance[:, None]
    gamma = np.maximum((distance / radii) ** 2, 1.0 + ON_RIM)
    relative_velocity = velocity - velocities
    outward_speed = (relative_velocity * normal).sum(axis=1)
    tangential_velocity = relative_velocity - outward_speed[:, None] * normal
    kept_share = np.where(outward_speed < 0.0, 1.0 - 1.0 / gamma, 1.0)
    modulated_velocity = (
        (kept_share * outward_speed)[:, None] * normal + (1.0 + 1.0 / gamma)[:, None] * tangential_velocity + velocities
    )
    disc_weight = 1.0 / (gamma - 1.0)
    return disc_weight @ modulated_velocity / disc_weight.sum()
