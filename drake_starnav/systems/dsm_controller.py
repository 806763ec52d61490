"""Guidance becomes a desired twist by dynamical system modulation, as a Drake system."""

import math
from typing import TypeAlias

from pydrake.common.value import Value
from pydrake.systems.framework import Context, InputPort

from drake_starnav.control import ControllerInputs, ControllerParameters, Proposal, followed
from drake_starnav.control.avoidance import HELD_FOR, Avoidance, avoid_collision
from drake_starnav.planning.guidance import Guidance
from drake_starnav.robot import RobotParameters
from drake_starnav.robot.motion import Actuation
from drake_starnav.safety.certificates import standard_certificates
from drake_starnav.surroundings.margins import Margins
from drake_starnav.surroundings.safe_region import CertifiedRegion
from drake_starnav.systems.controller import UNUSED_TWIST, Controller
from drake_starnav.systems.footprint_hold import FootprintInForce, FootprintInput
from drake_starnav.systems.scan_state import ScanState
from drake_starnav.tracking.kalman_tracks import Tracks
from drake_starnav.tracking.parameters import DynamicObstacleParameters
from drake_starnav.tracking.tracker import TrackedObstacles
from drake_starnav.utils.snapshot import snapshot
from drake_starnav.utils.stopwatch import Stopwatch

Read: TypeAlias = tuple[Context, ControllerInputs, TrackedObstacles | None, FootprintInForce]
"""What a proposal follows from."""


@snapshot
class Held:
    """What was found with the scan of a time, s, and when. Immutable."""

    scan: float = -math.inf
    time: float = -math.inf
    avoidance: Avoidance = Avoidance()


class DsmController(Controller):
    """Turns guidance into the twist that follows its guiding vector, bent by dynamical system modulation.

    ```
                        ┌───────────────┐
    guidance ──────────>│               │
    certified_region ──>│               ├──> desired_twist
    state ─────────────>│ DsmController ├──> guiding_vector
    footprint ─────────>│               │
    tracks ────────────>│               │
    twist_command ─────>│               │
                        └───────────────┘
    ```

    It proposes; the `TwistShield` decides how much of it is driven.

    Ports:
        guidance: abstract, `Guidance` from any planner.
        certified_region: abstract, `CertifiedRegion`.
        state: vector (x, y, yaw, v, omega) of the robot in the world frame W; its pose is used.
        footprint: abstract, `FootprintInForce`; need not be connected.
        tracks: abstract, `Tracks` of the moving obstacles; only with `obstacles`.
        twist_command: vector of the base that is commanded now, from the shield; only with `obstacles`.
        desired_twist: vector, as the base's twists are; see `robot.base`.
        guiding_vector: unit vector (x, y) in W that a holonomic robot would follow; zero when there is none.

    Where the path leads too near to something that moves, the twist begins the best manoeuvre past it; see
    `control.avoidance`. That is searched once a scan, and state until the next: nothing new is known in between. It is
    searched again where it is no longer certified, or has been held for as long as the search assumes.
    """

    def __init__(
        self,
        robot: RobotParameters,
        controller: ControllerParameters,
        margins: Margins,
        *,
        obstacles: DynamicObstacleParameters | None = None,
        state_lead: float = 0.0,
        stopwatch: Stopwatch | None = None,
    ) -> None:
        """
        Args:
            obstacles: what is declared about moving obstacles; None: the world is static.
            state_lead: how far in the future the state of the port lies, s; see `StatePredictor`.
            stopwatch: notes `command` times, if given.
        """
        super().__init__(stopwatch)
        self._obstacles, self._state_lead = obstacles, state_lead
        self._actuation = Actuation(robot.limits, robot.shape, 1.0 / controller.rate, controller.delay, robot.drive)
        self._guidance = self.DeclareAbstractInputPort("guidance", Value(Guidance.none()))
        self._certified_region = self.DeclareAbstractInputPort("certified_region", Value(CertifiedRegion.none()))
        self._state = self.DeclareVectorInputPort("state", 5)
        self._footprint = FootprintInput(self, robot, margins)
        self._tracks: InputPort | None = None
        self._twist: InputPort | None = None
        if obstacles is not None:
            self._tracks = self.DeclareAbstractInputPort("tracks", Value(Tracks()))
            self._twist = self.DeclareVectorInputPort("twist_command", len(robot.drive.components))
            self._searched = ScanState(self, Held(), self._search, (self._tracks,), stamp=self._stamp)
        self._declare_outputs(len(robot.drive.components))

    def _stamp(self, context: Context) -> float:
        return -math.inf if self._tracks is None else self._tracks.Eval(context).time

    def _read(self, context: Context) -> Read:
        pose, star = self._state.Eval(context)[:3], self._certified_region.Eval(context)
        twist = UNUSED_TWIST if self._twist is None else self._twist.Eval(context)
        inputs, tracked = ControllerInputs(pose, twist, self._guidance.Eval(context), star), None
        if self._obstacles is not None and self._tracks is not None:
            tracks = self._tracks.Eval(context)
            tracked = TrackedObstacles(tracks, context.get_time() + self._state_lead - tracks.time, self._obstacles)
        return context, inputs, tracked, self._footprint.Eval(context)

    def _propose(self, read: Read) -> Proposal:
        context, inputs, tracked, footprint = read
        proposal = followed(inputs, footprint.robot)
        if tracked is None:
            return proposal
        held = self._searched.Eval(context)
        avoidance, ago = held.avoidance, context.get_time() - held.time
        if ago > 0.0:
            avoidance = self._avoidance(read, avoidance if ago < HELD_FOR else None)
        return proposal if avoidance.twist is None else proposal._replace(twist=avoidance.twist)

    def _search(self, context: Context, before: Held) -> Held:
        scan = self._stamp(context)
        return before if scan == before.scan else Held(scan, context.get_time(), self._avoidance(self._read(context)))

    def _avoidance(self, read: Read, held: Avoidance | None = None) -> Avoidance:
        _, inputs, tracked, footprint = read
        if tracked is None:
            return Avoidance()
        actuation = self._actuation.carrying(footprint.robot.shape)
        certificates = standard_certificates(inputs.star, footprint.margins.safety, actuation, inputs.pose[:2], tracked)
        return avoid_collision(inputs, tracked, certificates, actuation, footprint.robot, held)
