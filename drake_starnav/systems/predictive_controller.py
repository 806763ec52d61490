"""Sampling-based model predictive control, as a Drake system."""

from drake_starnav.baselines.sampling_mpc import predictive_twist
from drake_starnav.control import ControllerInputs, Proposal
from drake_starnav.control.certificates import Certificate
from drake_starnav.control.motion import Actuation
from drake_starnav.systems.dsm_controller import DsmController
from drake_starnav.systems.footprint_hold import FootprintInForce


class PredictiveController(DsmController):
    """Proposes, of many twists that the certificates accept, the one with the best predicted motion.

    ```
                        ┌──────────────────────┐
    guidance ──────────>│                      │
    certified_region ──>│                      ├──> desired_twist
    state ─────────────>│ PredictiveController ├──> guiding_vector
    footprint ─────────>│                      │
    tracks ────────────>│                      │
    twist_command ─────>│                      │
                        └──────────────────────┘
    ```

    Its ports are those of `DsmController`, but `twist_command` is there also in a static world.
    """

    SEARCHES = True

    def _law(
        self,
        inputs: ControllerInputs,
        certificates: tuple[Certificate, ...],
        actuation: Actuation,
        now: FootprintInForce,
    ) -> Proposal:
        return predictive_twist(inputs, certificates, actuation, now.margins, now.robot)
