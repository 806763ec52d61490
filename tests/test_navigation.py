"""The whole loop as one diagram: what it exports, what it is wired of, and what lives as long as it."""

import dataclasses
import gc

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.multibody.plant import ContactModel
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import LogVectorOutput

from drake_starnav.baselines.baseline_controller import BaselineController
from drake_starnav.errors import StarnavError
from drake_starnav.navigation import Parts, add_navigation, make_diagram
from drake_starnav.planning import PlannerStatus
from drake_starnav.scenario.scenario_file import parse_scenario
from drake_starnav.station.navigation_station import NavigationStation
from drake_starnav.station.plant import make_simulator
from drake_starnav.surroundings.observation import Observation
from drake_starnav.systems.star_roadmap_planner import StarRoadmapPlanner
from drake_starnav.systems.twist_shield import TwistShield, Unshielded
from drake_starnav.worlds import make_world
from drake_starnav.worlds.world import World
from tests.helpers.posts import GOALS, LOOP_OUTPUTS, STATION_OUTPUTS, posts, simulated

EXPORTS = [*LOOP_OUTPUTS, *STATION_OUTPUTS]

HALF = ["lidar.angle_min=-1.5707963", "lidar.angle_max=1.5707963"]


def test_exports_what_its_docstring_says() -> None:
    diagram = make_diagram(posts())
    assert [diagram.get_output_port(k).get_name() for k in range(diagram.num_output_ports())] == EXPORTS
    assert diagram.num_input_ports() == 0
    assert diagram.get_name() == "posts"
    for name in LOOP_OUTPUTS:
        assert f"`{name}`" in make_diagram.__doc__
    simulator = Simulator(diagram)
    simulator.AdvanceTo(0.1)
    for name in EXPORTS:
        diagram.GetOutputPort(name).Eval(simulator.get_context())


def test_the_diagram_and_its_simulator_keep_the_settings_of_plant_and_integrator() -> None:
    changes = ["plant_config.contact_model=hydroelastic", "plant_config.penetration_allowance=0.002"]
    changes += ["simulator_config.target_realtime_rate=1000", "simulator_config.accuracy=0.002"]
    diagram = make_diagram(posts(overrides=changes))
    plant = diagram.navigation.station.plant
    assert plant.get_contact_model() == ContactModel.kHydroelasticsOnly
    simulator = make_simulator(diagram)
    assert simulator.get_target_realtime_rate() == 1000.0
    assert not make_simulator(diagram, settings={}).get_target_realtime_rate()
    with pytest.raises(StarnavError, match="unknown key simulator_config.speed"):
        make_diagram(posts(overrides=["simulator_config.speed=2"]))


def test_the_systems_are_wired_and_the_robot_drives_to_its_goal() -> None:
    diagram = make_diagram(posts())
    simulator = Simulator(diagram)
    simulator.AdvanceTo(9.0)
    context = simulator.get_context()
    assert np.hypot(*(diagram.GetOutputPort("localization.pose").Eval(context)[:2] - GOALS[0])) < 0.1
    assert diagram.GetOutputPort("planner.status").Eval(context) is PlannerStatus.APPROACHING


@pytest.mark.parametrize("method", ["star", "foa", "dwa", "dsm"])
def test_at_its_goal_the_robot_stands(method: str) -> None:
    text = "world: !Obstacles {cylinders: [[0.9, -1.2, 0.3]], start: [0.2, 0.0, 0.3], goal: [1.5, 0.0]}"
    diagram = make_diagram(parse_scenario(text, name="near", method=method))
    simulator = Simulator(diagram)
    simulator.AdvanceTo(12.0)
    state = diagram.GetOutputPort("localization.state")
    before = state.Eval(simulator.get_context()).copy()
    assert np.hypot(*(before[:2] - (1.5, 0.0))) < 0.15
    simulator.AdvanceTo(13.0)
    after = state.Eval(simulator.get_context())
    assert after == pytest.approx(before, abs=5e-3)
    assert after[3:] == pytest.approx([0.0, 0.0], abs=5e-3)


@pytest.mark.parametrize(
    ("method", "changes", "words"),
    [
        ("star", ["lidar.angle_min=-1.5", "lidar.angle_max=1.5"], "views that reach 90 degrees to each side"),
        ("star", ["lidar.angle_min=-0.3", "lidar.angle_max=4.4"], "views that reach 90 degrees to each side"),
        ("star", ["lidar.angle_min=1.6", "lidar.angle_max=4.7"], "views that reach 90 degrees to each side"),
        ("star", [*HALF, "obstacles.max_speed=0.5"], "views that reach 130 degrees to each side"),
        (
            "star",
            ["lidar.range_max=1.2", "obstacles.max_speed=0.8"],
            "obstacles that move at up to 0.8 m/s; allowed: at ",
        ),
        ("star", ["lidar.beams=35"], "lidar.beams is 35, one every 10.3 degrees, with a certificate"),
        ("star", ["lidar.range_max=0.27"], "lidar.range_max is 0.27 m, robot.radius with its margin 0.2[78]"),
    ],
)
def test_what_the_controller_would_not_keep_is_refused(method: str, changes: list[str], words: str) -> None:
    with pytest.raises(StarnavError, match=words):
        make_diagram(posts(method=method, overrides=changes))


def test_a_narrow_view_is_enough_without_the_certificate_and_half_a_turn_with_it() -> None:
    assert make_diagram(posts(overrides=HALF)).get_name() == "posts"
    narrow = ["lidar.angle_min=-1", "lidar.angle_max=1"]
    assert make_diagram(posts(method="star_paper", overrides=narrow)).get_name() == "posts"


def test_a_world_and_a_seed_may_be_given() -> None:
    world = World("other", (2.0, 3.0, 1.0), (4.0, 3.0))
    diagram = make_diagram(posts(), Parts(world))
    context = diagram.CreateDefaultContext()
    assert diagram.GetOutputPort("localization.pose").Eval(context) == pytest.approx([2.0, 3.0, 1.0])
    ranges = []
    for seed in (0, 1):
        diagram = make_diagram(posts(), seed=seed)
        simulator = Simulator(diagram)
        simulator.Initialize()
        ranges.append(diagram.GetOutputPort("lidar.ranges").Eval(simulator.get_context()).copy())
    assert not np.array_equal(*ranges)


@pytest.mark.parametrize(
    ("section", "name", "value", "words"),
    [
        ("drive", "delay", 0.3, "the station has drive.delay 0.3, the scenario 0.0; allowed: the same"),
        ("lidar", "beams", 40, "the station has lidar.beams 40, the scenario 360; allowed: the same"),
        ("localization", "drift", 0.1, "the station has localization.drift 0.1, the scenario 0.0; allowed: the same"),
    ],
)
def test_a_station_made_with_other_parameters_is_refused(section: str, name: str, value: float, words: str) -> None:
    scenario, builder = posts(), DiagramBuilder()
    other = dataclasses.replace(scenario, **{section: dataclasses.replace(getattr(scenario, section), **{name: value})})
    world = make_world(scenario.world, 0, scenario.robot.radius)
    station = builder.AddNamedSystem("station", NavigationStation(world, other))
    with pytest.raises(StarnavError, match=words):
        add_navigation(builder, scenario, Parts(world, station))


def test_two_navigations_in_one_builder_are_refused() -> None:
    builder = DiagramBuilder()
    add_navigation(builder, posts())
    with pytest.raises(StarnavError, match="the builder has a system named goal already; allowed: one navigation"):
        add_navigation(builder, posts())


def test_a_run_begins_anew_when_time_is_set_back() -> None:
    simulator = Simulator(make_diagram(posts()))
    context = simulator.get_mutable_context()
    start = context.Clone()
    simulator.AdvanceTo(8.0)
    pose = simulator.get_system().GetOutputPort("localization.pose")
    first = pose.Eval(context).copy()
    station = simulator.get_system().GetSubsystemByName("station")
    plant = station.plant
    state = plant.GetPositionsAndVelocities(plant.GetMyContextFromRoot(start))
    plant.SetPositionsAndVelocities(plant.GetMyMutableContextFromRoot(context), state)
    context.SetTime(0.0)
    simulator.Initialize()
    assert np.hypot(*(pose.Eval(context) - first)[:2]) > 1.0
    simulator.AdvanceTo(8.0)
    assert np.hypot(*(pose.Eval(context) - first)[:2]) < 0.1


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


def test_where_the_believed_pose_errs_a_matcher_stands_before_the_planner() -> None:
    scenario = posts(overrides=["localization.drift=0.02"])
    navigation = add_navigation(DiagramBuilder(), scenario)
    assert navigation.localization("state").get_system() is navigation.matcher
    assert navigation.certificate.get_system() is navigation.matcher
    exports = make_diagram(scenario)
    assert {f"matcher.{name}" for name in ("observation", "state", "pose", "scan_pose", "guidance", "certificate")} < {
        exports.get_output_port(k).get_name() for k in range(exports.num_output_ports())
    }
    without = posts(overrides=["localization.drift=0.02", "localization.matching=false"])
    assert add_navigation(DiagramBuilder(), without).matcher is None


@pytest.mark.parametrize(
    ("method", "names"),
    [
        ("dwa", ["station", "goal", "controller", "shield"]),
        ("foa_roadmap", ["station", "goal", "perception", "planner", "controller", "shield"]),
        ("dsm", ["station", "goal", "controller", "shield", "known_world"]),
    ],
)
def test_a_baseline_takes_the_place_of_the_star_controller(method: str, names: list[str]) -> None:
    scenario = posts(method=method)
    builder = DiagramBuilder()
    navigation = add_navigation(builder, scenario)
    assert isinstance(navigation.controller, BaselineController)
    assert isinstance(navigation.shield, Unshielded) and not isinstance(navigation.shield, TwistShield)
    assert [system.get_name() for system in builder.GetSystems()] == names
    diagram = make_diagram(scenario)
    exports = [diagram.get_output_port(k).get_name() for k in range(diagram.num_output_ports())]
    assert exports == [name for name in EXPORTS if navigation.planner or not name.startswith("planner.")]
    simulated(diagram).AdvanceTo(0.5)


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
    context = planner.CreateDefaultContext()
    planner.GetInputPort("observation").FixValue(context, Value(Observation.none()))
    planner.GetInputPort("goal").FixValue(context, np.zeros(2))
    assert planner.GetOutputPort("status").Eval(context) is PlannerStatus.WAITING
