"""In a plant of the user's own holds what holds in a station: body, heights, floor, start and time step."""

import contextlib
import warnings

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.geometry import Box
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlant, CoulombFriction
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from drake_starnav.errors import StarnavError
from drake_starnav.navigation import Parts, add_navigation
from drake_starnav.navigation.robot import robot_world
from drake_starnav.scenario.scenario_file import parse_scenario
from drake_starnav.station.model_world import add_packages
from drake_starnav.station.navigation_station import add_station
from drake_starnav.station.plant import make_simulator, plant_config
from drake_starnav.station.robot_interface import RobotInterface, connect_robot
from drake_starnav.station.robot_model import add_robot
from drake_starnav.station.world_geometry import add_ground
from drake_starnav.systems.release import release
from drake_starnav.utils.resources import find_model_path
from drake_starnav.worlds.world import World

SCENARIO = parse_scenario("world: !Obstacles {}", name="mine")
OPEN = World("open", (0.0, 0.0, 0.0), (4.0, 0.0))


def navigate(
    world: World = OPEN, *, floor: bool = True, kerb: bool = False, step: float = 0.005, **parts
) -> RobotInterface:
    """A robot in a plant of one's own, with its navigation."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlant(plant_config(step), builder)
    if floor:
        add_ground(plant, world.extent)
    if kerb:
        friction = CoulombFriction(1.0, 1.0)
        plant.RegisterCollisionGeometry(
            plant.world_body(), RigidTransform([1.2, 0.0, 0.05]), Box(0.4, 3.0, 0.1), "kerb", friction
        )
    model = add_robot(plant, scene_graph, SCENARIO.robot, (0.0, 0.0, 0.0))
    plant.Finalize()
    robot = builder.AddNamedSystem("robot", RobotInterface(plant, scene_graph, model, SCENARIO))
    connect_robot(builder, plant, scene_graph, model, robot)
    add_navigation(builder, SCENARIO, Parts(world, robot, **parts))
    return robot


def test_the_time_step_is_that_of_the_plant() -> None:
    assert navigate(step=0.001).scenario.simulation.time_step == 0.001


def test_a_parser_of_one_s_own_finds_shipped_models_and_a_world_those_of_drake() -> None:
    plant, _ = AddMultibodyPlant(plant_config(), DiagramBuilder())
    parser = Parser(plant)
    add_packages(parser)
    assert parser.AddModels(url="package://drake_starnav/worlds/furniture.sdf")
    text = "world: !Model {directives: package://%s, start: [0, 0, 0], goal: [3, 0]}"
    robot_world(parse_scenario(text % "drake/examples/quadrotor/warehouse.sdf", name="warehouse"), 0)
    with pytest.raises(StarnavError, match="unknown package 'nobody'"):
        robot_world(parse_scenario(text % "nobody/world.sdf", name="none"), 0)


@pytest.mark.parametrize("simulator", [Simulator, make_simulator])
def test_a_plain_simulator_of_a_continuous_plant_is_warned_of(simulator) -> None:
    builder = DiagramBuilder()
    station = add_station(builder, OPEN, SCENARIO, continuous=True)
    builder.ExportInput(station.GetInputPort("drive.twist_command"), "twist")
    made = simulator(builder.Build())
    made.get_system().get_input_port().FixValue(made.get_mutable_context(), [0.0, 0.0])
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        made.Initialize()
    assert any("allowed: make_simulator" in str(each.message) for each in said) is (simulator is Simulator)


def test_no_floor_and_a_start_in_an_obstacle_are_refused() -> None:
    with pytest.raises(StarnavError, match="no floor, .* add_ground"):
        navigate(floor=False)
    with pytest.raises(StarnavError, match=r"start is \[0, 0\], inside cylinders"):
        navigate(World("post", (0.0, 0.0, 0.0), (4.0, 0.0), cylinders=np.array([[0.3, 0.0, 0.3]])))


def test_what_the_lidar_does_not_see_and_another_start_are_warned_of() -> None:
    with pytest.warns(UserWarning, match="does not see: kerb"):
        navigate(kerb=True)
    with pytest.warns(UserWarning, match="the robot begins at"):
        navigate(World("elsewhere", (2.0, 0.0, 0.0), (4.0, 0.0)))


def test_a_robot_of_a_parser_is_told_of_add_robot() -> None:
    plant, scene_graph = AddMultibodyPlant(plant_config(), DiagramBuilder())
    (model,) = Parser(plant).AddModels(str(find_model_path("robots", "starbot.urdf")))
    plant.Finalize()
    with pytest.raises(StarnavError, match="allowed: add_robot"):
        RobotInterface(plant, scene_graph, model, SCENARIO)


class Planner(LeafSystem):
    """Sends something else than guidance."""

    def __init__(self, sent: object) -> None:
        super().__init__()
        if isinstance(sent, int):
            self.DeclareVectorOutputPort("guidance", sent, lambda context, output: None)
        else:
            self.DeclareAbstractOutputPort("guidance", lambda: Value[object](sent), lambda context, output: None)


@pytest.mark.parametrize("sent", [2, [(4.0, 0.0)]])
def test_a_planner_that_sends_no_guidance_is_named(sent: object) -> None:
    with pytest.raises(StarnavError, match="^planner: output port guidance is"):
        navigate(planner=Planner(sent))


def test_a_system_of_the_users_keeps_what_it_noted() -> None:
    builder, system = DiagramBuilder(), Planner(2)
    system.notes = [1]
    builder.AddSystem(system)
    with contextlib.suppress(RuntimeError):
        release(builder.Build())
    assert system.notes == [1]
