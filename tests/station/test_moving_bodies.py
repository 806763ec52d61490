"""Moving obstacles are where their paths say, for the plant and for the lidar, and touch nothing but robots."""

import numpy as np
import pytest

from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.station.moving_bodies import MOVING_OBSTACLES
from drake_starnav.worlds import Crowd, DynaBarn, make_world, moving_obstacle_states
from tests.station.test_navigation_station import Drive


def places(drive: Drive) -> np.ndarray:
    """Of all moving obstacles, shape (n, 2), m."""
    plant = drive.station.plant
    context = plant.GetMyContextFromRoot(drive.context)
    return plant.GetPositions(context, plant.GetModelInstanceByName(MOVING_OBSTACLES)).reshape(-1, 2)


def count_contacts(drive: Drive) -> int:
    """How many pairs touch besides the robot and the ground."""
    results = drive.out("cheat.contact_results")
    pairs = [results.point_pair_contact_info(k).point_pair() for k in range(results.num_point_pair_contacts())]
    return sum(drive.station.ground not in (pair.id_A, pair.id_B) for pair in pairs)


@pytest.mark.parametrize("kind", [Crowd(moving_obstacles=(20, 20)), DynaBarn(id=3)])
def test_bodies_are_where_their_paths_say(kind) -> None:
    """Also where a path restarts elsewhere, and whatever the robot does."""
    world = make_world(kind, 1, 0.25)
    drive = Drive(world, lidar=LidarParameters(beams=3))
    drive.command(0.0, 0.5)
    for time in (0.0, 0.05, 1.0, 3.335, 10.0, 20.0):
        if time > 0.0:
            drive.simulator.AdvanceTo(time)
        expected, _ = moving_obstacle_states(world.moving_obstacles, np.array([time]))
        assert places(drive) == pytest.approx(expected[0], abs=1e-6)
        assert count_contacts(drive) == 0
