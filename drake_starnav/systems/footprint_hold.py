"""A footprint that changes while the robot drives: grown at once, shrunk only when it stands."""

from collections.abc import Callable

from pydrake.common.value import Value
from pydrake.systems.framework import Context, EventStatus, LeafSystem, State

from drake_starnav.errors import StarnavError, check_kind
from drake_starnav.geometry.footprint import Footprint, contains, fastest_point, joined
from drake_starnav.geometry.trajectory import STANDING
from drake_starnav.robot import RobotParameters
from drake_starnav.robot.motion import AT_REST
from drake_starnav.surroundings.margins import Margins
from drake_starnav.systems.release import declare_value, weakly
from drake_starnav.utils.snapshot import snapshot
from drake_starnav.utils.timing import checked_period


@snapshot
class FootprintInForce:
    """The footprint by which a robot is driven now. Immutable.

    Attributes:
        robot: its parameters with this footprint.
        margins: that are kept with it.
    """

    robot: RobotParameters
    margins: Margins


class FootprintInput:
    """The input port `footprint` of a system, which need not be connected.

    Attributes:
        own: the footprint where it is not connected.
        port: the port.
    """

    def __init__(self, system: LeafSystem, robot: RobotParameters, margins: Margins) -> None:
        """Declare the port of a system in construction; robot and margins hold where it is not connected."""
        self.own = FootprintInForce(robot, margins)
        self.port = system.DeclareAbstractInputPort("footprint", Value[object](self.own))

    def Eval(self, context: Context) -> FootprintInForce:
        """The current footprint."""
        if not self.port.HasValue(context):
            return self.own
        value = self.port.Eval(context)
        check_kind(value, FootprintInForce, "port footprint", "from a FootprintHold")
        return value


class FootprintHold(LeafSystem):
    """Decides which footprint a robot is driven by when the one that it is told changes.

    ```
                     ┌───────────────┐
    footprint ──────>│               │
    state ──────────>│ FootprintHold ├──> footprint
    twist_command ──>│               │
                     └───────────────┘
    ```

    Growth counts at once: a footprint that does not lie inside the current one is joined to it. Shrinking counts as
    soon as the robot stands.

    Ports:
        footprint: abstract, `Footprint` that the robot has now; as output `FootprintInForce`, for the ports `footprint`
            of perception, planner, controller, shield and collision monitor.
        state: vector (x, y, yaw, v, omega) of the robot; it stands if no point of the current
            footprint is faster than STANDING.
        twist_command: vector from the shield; it stands only if this is zero, too.

    The current footprint is abstract state, updated at the controller's rate before the commands of the same instant.
    Anything else than a `Footprint`, and one for which the scenario would be refused, end the simulation with a
    `StarnavError`.
    """

    def __init__(self, robot: RobotParameters, margins: Callable[[RobotParameters], Margins], *, rate: float) -> None:
        """
        Args:
            robot: with its first footprint.
            margins: of the robot with another footprint.
            rate: of the controller, Hz.
        """
        super().__init__()
        self._robot, self._margins = robot, margins
        own = FootprintInForce(robot, margins(robot))
        self._footprint = self.DeclareAbstractInputPort("footprint", Value[object](robot.shape))
        self._state = self.DeclareVectorInputPort("state", 5)
        self._twist = self.DeclareVectorInputPort("twist_command", len(robot.drive.components))
        self._held = self.DeclareAbstractState(Value[object](own))
        depends = {self.abstract_state_ticket(self._held), self._footprint.ticket()}
        self._grown = declare_value(self, "footprint", own, FootprintHold._grown_footprint, depends)
        period = checked_period(self, rate=rate)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, weakly(self._update))

    def _update(self, context: Context, state: State) -> EventStatus:
        current, grown = self._in_force(context), self._grown.Eval(context)
        after = self._with(grown, self._given(context)) if self._stands(context) else grown
        if after is current:
            return EventStatus.DidNothing()
        state.get_mutable_abstract_state(self._held).set_value(after)
        return EventStatus.Succeeded()

    def _grown_footprint(self, context: Context) -> FootprintInForce:
        current = self._in_force(context)
        return self._with(current, joined(current.robot.shape, self._given(context)))

    def _with(self, current: FootprintInForce, shape: Footprint) -> FootprintInForce:
        """The known one, or another one if the footprint is not the same."""
        before = current.robot.shape
        if shape is before or (contains(before, shape) and contains(shape, before)):
            return current
        try:
            robot = self._robot.covering(shape)
            return FootprintInForce(robot, self._margins(robot))
        except StarnavError as error:
            raise StarnavError(f"port footprint: {error}") from None

    def _in_force(self, context: Context) -> FootprintInForce:
        return context.get_abstract_state(self._held).get_value()

    def _given(self, context: Context) -> Footprint:
        shape = self._footprint.Eval(context)
        check_kind(shape, Footprint, "port footprint", "as the shape of RobotParameters")
        return self._robot.body(shape)

    def _stands(self, context: Context) -> bool:
        _, _, _, v, omega = self._state.Eval(context)
        speed, rate = self._robot.drive.body_rates(self._twist.Eval(context))
        fastest = fastest_point(v, omega, self._in_force(context).robot.radius)
        return bool(fastest <= STANDING and max(abs(speed), abs(rate)) < AT_REST)
