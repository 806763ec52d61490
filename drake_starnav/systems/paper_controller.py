"""The controller of arXiv 2403.11484 as printed, as a Drake system."""

from pydrake.common.value import Value
from pydrake.systems.framework import Context

from drake_starnav.baselines import paper
from drake_starnav.control import ControllerInputs, Proposal
from drake_starnav.planning.guidance import Guidance
from drake_starnav.regions.safe_region import CertifiedRegion
from drake_starnav.robot import RobotParameters
from drake_starnav.systems.controller import UNUSED_TWIST, Controller
from drake_starnav.utils.stopwatch import Stopwatch


class PaperController(Controller):
    """Turns guidance into a twist by the paper's modulation.

    ```
                        ┌─────────────────┐
    guidance ──────────>│                 │
    certified_region ──>│ PaperController ├──> desired_twist
    state ─────────────>│                 ├──> guiding_vector
                        └─────────────────┘
    ```

    Ports:
        guidance: abstract, `Guidance`.
        certified_region: abstract, `CertifiedRegion`; its hits near the robot are used.
        state: vector (x, y, yaw, v, omega) of the robot in the world frame W; its pose is used.
        desired_twist: vector (v, omega), m/s and rad/s.
        guiding_vector: unit vector (x, y) in W; zero when there is nowhere to go.
    """

    def __init__(self, robot: RobotParameters, *, stopwatch: Stopwatch | None = None) -> None:
        """Of a robot's radius and limits; a stopwatch, if given, notes `command` times."""
        super().__init__(stopwatch)
        self._robot = robot
        self._guidance = self.DeclareAbstractInputPort("guidance", Value(Guidance.none()))
        self._certified_region = self.DeclareAbstractInputPort("certified_region", Value(CertifiedRegion.none()))
        self._state = self.DeclareVectorInputPort("state", 5)
        self._declare_outputs()

    def _read(self, context: Context) -> ControllerInputs:
        pose, star = self._state.Eval(context)[:3], self._certified_region.Eval(context)
        return ControllerInputs(pose, UNUSED_TWIST, self._guidance.Eval(context), star)

    def _propose(self, read: ControllerInputs) -> Proposal:
        return paper.proposal(read, self._robot)
