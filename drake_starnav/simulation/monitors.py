"""What ends a trial, watches it, and logs it."""

from collections.abc import Callable, Sequence

from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiagramBuilder, TriggerType
from pydrake.systems.primitives import LogVectorOutput, VectorLogSink

from drake_starnav.navigation import Navigation
from drake_starnav.scenario.schema import Scenario
from drake_starnav.station.drive_check import check_drive
from drake_starnav.station.monitors import ArrivalMonitor, CollisionMonitor
from drake_starnav.station.navigation_station import simulated
from drake_starnav.station.plant import value_of
from drake_starnav.systems.connecting import connect_inputs
from drake_starnav.systems.goal_sequence import GoalSequence


def add_monitors(builder: DiagramBuilder, navigation: Navigation, scenario: Scenario) -> list[VectorLogSink]:
    """Add what ends a trial, and the logs of the robot's states and of its commands, which cause no steps."""
    period = 1.0 / scenario.controller.rate  # the collision monitor's: no further steps, and the state is shared
    add_collision_monitor(builder, navigation)
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
    connect_inputs(builder, collision, sources, "collision_monitor")
