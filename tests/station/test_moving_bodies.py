"""Moving obstacles are where their paths say, for the plant and for the lidar, and touch nothing but robots."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.schema import Scenario, SimulationParameters
from drake_starnav.station.moving_bodies import MOVING_OBSTACLES
from drake_starnav.station.navigation_station import NavigationStation
from drake_starnav.worlds import Crowd, DynaBarn, make_world
from drake_starnav.worlds.moving_obstacles import moving_obstacle_states
from drake_starnav.worlds.world import World

STEP = 0.005


class Run:
    """A robot that stands in a world where others move."""

    def __init__(self, world: World, beams: int = 3, twist=(0.0, 0.0)) -> None:
        lidar = LidarParameters(beams=beams, noise=0.0)
        self.station = NavigationStation(
            world, Scenario("test", None, RobotParameters(), lidar, simulation=SimulationParameters(time_step=STEP))
        )
        self.simulator = Simulator(self.station)
        self.context = self.simulator.get_mutable_context()
        self.station.GetInputPort("drive.twist_command").FixValue(self.context, twist)
        self.simulator.Initialize()

    def places(self) -> np.ndarray:
        plant = self.station.plant
        context = plant.GetMyContextFromRoot(self.context)
        return plant.GetPositions(context, plant.GetModelInstanceByName(MOVING_OBSTACLES)).reshape(-1, 2)

    def contacts(self) -> int:
        """How many pairs touch besides the robot and the ground."""
        results = self.station.GetOutputPort("cheat.contact_results").Eval(self.context)
        pairs = [results.point_pair_contact_info(k).point_pair() for k in range(results.num_point_pair_contacts())]
        return sum(self.station.ground not in (pair.id_A, pair.id_B) for pair in pairs)


@pytest.mark.parametrize("kind", [Crowd(moving_obstacles=(20, 20)), DynaBarn(id=3)])
def test_bodies_are_where_their_paths_say(kind) -> None:
    """Also where a path restarts elsewhere, and whatever the robot does."""
    world = make_world(kind, 1, 0.25)
    run = Run(world, twist=(0.0, 0.5))
    for time in (0.0, 0.05, 1.0, 3.335, 10.0, 20.0):
        if time > 0.0:
            run.simulator.AdvanceTo(time)
        expected, _ = moving_obstacle_states(world.moving_obstacles, np.array([time]))
        assert run.places() == pytest.approx(expected[0], abs=1e-6)
        assert run.contacts() == 0
