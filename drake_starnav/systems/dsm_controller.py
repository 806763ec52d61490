"""Dynamical system modulation with a braking certificate, as a Drake system."""

from drake_starnav.control import control_step
from drake_starnav.systems.certified_controller import CertifiedController


class DsmController(CertifiedController):
    """Follows guidance along the star regions and sends only twists from which the robot can stop in seen space.

    ```
                    ┌───────────────┐
    guidance ──────>│               ├──> twist_command
    safety_star ───>│ DsmController ├──> guiding_vector
    state ─────────>│               ├──> certificate
    tracks ────────>│               │
                    └───────────────┘
    ```

    Ports:
        guidance: abstract, `Guidance` from any planner.
        safety_star: abstract, `SafetyStar`.
        state: vector (x, y, yaw, v, omega) of the robot in the world frame W; its pose is used.
        tracks: abstract, `Tracks` of the obstacles that move; only with `movers`.
        twist_command: vector (v, omega) within the robot's limits, m/s and rad/s.
        guiding_vector: unit vector (x, y) in W that a robot without wheels would follow; zero when there is none.
        certificate: abstract, `Certificate`.

    Periodic update at `controller.rate`; the last twist is discrete state, from which the next one is ramped.
    """

    step = staticmethod(control_step)
