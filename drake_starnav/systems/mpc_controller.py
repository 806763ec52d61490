"""Predictive control by sampling with a braking certificate, as a Drake system."""

from drake_starnav.control.sampling_mpc import predictive_step
from drake_starnav.systems.certified_controller import CertifiedController


class MpcController(CertifiedController):
    """Samples twists, foresees where each leads, and sends the best from which the robot can stop in seen space.

    ```
                    ┌───────────────┐
    guidance ──────>│               ├──> twist_command
    safety_star ───>│ MpcController ├──> guiding_vector
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
        guiding_vector: unit vector (x, y) in W that the law would follow; zero when there is none.
        certificate: abstract, `Certificate`.

    A drop-in for `DsmController`: same ports, same certificate, same state.
    """

    step = staticmethod(predictive_step)
