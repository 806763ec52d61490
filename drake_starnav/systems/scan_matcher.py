"""Corrects odometry errors for the planner by aligning scans."""

from functools import lru_cache
from typing import Any

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import Context, LeafSystem

from drake_starnav.geometry.se2 import invert_pose
from drake_starnav.localization.scan_matching import OdometryError, ScanMap, match_scan
from drake_starnav.planning.guidance import Guidance
from drake_starnav.robot.motion import BrakingMotion
from drake_starnav.surroundings import Observation
from drake_starnav.surroundings.surroundings import Surroundings
from drake_starnav.systems.release import declare_value, declare_vector
from drake_starnav.systems.scan_state import ScanState


class ScanMatcher(LeafSystem):
    """Corrects the drift of the odometry for the planner, which works in a map frame that does not drift.

    ```
                        ┌─────────────┐
    observation ───────>│             ├──> observation
    surroundings ──────>│             ├──> surroundings
    state ─────────────>│ ScanMatcher ├──> state
    scan_pose ─────────>│             ├──> pose
    guidance ──────────>│             ├──> scan_pose
    certificate ───────>│             ├──> guidance
                        │             ├──> certificate
                        └─────────────┘
    ```

    Frames: O, the odometry frame, and M, the map frame, which coincides with O at the start: to the planner and the
    goal M is the world.

    Ports:
        observation: abstract, `Observation` in O; as output, in M.
        surroundings: abstract, `Surroundings` in O; as output, in M, for the planner.
        state: vector (x, y, yaw, v, omega) of the robot in O; as output, in M.
        pose: vector (x, y, yaw) of the robot in M.
        scan_pose: vector (x, y, yaw) of the robot when the last scan was taken, in O; as output, in M.
        guidance: abstract, the planner's `Guidance` in M; as output, in O, for the controller, so that its certificate
            lies in a frame that no correction moves.
        certificate: abstract, the shield's `BrakingMotion` in O; as output, in M, to be drawn.

    What a new scan corrects is in the outputs at once, see `ScanState`; the state is the map of scans.
    """

    def __init__(self, error: OdometryError) -> None:
        """Match scans, weighed by the errors of odometry and lidar."""
        super().__init__()
        self._error = error
        self._moved = lru_cache(maxsize=4)(
            _transform
        )  # ports are asked again when the state has followed what they show
        self._observation = self.DeclareAbstractInputPort("observation", Value(Observation.none()))
        self._surroundings = self.DeclareAbstractInputPort("surroundings", Value(Surroundings.unknown()))
        self._state = self.DeclareVectorInputPort("state", 5)
        self._scan_pose = self.DeclareVectorInputPort("scan_pose", 3)
        self._guidance = self.DeclareAbstractInputPort("guidance", Value(Guidance.none()))
        self._certificate = self.DeclareAbstractInputPort("certificate", Value(BrakingMotion.none()))
        self._map = ScanState(self, ScanMap(), self._step_state, (self._observation,), stamp=self._stamp)
        own = ScanMatcher
        ports = self._observation, self._surroundings, self._state, self._scan_pose, self._guidance, self._certificate
        observation, surroundings, state, scan_pose, guidance, certificate = (
            {self._map.ticket, port.ticket()} for port in ports
        )
        declare_value(self, "observation", Observation.none(), own._moved_observation, observation)
        declare_value(self, "surroundings", Surroundings.unknown(), own._moved_surroundings, surroundings)
        declare_vector(self, "state", 5, own._corrected_state, state)
        declare_vector(self, "pose", 3, lambda system, context: system._corrected_state(context)[:3], state)
        declare_vector(self, "scan_pose", 3, own._corrected_scan_pose, scan_pose)
        declare_value(self, "guidance", Guidance.none(), own._uncorrected_guidance, guidance)
        declare_value(self, "certificate", BrakingMotion.none(), own._corrected_certificate, certificate)

    def _stamp(self, context: Context) -> float:
        return self._observation.Eval(context).time

    def _step_state(self, context: Context, previous_map: ScanMap) -> ScanMap:
        observation = self._observation.Eval(context)
        if observation.time == previous_map.time:
            return previous_map
        return match_scan(previous_map, observation.scan, observation.pose, self._error)

    def _moved_observation(self, context: Context) -> Observation:
        return self._moved(self._observation.Eval(context), self._map.Eval(context))

    def _moved_surroundings(self, context: Context) -> Surroundings:
        return self._moved(self._surroundings.Eval(context), self._map.Eval(context))

    def _corrected_state(self, context: Context) -> np.ndarray:
        state = self._state.Eval(context)
        return np.concatenate((self._map.Eval(context).correct_pose(state[:3]), state[3:]))

    def _corrected_scan_pose(self, context: Context) -> np.ndarray:
        return self._map.Eval(context).correct_pose(self._scan_pose.Eval(context))

    def _uncorrected_guidance(self, context: Context) -> Guidance:
        return self._moved(self._guidance.Eval(context), self._map.Eval(context), is_inverse=True)

    def _corrected_certificate(self, context: Context) -> BrakingMotion:
        certificate, known_map = self._certificate.Eval(context), self._map.Eval(context)
        return BrakingMotion(
            certificate.certified, np.array([known_map.correct_pose(pose) for pose in certificate.path])
        )


def _transform(value: Any, scan_map: ScanMap, is_inverse: bool = False) -> Any:
    """Return a value with a method `transformed` in M, given in O; with `is_inverse` the other way."""
    return value.transformed(invert_pose(scan_map.correction) if is_inverse else scan_map.correction)
