"""What is recorded, and how what cannot be is reported."""

import pytest
from pydrake.multibody.plant import AddMultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.navigation import Navigation
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.schema import Scenario
from drake_starnav.station.navigation_station import NavigationStation
from drake_starnav.station.plant import plant_config
from drake_starnav.station.robot_interface import RobotInterface
from drake_starnav.station.robot_model import add_robot
from drake_starnav.visualization.recorder import (
    Recorder,
    robot_path,
)
from drake_starnav.worlds.world import World

ROBOT = RobotParameters()


@pytest.mark.parametrize("own_plant", [False, True])
def test_any_diagram_with_a_robot_of_ours_is_recorded(own_plant: bool, tmp_path) -> None:
    world, builder = World("nothing planned", (0.0, 0.0, 0.0), (1.0, 0.0)), DiagramBuilder()
    scenario = Scenario("test", None, ROBOT, LidarParameters(beams=36))
    if own_plant:
        plant, scene_graph = AddMultibodyPlant(plant_config(0.005), builder)
        model = add_robot(plant, scene_graph, ROBOT, world.start)
        plant.Finalize()
        station = builder.AddSystem(RobotInterface(plant, scene_graph, model, scenario))
        builder.Connect(scene_graph.get_query_output_port(), station.GetInputPort("geometry_query"))
        builder.Connect(plant.get_state_output_port(model), station.GetInputPort("multibody_state"))
        builder.Connect(station.GetOutputPort("desired_state"), plant.get_desired_state_input_port(model))
    else:
        station = builder.AddSystem(NavigationStation(world, scenario))
    still = builder.AddSystem(ConstantVectorSource([0.0, 0.0]))
    builder.Connect(still.get_output_port(), station.GetInputPort("drive.twist_command"))
    recorder = Recorder(tmp_path / "page.html")
    recorder.add_to(builder, Navigation(world, station))
    simulator = Simulator(builder.Build())
    recorder.start()
    simulator.AdvanceTo(0.2)
    recorder.finish()
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "nothing planned" in page and robot_path(station).rpartition("/")[2] == "base_link"
