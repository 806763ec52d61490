"""The continuous plant goes as the discrete one does, and its simulator as its context says."""

import dataclasses
import math

import numpy as np
import pytest
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from drake_starnav import LidarParameters, RobotParameters, Scenario, StarnavError, World, make_diagram, run_trial
from drake_starnav.scenario.scenario_file import parse_scenario
from drake_starnav.station.navigation_station import add_station
from drake_starnav.station.plant import DISCRETE_ONLY, advance, make_plant_config, make_simulator, plant_config
from drake_starnav.station.robot_geometry import LONGEST_STEP
from tests.helpers.cart import cart_scenario

LIDAR = LidarParameters(beams=36)
FAST = RobotParameters(max_speed=2.0)
OPEN = World("open", (0.0, 0.0, 0.4), (5.0, 0.0))
WORLD = "world: !Obstacles {goal: [2.0, 0.0]}\n"
DISCRETE = {"discrete_contact_approximation": "sap", "sap_near_rigid_threshold": 0.5, "use_sampled_output_ports": True}


class Drive:
    """A robot that is told a constant twist, in a continuous plant or in a discrete one."""

    def __init__(self, world: World = OPEN, twist=(0.8, 0.5), continuous: bool = True, robot=FAST) -> None:
        builder = DiagramBuilder()
        self.station = add_station(builder, world, Scenario("test", None, robot, LIDAR), continuous=continuous)
        source = builder.AddSystem(ConstantVectorSource(twist))
        builder.Connect(source.get_output_port(), self.station.GetInputPort("drive.twist_command"))
        self.simulator = make_simulator(builder.Build())

    def state(self, port: str = "localization.state") -> np.ndarray:
        output = self.station.GetOutputPort(port)
        return output.Eval(output.get_system().GetMyContextFromRoot(self.simulator.get_context()))


@pytest.mark.parametrize("twist", [(0.8, 0.0), (0.8, 2.0), (0.0, -2.0), (-0.4, 1.0)])
def test_the_robot_drives_as_told_and_half_a_step_behind_one_in_a_discrete_plant(twist) -> None:
    runs = [Drive(twist=twist, continuous=continuous) for continuous in (True, False)]
    for run in runs:
        run.simulator.AdvanceTo(3.0)
        assert run.state()[3:] == pytest.approx(twist, abs=1.3e-3)
    (x, y), (v, omega), late = runs[1].state()[:2], np.abs(twist), 0.5 * LONGEST_STEP
    assert runs[0].state()[:2] == pytest.approx((x, y), abs=late * (v + omega * math.hypot(x, y)) + 1e-4)


@pytest.mark.parametrize("mass_error", [0.0, 0.5])
def test_the_motors_give_no_more_than_their_efforts(mass_error: float) -> None:
    """To be at full speed at once, the wheels would need far more than 2 N m; a step late, they accelerate alike."""
    heavy = RobotParameters(mass_error=mass_error, max_speed=2.0)
    runs = [Drive(twist=(2.0, 0.0), continuous=continuous, robot=heavy) for continuous in (True, False)]
    speeds = []
    for until in (0.1, 0.2):
        for run in runs:
            run.simulator.AdvanceTo(until)
        speeds.append([run.state()[3] for run in runs])
    acceleration, expected = np.diff(speeds, axis=0)[0] / 0.1
    assert acceleration == pytest.approx(expected, rel=0.5 * LONGEST_STEP)
    assert acceleration < 2.0 * 2.0 / 0.05 / (8.2 * (1.0 + mass_error) + 2.0 * 0.5)
    assert speeds[0][0] == pytest.approx(speeds[0][1], abs=LONGEST_STEP * acceleration)


def test_who_drives_against_a_post_is_held_up_by_it() -> None:
    for continuous in (True, False):
        run = Drive(World("post", (0.0, 0.0, 0.0), (5.0, 0.0), cylinders=[(1.0, 0.0, 0.2)]), (0.5, 0.0), continuous)
        run.simulator.AdvanceTo(4.0)
        assert run.state()[0] == pytest.approx(1.0 - 0.2 - 0.25, abs=2e-3)


def test_steps_are_no_longer_than_they_may_be_whatever_the_plants_error() -> None:
    run = Drive()
    run.simulator.AdvanceTo(1.0)
    assert run.simulator.get_integrator().get_fixed_step_mode()
    between_scans = math.ceil(1.0 / LIDAR.rate / LONGEST_STEP)
    assert run.simulator.get_num_steps_taken() == pytest.approx(LIDAR.rate * between_scans, abs=2)


@pytest.mark.parametrize("key", sorted(DISCRETE_ONLY))
def test_settings_that_a_continuous_plant_ignores_make_it_discrete(key: str) -> None:
    for name, value, time_step in ((key, DISCRETE[key], 0.005), ("contact_model", "point", 0.0)):
        scenario = Scenario("test", None, RobotParameters(), LIDAR, plant_config={name: value})
        assert add_station(DiagramBuilder(), OPEN, scenario, continuous=True).plant.time_step() == time_step


@pytest.mark.parametrize("continuous", [True, False])
def test_what_drake_cannot_simulate_is_said(continuous: bool) -> None:
    with pytest.raises(StarnavError, match=r"simulation failed at \d\.\d\d\d s: .*; allowed: "):
        advance(Drive(continuous=continuous, twist=(math.nan, 0.0)).simulator, 1.0)


@pytest.mark.parametrize("continuous", [True, False])
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_state_that_is_not_finite_ends_the_run_where_it_arises(continuous: bool, value: float) -> None:
    run = Drive(continuous=continuous)
    advance(run.simulator, 0.1)
    plant = run.station.plant
    context = plant.GetMyMutableContextFromRoot(run.simulator.get_mutable_context())
    state = context.get_mutable_continuous_state_vector() if continuous else context.get_mutable_discrete_state(0)
    state.SetAtIndex(plant.num_positions() - 1, value)  # a wheel's angle, on which no force depends
    with pytest.raises(StarnavError, match=r"simulation failed at 0\.1[0-9]* s: .*; allowed: ") as caught:
        advance(run.simulator, 1.0)
    assert "\n" not in str(caught.value)


def test_settings_are_laid_over_ours() -> None:
    scenario = parse_scenario(WORLD + "plant_config: {penetration_allowance: 0.002}", name="x")
    config = make_plant_config(scenario.plant_config, plant_config(0.005))
    assert (config.penetration_allowance, config.contact_model, config.time_step) == (0.002, "point", 0.005)
    scenario = parse_scenario(WORLD, name="x", overrides=["plant_config.contact_model=hydroelastic_with_fallback"])
    station = make_diagram(scenario).GetSubsystemByName("station")
    assert station.plant.get_contact_model().name == "kHydroelasticWithFallback"


@pytest.mark.parametrize(
    "text, words",
    [
        ("plant_config: {contact_modle: point}", "unknown key plant_config.contact_modle: did you mean contact_model"),
        ("plant_config: {time_step: 0.01}", "plant_config.time_step is 0.01; allowed: simulation.time_step"),
        ("plant_config: {penetration_allowance: much}", "penetration_allowance is 'much'; allowed: 1e-09 <= x"),
        ("simulator_config: {accuracy: [1]}", "simulator_config is .*; allowed: a mapping of names to numbers"),
        ("simulator_config: {speed: 1}", "unknown key simulator_config.speed"),
        ("plant_config: {contact_model: sap}", "plant_config.contact_model is 'sap'; allowed: what Drake takes, which"),
        ("plant_config: {sap_near_rigid_threshold: -1}", "sap_near_rigid_threshold is -1; allowed: 0 <= x"),
        ("plant_config: {stiction_tolerance: .inf}", "stiction_tolerance is inf; allowed: 1e-09 <= x"),
        ("simulator_config: {integration_scheme: foo}", "simulator_config.integration_scheme is 'foo'; allowed: what"),
        ("simulator_config: {max_step_size: 0}", "simulator_config.max_step_size is 0; allowed: 1e-05 <= x"),
        ("simulator_config: {accuracy: .nan}", "simulator_config.accuracy is nan; allowed: 1e-09 <= x"),
        ("simulator_config: {start_time: -1}", "simulator_config.start_time is -1; allowed: 0"),
    ],
)
def test_what_drake_does_not_know_is_refused(text: str, words: str) -> None:
    with pytest.raises(StarnavError, match=words):
        run_trial(parse_scenario(WORLD + text, name="x"))


def test_a_solver_that_would_not_turn_the_wheels_is_refused() -> None:
    with pytest.raises(StarnavError, match="is 'tamsi', .*; allowed: sap, similar, lagged$"):
        make_plant_config({"discrete_contact_approximation": "tamsi"}, plant_config(0.005))


def test_steps_too_long_for_a_small_robot_are_refused_with_the_figure(tmp_path) -> None:
    scenario = cart_scenario(0.02, tmp_path)
    with pytest.raises(StarnavError, match=r"time step is 0\.005 s .*; allowed: at most 0\.00313 s"):
        make_diagram(scenario)
    make_diagram(dataclasses.replace(scenario, simulation=dataclasses.replace(scenario.simulation, time_step=0.003)))
