"""The whole loop as one diagram: what it exports, and that contexts own everything that changes."""

import dataclasses
import gc
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.systems.analysis import InitializeParams, Simulator
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, LeafSystem, System
from pydrake.systems.primitives import LogVectorOutput

from drake_starnav.diagram import add_navigation, make_diagram
from drake_starnav.guidance import Guidance
from drake_starnav.roadmap import PlannerStatus
from drake_starnav.scenario import Scenario, parse_scenario
from drake_starnav.stars.region import RegionStack
from drake_starnav.station import NavigationStation
from drake_starnav.stopwatch import Stopwatch
from drake_starnav.systems.arrival_monitor import ArrivalMonitor
from drake_starnav.systems.baseline_controller import BaselineController
from drake_starnav.systems.collision_monitor import CollisionMonitor
from drake_starnav.systems.dsm_controller import DsmController
from drake_starnav.systems.star_perception import StarPerception
from drake_starnav.systems.star_roadmap_planner import StarRoadmapPlanner
from drake_starnav.worlds.world import World

POSTS = """
world: !Obstacles
  bounds: [-1, -2, 5, 2]
  cylinders: [[1.7, 0.1, 0.4], [2.8, -0.9, 0.3]]
  start: [0.2, 0.1, 0.3]
  goal: [3.8, 0.0]
"""
STATION_OUTPUTS = [
    "lidar.scan",
    "lidar.ranges",
    "lidar.point_cloud",
    "lidar.X_WS",
    "localization.pose",
    "localization.state",
    "localization.scan_pose",
    "cheat.robot_state",
    "cheat.contact_results",
    "cheat.geometry_query",
]
EXPORTS = [
    "planner.guidance",
    "planner.short_term_goal",
    "planner.roadmap",
    "planner.status",
    "controller.twist_command",
    "controller.guiding_vector",
    "controller.certificate",
    *STATION_OUTPUTS,
]
GOALS = ([3.8, 0.0], [-0.4, 1.5])
OFF_GRID = 1.2013
"""Between two events of every system, s."""


def posts() -> Scenario:
    return parse_scenario(POSTS, name="posts")


def simulated(diagram: Diagram, goal=GOALS[0]) -> Simulator:
    """A simulator of its own context, in which the goal is set."""
    simulator = Simulator(diagram)
    source = diagram.GetSubsystemByName("goal")
    source.get_mutable_source_value(source.GetMyMutableContextFromRoot(simulator.get_mutable_context())).set_value(goal)
    return simulator


def resumed(diagram: Diagram, context: Context) -> Simulator:
    """A simulator that goes on from a context as it is."""
    simulator = Simulator(diagram, context)
    simulator.Initialize(InitializeParams(suppress_initialization_events=True))
    return simulator


def all_states(diagram: Diagram, context: Context) -> dict[str, Any]:
    """Everything that the context remembers, comparable: discrete states, roadmap, scan and safety star."""
    found: dict[str, Any] = {"time": context.get_time()}
    for k in range(context.num_discrete_state_groups()):
        found[f"discrete {k}"] = context.get_discrete_state(k).value().copy()
    for name in EXPORTS[:7]:
        found[name] = diagram.GetOutputPort(name).Eval(context)
    found["scan"] = diagram.GetOutputPort("lidar.scan").Eval(context)
    perception = diagram.GetSubsystemByName("perception")
    found["perception"] = perception.GetOutputPort("safety_star").Eval(perception.GetMyContextFromRoot(context))
    return {name: structure(value) for name, value in found.items()}


def structure(value: Any) -> Any:
    """A value as nested tuples that compare by content; what cannot be looked into stands for itself by identity."""
    if isinstance(value, np.ndarray):
        return value.shape, value.tobytes()
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = [f.name for f in dataclasses.fields(value) if f.compare]
        return type(value), tuple((name, structure(getattr(value, name))) for name in fields)
    if isinstance(value, dict):
        return tuple((structure(key), structure(item)) for key, item in value.items())
    if isinstance(value, (list, tuple)):
        return tuple(structure(item) for item in value)
    if isinstance(value, (set, frozenset)):
        return frozenset(structure(item) for item in value)
    if value is None or isinstance(value, (bool, int, float, str, PlannerStatus)):
        return value
    if type(value).__module__.startswith("drake_starnav") and not isinstance(value, System):
        return type(value), structure(vars(value))
    return id(value)


def python_systems(diagram: Diagram) -> Iterator[System]:
    """All systems of this package in a diagram, at every depth."""
    for system in diagram.GetSystems():
        if type(system).__module__.startswith("drake_starnav"):
            yield system
        if isinstance(system, Diagram):
            yield from python_systems(system)


def test_exports_what_its_docstring_says() -> None:
    diagram = make_diagram(posts())
    assert [diagram.get_output_port(k).get_name() for k in range(diagram.num_output_ports())] == EXPORTS
    assert diagram.num_input_ports() == 0
    assert diagram.get_name() == "posts"
    for name in EXPORTS[:7]:
        assert f"`{name}`" in make_diagram.__doc__
    simulator = Simulator(diagram)
    simulator.AdvanceTo(0.1)
    for name in EXPORTS:
        diagram.GetOutputPort(name).Eval(simulator.get_context())


def test_the_systems_are_wired_and_the_robot_drives_to_its_goal() -> None:
    diagram = make_diagram(posts())
    simulator = Simulator(diagram)
    simulator.AdvanceTo(9.0)
    context = simulator.get_context()
    assert np.hypot(*(diagram.GetOutputPort("localization.pose").Eval(context)[:2] - GOALS[0])) < 0.1
    assert diagram.GetOutputPort("planner.status").Eval(context) is PlannerStatus.APPROACHING


def test_a_world_and_a_seed_may_be_given() -> None:
    world = World("other", (2.0, 3.0, 1.0), (4.0, 3.0))
    diagram = make_diagram(posts(), world=world)
    context = diagram.CreateDefaultContext()
    assert diagram.GetOutputPort("localization.pose").Eval(context) == pytest.approx([2.0, 3.0, 1.0])
    ranges = []
    for seed in (0, 1):
        diagram = make_diagram(posts(), seed=seed)
        simulator = Simulator(diagram)
        simulator.Initialize()
        ranges.append(diagram.GetOutputPort("lidar.ranges").Eval(simulator.get_context()).copy())
    assert not np.array_equal(*ranges)


class Odometer(LeafSystem):
    """A user's own system: adds up the distance driven, by the speed at each step."""

    def __init__(self, period: float) -> None:
        super().__init__()
        self._period = period
        self._state = self.DeclareVectorInputPort("state", 5)
        self.DeclareStateOutputPort("distance", self.DeclareDiscreteState(1))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    def _update(self, context, values) -> None:
        driven = context.get_discrete_state(0).value()[0] + self._period * abs(self._state.Eval(context)[3])
        values.set_value([driven])


def test_is_a_subsystem_of_a_user_s_builder() -> None:
    alone = make_diagram(posts())
    simulator = Simulator(alone)
    simulator.AdvanceTo(1.0)
    expected = alone.GetOutputPort("cheat.robot_state").Eval(simulator.get_context()).copy()

    builder = DiagramBuilder()
    navigation = builder.AddSystem(make_diagram(posts()))
    odometer = builder.AddSystem(Odometer(0.01))
    builder.Connect(navigation.GetOutputPort("localization.state"), odometer.get_input_port())
    log = LogVectorOutput(navigation.GetOutputPort("localization.pose"), builder, 0.01)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(1.0)
    context = simulator.get_context()
    inner = navigation.GetMyContextFromRoot(context)
    assert np.array_equal(navigation.GetOutputPort("cheat.robot_state").Eval(inner), expected)
    x, y, _ = log.FindLog(context).data()
    driven = odometer.get_output_port().Eval(odometer.GetMyContextFromRoot(context))[0]
    assert driven == pytest.approx(np.hypot(np.diff(x), np.diff(y)).sum(), abs=0.02)
    assert driven > 0.1


def test_systems_that_are_added_are_handed_back() -> None:
    builder = DiagramBuilder()
    navigation = add_navigation(builder, posts())
    kinds = (NavigationStation, StarPerception, StarRoadmapPlanner, DsmController)
    systems = (navigation.station, navigation.perception, navigation.planner, navigation.controller)
    assert tuple(type(system) for system in systems) == kinds
    assert [s.get_name() for s in builder.GetSystems()] == ["station", "goal", "perception", "planner", "controller"]
    assert navigation.world.goal == (3.8, 0.0)


def test_where_the_believed_pose_errs_a_matcher_stands_before_the_planner() -> None:
    scenario = parse_scenario(POSTS, overrides=["localization.drift=0.02"], name="posts")
    navigation = add_navigation(DiagramBuilder(), scenario)
    assert navigation.localization("state").get_system() is navigation.matcher
    assert navigation.certificate.get_system() is navigation.matcher
    exports = make_diagram(scenario)
    assert {f"matcher.{name}" for name in ("star", "state", "pose", "scan_pose", "guidance", "certificate")} < {
        exports.get_output_port(k).get_name() for k in range(exports.num_output_ports())
    }
    without = parse_scenario(POSTS, overrides=["localization.drift=0.02", "localization.matching=false"], name="posts")
    assert add_navigation(DiagramBuilder(), without).matcher is None


@pytest.mark.parametrize(
    ("method", "names"),
    [
        ("dwa", ["station", "goal", "controller"]),
        ("foa_roadmap", ["station", "goal", "perception", "planner", "controller"]),
        ("dsm", ["station", "goal", "controller", "known_obstacles"]),
    ],
)
def test_a_baseline_takes_the_place_of_the_star_controller(method: str, names: list[str]) -> None:
    scenario = parse_scenario(POSTS, name="posts", method=method)
    builder = DiagramBuilder()
    navigation = add_navigation(builder, scenario)
    assert isinstance(navigation.controller, BaselineController)
    assert [system.get_name() for system in builder.GetSystems()] == names
    diagram = make_diagram(scenario)
    exports = [diagram.get_output_port(k).get_name() for k in range(diagram.num_output_ports())]
    assert exports == [name for name in EXPORTS if navigation.planner or not name.startswith("planner.")]
    simulated(diagram).AdvanceTo(0.5)


def test_interleaved_contexts_go_as_they_would_alone() -> None:
    """Two robots in two contexts of one diagram, with different goals, step in turns."""
    alone = []
    for goal in GOALS:
        diagram = make_diagram(posts())
        simulator = simulated(diagram, goal)
        simulator.AdvanceTo(OFF_GRID)
        alone.append(all_states(diagram, simulator.get_context()))
    assert alone[0] != alone[1]

    diagram = make_diagram(posts())
    simulators = [simulated(diagram, goal) for goal in GOALS]
    for time in (0.0031, 0.0519, 0.3003, 0.6177, 0.9001, OFF_GRID):
        for simulator in simulators:
            simulator.AdvanceTo(time)
    for simulator, expected in zip(simulators, alone, strict=True):
        assert all_states(diagram, simulator.get_context()) == expected


def test_a_clone_of_a_context_goes_the_same_way() -> None:
    diagram = make_diagram(posts())
    simulator = simulated(diagram)
    simulator.AdvanceTo(OFF_GRID)
    clone = simulator.get_context().Clone()
    held = all_states(diagram, clone)
    simulator.AdvanceTo(2.0 * OFF_GRID)
    assert all_states(diagram, clone) == held, "the run changed what the clone remembers"
    twin = resumed(diagram, clone)
    twin.AdvanceTo(2.0 * OFF_GRID)
    assert all_states(diagram, twin.get_context()) == all_states(diagram, simulator.get_context())


def test_a_second_run_of_the_same_diagram_knows_nothing_of_the_first() -> None:
    diagram = make_diagram(posts())
    runs = []
    for _ in range(2):
        simulator = simulated(diagram)
        simulator.AdvanceTo(OFF_GRID)
        runs.append(all_states(diagram, simulator.get_context()))
    assert runs[0] == runs[1]


def test_no_system_keeps_state_of_its_own() -> None:
    """What the objects hold is the same before and after a run, apart from the stopwatch."""
    stopwatch = Stopwatch()
    builder = DiagramBuilder()
    navigation = add_navigation(builder, posts(), stopwatch=stopwatch)
    station = navigation.station
    collision = builder.AddSystem(
        CollisionMonitor(robot=station.robot_geometries, ground=[station.ground], period=0.02)
    )
    builder.Connect(station.GetOutputPort("cheat.contact_results"), collision.GetInputPort("contact_results"))
    arrival = builder.AddSystem(ArrivalMonitor(tolerance=0.1, period=0.02))
    builder.Connect(station.GetOutputPort("localization.state"), arrival.GetInputPort("state"))
    builder.Connect(navigation.goal.get_output_port(), arrival.GetInputPort("goal"))
    builder.Connect(navigation.planner.GetOutputPort("status"), arrival.GetInputPort("status"))
    diagram = builder.Build()

    def held() -> dict[str, Any]:
        return {
            system.GetSystemPathname(): {
                name: structure(value)
                for name, value in vars(system).items()
                if value is not stopwatch and not name.startswith("_pydrake")
            }
            for system in python_systems(diagram)
        }

    before = held()
    assert len(before) == 10
    simulator = Simulator(diagram)
    simulator.AdvanceTo(1.5)
    assert stopwatch.summary("plan")["count"] >= 1
    assert held() == before


def test_structure_tells_hidden_state() -> None:
    """The check above would see a counter, a list that grows, and an array that is written to."""

    class Hoarder(DsmController):
        pass

    scenario = posts()
    hoarder = Hoarder(scenario.robot, scenario.controller, offset=0.0)
    hoarder.count, hoarder.seen, hoarder.last = 0, [], np.zeros(3)
    before = structure(vars(hoarder))
    assert structure(vars(hoarder)) == before
    changes = (
        lambda: setattr(hoarder, "count", 1),
        lambda: hoarder.seen.append(1),
        lambda: hoarder.last.__setitem__(0, 1.0),
    )
    for change in changes:
        change()
        after = structure(vars(hoarder))
        assert after != before
        before = after


def test_python_systems_live_as_long_as_the_simulator() -> None:
    simulator = Simulator(make_diagram(posts()))
    gc.collect()
    simulator.AdvanceTo(0.5)
    diagram = simulator.get_system()
    gc.collect()
    assert diagram.GetOutputPort("controller.twist_command").Eval(simulator.get_context())[0] > 0.0


def test_python_systems_live_as_long_as_the_diagram() -> None:
    diagram = make_diagram(posts())
    gc.collect()
    kinds = {system.get_name(): type(system) for system in diagram.GetSystems()}
    assert kinds["station"] is NavigationStation
    assert kinds["planner"] is StarRoadmapPlanner
    station = diagram.GetSubsystemByName("station")
    assert len(station.robot_geometries) > 0
    planner = diagram.GetSubsystemByName("planner")
    del diagram, station
    gc.collect()
    status = planner.GetOutputPort("status")
    context = planner.CreateDefaultContext()
    assert status.Eval(context) is PlannerStatus.WAITING


def test_python_systems_live_inside_an_outer_diagram() -> None:
    builder = DiagramBuilder()
    builder.AddSystem(make_diagram(posts()))
    outer = builder.Build()
    del builder
    gc.collect()
    simulator = Simulator(outer)
    del outer
    gc.collect()
    simulator.AdvanceTo(0.3)
    gc.collect()
    assert simulator.get_context().get_time() == pytest.approx(0.3)


def test_any_planner_s_guidance_can_be_put_before_the_controller() -> None:
    """The controller alone with the station: a path given by hand, and the certificate from perception."""
    scenario = posts()
    builder = DiagramBuilder()
    world = World("open", (0.0, 0.0, 0.0), (2.0, 0.0))
    station = builder.AddSystem(NavigationStation(world, scenario.robot, scenario.lidar))
    perception = builder.AddSystem(
        StarPerception(scenario.robot, scenario.planner, scenario.controller, rate=scenario.lidar.rate, offset=0.005)
    )
    controller = builder.AddSystem(DsmController(scenario.robot, scenario.controller, offset=0.01))
    for source, name, system, port in (
        (station, "lidar.scan", perception, "scan"),
        (station, "localization.scan_pose", perception, "pose"),
        (perception, "safety_star", controller, "safety_star"),
        (station, "localization.state", controller, "state"),
        (controller, "twist_command", station, "drive.twist_command"),
    ):
        builder.Connect(source.GetOutputPort(name), system.GetInputPort(port))
    builder.ExportInput(controller.GetInputPort("guidance"), "guidance")
    simulator = Simulator(builder.Build())
    guidance = Guidance(np.array([[1.0, 0.5]]), True, RegionStack.of(()))
    simulator.get_system().GetInputPort("guidance").FixValue(simulator.get_mutable_context(), Value(guidance))
    simulator.AdvanceTo(5.0)
    pose = station.GetOutputPort("localization.pose").Eval(station.GetMyContextFromRoot(simulator.get_context()))
    assert np.hypot(*(pose[:2] - (1.0, 0.5))) < 0.1
