"""What follows from the shapes, wheels and masses of a robot's model."""

import pytest

from drake_starnav.errors import StarnavError
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.schema import Scenario
from drake_starnav.station.navigation_station import NavigationStation
from drake_starnav.worlds.world import World
from tests.helpers.robots import casters, robot, standing, wheel

WINGS = [
    [[0.16, 1.2], [0.03, 1.2], [0.03, -1.17], [0.16, -1.17]],
    [[0.69, 0.045], [-0.44, 0.045], [-0.44, -0.15], [0.69, -0.15]],
]
"""Wheels that stand within this body are 5 cm apart."""
CART = robot(wheel("left", 0.0, 0.1), wheel("right", 0.0, -0.1), casters(0.15))


@pytest.mark.parametrize("body", [{"footprint": WINGS}, {"radius": 0.085}], ids=["between wings", "in a small disc"])
def test_a_shipped_robot_whose_wheels_come_too_close_to_turn_it_is_refused(body) -> None:
    """It would turn on where it is certified to have stopped."""
    declared = Scenario("test", None, RobotParameters(model="carrier", max_yaw_acceleration=3.0, **body))
    with pytest.raises(StarnavError, match="its wheels turn it with at most [12][.][0-9]+ rad/s"):
        NavigationStation(World("open", (0.0, 0.0, 0.0), (5.0, 0.0)), declared)


def test_a_cart_turns_as_its_wheels_grip(tmp_path) -> None:
    standing(tmp_path, CART, max_yaw_acceleration=4.0)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('<inertia ixx="0.06" iyy="0.06" izz="0.06"', '<inertia ixx="60" iyy="60" izz="60"'),
        ('<axis xyz="0 0 1"/>', '<axis xyz="0 0 1"/><limit effort="0.01" velocity="20"/>'),
    ],
    ids=["inertia of a design program", "weak motors"],
)
def test_what_keeps_a_cart_from_turning_is_said(tmp_path, old: str, new: str) -> None:
    assert old in CART
    with pytest.raises(StarnavError, match="its wheels turn it with at most .*; allowed: .*effort .*inertia"):
        standing(tmp_path, CART.replace(old, new), max_yaw_acceleration=4.0)
