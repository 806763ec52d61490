"""Corrects odometry errors for the planner by aligning scans."""

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_starnav.control.motion import BrakingMotion
from drake_starnav.geometry.se2 import composed, inverse
from drake_starnav.localization.scan_matching import OdometryError, ScanMap, matched
from drake_starnav.planning.guidance import Guidance
from drake_starnav.regions import Observation
from drake_starnav.systems.release import weakly
from drake_starnav.systems.scan_state import ScanState


class ScanMatcher(LeafSystem):
    """Corrects the drift of the odometry for the planner, which works in a map frame that does not drift.

    ```
                   ┌─────────────┐
    observation ──>│             ├──> observation
    state ────────>│ ScanMatcher ├──> state
    scan_pose ────>│             ├──> pose
    guidance ─────>│             ├──> scan_pose
    certificate ──>│             ├──> guidance
                   │             ├──> certificate
                   └─────────────┘
    ```

    Frames: O, the odometry frame, and M, the map frame, which coincides with O at the start: to the planner and the
    goal M is the world.

    Ports:
        observation: abstract, `Observation` in O; as output, in M.
        state: vector (x, y, yaw, v, omega) of the robot in O; as output, in M.
        pose: vector (x, y, yaw) of the robot in M.
        scan_pose: vector (x, y, yaw) of the sensor frame when the last scan was taken, in O; as output, in M.
        guidance: abstract, the planner's `Guidance` in M; as output, in O, for the controller, so that its certificate
            lies in a frame that no correction moves.
        certificate: abstract, the shield's `BrakingMotion` in O; as output, in M, to be drawn.

    What a new scan corrects is in the outputs at once, see `ScanState`; the state is the map of scans.
    """

    def __init__(self, error: OdometryError, *, rate: float) -> None:
        """
        Args:
            error: of odometry and lidar.
            rate: of the lidar, Hz.
        """
        super().__init__()
        self._error = error
        self._observation = self.DeclareAbstractInputPort("observation", Value(Observation.none()))
        self._now = self.DeclareVectorInputPort("state", 5)
        self._scan_pose = self.DeclareVectorInputPort("scan_pose", 3)
        self._guidance = self.DeclareAbstractInputPort("guidance", Value(Guidance.none()))
        self._certificate = self.DeclareAbstractInputPort("certificate", Value(BrakingMotion.none()))
        self._map = ScanState(self, ScanMap(), self._after, (self._observation,), rate=rate)
        held = self._map.ticket
        now = {held, self._now.ticket()}
        self.DeclareAbstractOutputPort(
            "observation",
            lambda: Value(Observation.none()),
            weakly(self._calc_observation),
            {held, self._observation.ticket()},
        )
        self.DeclareVectorOutputPort("state", 5, weakly(self._calc_state), now)
        self.DeclareVectorOutputPort("pose", 3, weakly(self._calc_pose), now)
        self.DeclareVectorOutputPort("scan_pose", 3, weakly(self._calc_scan_pose), {held, self._scan_pose.ticket()})
        self.DeclareAbstractOutputPort(
            "guidance", lambda: Value(Guidance.none()), weakly(self._calc_guidance), {held, self._guidance.ticket()}
        )
        self.DeclareAbstractOutputPort(
            "certificate",
            lambda: Value(BrakingMotion.none()),
            weakly(self._calc_certificate),
            {held, self._certificate.ticket()},
        )

    def _after(self, context: Context, before: ScanMap) -> ScanMap:
        seen = self._observation.Eval(context)
        if seen.region is None or seen.scan.time == before.time:
            return before
        if seen.scan.time < before.time:  # time was set back: another run begins
            before = ScanMap()
        return matched(before, seen.scan, seen.pose, self._error)

    def _calc_observation(self, context: Context, output: AbstractValue) -> None:
        output.set_value(self._observation.Eval(context).moved(self._map.Eval(context).correction))

    def _calc_state(self, context: Context, output: BasicVector) -> None:
        state = self._now.Eval(context)
        output.SetFromVector(np.concatenate((self._map.Eval(context).corrected(state[:3]), state[3:])))

    def _calc_pose(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._map.Eval(context).corrected(self._now.Eval(context)[:3]))

    def _calc_scan_pose(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(composed(self._map.Eval(context).correction, self._scan_pose.Eval(context)))

    def _calc_guidance(self, context: Context, output: AbstractValue) -> None:
        output.set_value(self._guidance.Eval(context).moved(inverse(self._map.Eval(context).correction)))

    def _calc_certificate(self, context: Context, output: AbstractValue) -> None:
        certificate, correction = self._certificate.Eval(context), self._map.Eval(context).correction
        path = np.array([composed(correction, pose) for pose in certificate.path])
        output.set_value(BrakingMotion(certificate.certified, path))
