"""What ends a trial, watches it, and logs it."""

from collections.abc import Callable, Sequence

from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiagramBuilder, EventStatus, LeafSystem, State, TriggerType
from pydrake.systems.primitives import LogVectorOutput, VectorLogSink

from drake_starnav.navigation import Navigation
from drake_starnav.scenario.schema import Scenario
from drake_starnav.station.drive_check import check_drive
from drake_starnav.station.monitors import ArrivalMonitor, CollisionMonitor, Hull
from drake_starnav.station.navigation_station import simulated
from drake_starnav.station.plant import value_of
from drake_starnav.systems.connecting import connect_inputs
from drake_starnav.systems.footprint_hold import FootprintInForce
from drake_starnav.systems.goal_sequence import GoalSequence
from drake_starnav.systems.release import weakly

FOOTPRINT_LOG = "footprint_log"


class FootprintLog(LeafSystem):
    """Notes each footprint of a run and since when it counts, as abstract state."""

    def __init__(self, period: float) -> None:
        """Look at the footprint once in a period, s."""
        super().__init__()
        self._footprint = self.DeclareAbstractInputPort("footprint", Value[object](()))
        self._noted = self.DeclareAbstractState(Value[object](()))
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, weakly(self._note))

    def noted(self, context: Context) -> tuple[tuple[float, FootprintInForce], ...]:
        """Since when, s, which footprint counted."""
        return context.get_abstract_state(self._noted).get_value()

    def _note(self, context: Context, state: State) -> EventStatus:
        noted, now = self.noted(context), self._footprint.Eval(context)
        if noted and noted[-1][1] is now:
            return EventStatus.DidNothing()
        state.get_mutable_abstract_state(self._noted).set_value((*noted, (context.get_time(), now)))
        return EventStatus.Succeeded()


def add_monitors(builder: DiagramBuilder, navigation: Navigation, scenario: Scenario) -> list[VectorLogSink]:
    """Add what ends a trial, and the logs of the robot's states and of its commands, which cause no steps."""
    period = 1.0 / scenario.controller.rate  # the collision monitor's: no further steps, and the state is shared
    add_collision_monitor(builder, navigation)
    if navigation.footprint is not None:
        log = builder.AddNamedSystem(FOOTPRINT_LOG, FootprintLog(period))
        builder.Connect(navigation.footprint.get_output_port(), log.get_input_port())
    goals = len(scenario.goals) if isinstance(navigation.goal, GoalSequence) else 0
    tolerance, shape = scenario.simulation.goal_tolerance, scenario.robot.shape
    monitor = ArrivalMonitor(tolerance=tolerance, period=period, goals=goals, footprint=shape)
    arrival = builder.AddNamedSystem("arrival_monitor", monitor)
    sources = {"state": navigation.localization("state"), "goal": navigation.goal_position}
    if isinstance(navigation.goal, GoalSequence):
        sources["reached"] = navigation.goal.GetOutputPort("reached")
    if (status := navigation.planned("status")) is not None:
        sources["status"] = status
    connect_inputs(builder, arrival, sources, "arrival_monitor")
    state = navigation.station.GetOutputPort("cheat.robot_state")
    return [LogVectorOutput(port, builder, {TriggerType.kPerStep}) for port in (state, navigation.twist_command)]


def watcher(
    simulator: Simulator,
    navigation: Navigation,
    logs: Sequence[VectorLogSink],
    slip: float,
    reports: list[tuple[float, str]],
    progress: Callable[[float, float], None] | None,
) -> Callable[[float, float], None]:
    """Report progress, a robot that does not follow its commands, and, in `reports`, one that stands still and why."""

    def watch(now: float, limit: float) -> None:
        if progress is not None:
            progress(now, limit)
        context = simulator.get_context()
        states, commands = (log.FindLog(context) for log in logs)
        check_drive(simulated(navigation.station), states.sample_times(), states.data().T, commands.data().T, slip=slip)
        reason = blocked_by(navigation, context)
        if reason != (reports[-1][1] if reports else ""):
            reports.append((now, reason))

    return watch


def blocked_by(navigation: Navigation, context: Context) -> str:
    """What its planner, if it says so, calls the reason why a robot stands, or has no way; empty without one."""
    port = navigation.planned("blocked_by")
    return "" if port is None else value_of(port, context)


def add_collision_monitor(builder: DiagramBuilder, navigation: Navigation) -> None:
    """End the simulation at the first contact of a robot in the builder with anything but the ground.

    It is checked with each command; where obstacles move, at every step of the plant.
    """
    station = simulated(navigation.station)
    moving = station.moving_obstacle_geometries  # None: the plant may hold more than the world
    hull, robot, world = station.hull, station.robot_interface, navigation.world
    fixed = moving is not None and not moving and world.model is None and station.scenario.localization.exact
    if navigation.footprint is not None:  # the plant knows nothing of it
        hull = Hull(robot.base_frame, world)
    collision = builder.AddNamedSystem(
        "collision_monitor",
        CollisionMonitor(
            robot=station.robot_geometries,
            ground=station.floor,
            moving_obstacles=moving or (),
            hull=hull,
            footprint=robot.robot.shape,
            near=(world, robot.reach) if fixed and hull is None else None,
            period=station.scenario.simulation.time_step if moving else 1.0 / station.scenario.controller.rate,
        ),
    )
    sources = {"geometry_query": station.geometry_query, "state": station.GetOutputPort("localization.state")}
    connect_inputs(builder, collision, sources | navigation.footprint_in_force, "collision_monitor")
