"""The simulated robot and its world; on a real robot, its drivers take their place."""

from drake_starnav.station.model_world import add_packages
from drake_starnav.station.navigation_station import Station, StationInterface, add_station, simulated
from drake_starnav.station.plant import plant_config
from drake_starnav.station.robot_interface import connect_robot
from drake_starnav.station.robot_model import add_robot
from drake_starnav.station.wheel_drive import WheelSpeedCommand
from drake_starnav.station.world_geometry import add_ground, add_world

__all__ = [
    "Station",
    "StationInterface",
    "WheelSpeedCommand",
    "add_ground",
    "add_packages",
    "add_robot",
    "add_station",
    "add_world",
    "connect_robot",
    "plant_config",
    "simulated",
]
