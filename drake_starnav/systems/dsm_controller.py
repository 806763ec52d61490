"""Guidance becomes a desired twist by dynamical system modulation, as a Drake system."""

from pydrake.common.value import Value
from pydrake.systems.framework import Context, InputPort

from drake_starnav.control import ControllerInputs, ControllerParameters, Proposal, follow_guidance
from drake_starnav.control.inputs import Propose
from drake_starnav.moving.avoidance import avoid_collision
from drake_starnav.moving.certificate import make_certificates
from drake_starnav.moving.kalman_tracks import Tracks
from drake_starnav.moving.parameters import DynamicObstacleParameters
from drake_starnav.moving.tracker import TrackedObstacles
from drake_starnav.planning.guidance import Guidance
from drake_starnav.robot import RobotParameters
from drake_starnav.robot.motion import Actuation
from drake_starnav.surroundings.margins import Margins
from drake_starnav.surroundings.surroundings import Surroundings
from drake_starnav.systems.controller import UNUSED_TWIST, Controller
from drake_starnav.utils.stopwatch import Stopwatch


class DsmController(Controller):
    """Turns guidance into the twist that follows its guiding vector, bent by dynamical system modulation.

    ```
                        ┌───────────────┐
    guidance ──────────>│               │
    surroundings ──────>│               ├──> desired_twist
    state ─────────────>│ DsmController ├──> guiding_vector
    tracks ────────────>│               │
    twist_command ─────>│               │
                        └───────────────┘
    ```

    It proposes; the `TwistShield` decides how much of it is driven. It has no state.

    Ports:
        guidance: abstract, `Guidance` from any planner.
        surroundings: abstract, `Surroundings`.
        state: vector (x, y, yaw, v, omega) of the robot in the world frame W; its pose is used.
        tracks: abstract, `Tracks` of the moving obstacles; only with `obstacles`.
        twist_command: vector of the base that is commanded now, from the shield; only with `obstacles`.
        desired_twist: vector, as the base's twists are; see `robot.base`.
        guiding_vector: unit vector (x, y) in W that a holonomic robot would follow; zero when there is none.

    Where the path leads too near to something that moves, the twist begins the best manoeuvre past it; see
    `moving.avoidance`.
    """

    def __init__(
        self,
        robot: RobotParameters,
        controller: ControllerParameters,
        margins: Margins,
        *,
        propose: Propose = follow_guidance,
        obstacles: DynamicObstacleParameters | None = None,
        state_lead: float = 0.0,
        stopwatch: Stopwatch | None = None,
    ) -> None:
        """
        Args:
            propose: what follows guidance, as a pure function.
            obstacles: what is declared about moving obstacles; None: the world is static.
            state_lead: how far in the future the state of the port lies, s; see `StatePredictor`.
            stopwatch: notes `command` times, if given.
        """
        super().__init__(stopwatch)
        self._propose_twist, self._obstacles, self._state_lead = propose, obstacles, state_lead
        self._robot, self._margin = robot, margins.safety
        self._actuation = Actuation(robot.limits, robot.shape, 1.0 / controller.rate, controller.delay, robot.drive)
        self._guidance = self.DeclareAbstractInputPort("guidance", Value(Guidance.none()))
        self._surroundings = self.DeclareAbstractInputPort("surroundings", Value(Surroundings.unknown()))
        self._state = self.DeclareVectorInputPort("state", 5)
        self._tracks: InputPort | None = None
        self._twist: InputPort | None = None
        if obstacles is not None:
            self._tracks = self.DeclareAbstractInputPort("tracks", Value(Tracks()))
            self._twist = self.DeclareVectorInputPort("twist_command", len(robot.drive.components))
        self._declare_outputs(len(robot.drive.components))

    def _read(self, context: Context) -> tuple[ControllerInputs, TrackedObstacles | None]:
        pose, surroundings = self._state.Eval(context)[:3], self._surroundings.Eval(context)
        twist = UNUSED_TWIST if self._twist is None else self._twist.Eval(context)
        inputs, tracked_obstacles = ControllerInputs(pose, twist, self._guidance.Eval(context), surroundings), None
        if self._obstacles is not None and self._tracks is not None:
            tracks = self._tracks.Eval(context)
            tracked_obstacles = TrackedObstacles(
                tracks, context.get_time() + self._state_lead - tracks.time, self._obstacles
            )
        return inputs, tracked_obstacles

    def _propose(self, read: tuple[ControllerInputs, TrackedObstacles | None]) -> Proposal:
        inputs, tracked_obstacles = read
        proposal = self._propose_twist(inputs, self._robot)
        if tracked_obstacles is None:
            return proposal
        surroundings, position, actuation = inputs.surroundings, inputs.pose[:2], self._actuation
        certificates = make_certificates(surroundings, self._margin, actuation, position, tracked_obstacles)
        twist = avoid_collision(inputs, tracked_obstacles, certificates, actuation, self._robot)
        return proposal if twist is None else proposal._replace(twist=twist)
