"""Parameters for which the guarantees would not hold; they are refused before anything is wired."""

import dataclasses

from drake_starnav.errors import StarnavError
from drake_starnav.navigation.methods import BY_KIND
from drake_starnav.regions.margins import Margins
from drake_starnav.regions.perception import check_view
from drake_starnav.robot import Limits
from drake_starnav.scenario import Scenario
from drake_starnav.scenario.error_budget import error_budget
from drake_starnav.scenario.margins import derive_margins
from drake_starnav.station.navigation_station import StationInterface
from drake_starnav.station.robot_checks import TOLERANCE

HARDEST_BRAKING = 6.0
"""Deceleration up to which the shipped robots' wheels do not slide, m/s^2; braking unloads them."""


def check_interface(scenario: Scenario, station: StationInterface) -> None:
    """Raise a `StarnavError` where a station was made with parameters that navigation does not expect."""
    robot = station.robot_interface
    for section in ("lidar", "localization", "drive", "robot"):
        has, declared = getattr(robot, section), getattr(scenario, section)
        for field in dataclasses.fields(declared):
            value, wanted = getattr(has, field.name), getattr(declared, field.name)
            if value != wanted and (section != "robot" or field.name in Limits._fields):
                raise StarnavError(
                    f"the station has {section}.{field.name} {value}, the scenario {wanted}; allowed: the same, as "
                    "margins and predictions follow from it"
                )
    step, radius = scenario.simulation.time_step, scenario.robot.radius
    if robot.time_step != step:
        raise StarnavError(
            f"the station has time_step {robot.time_step:g} s, the scenario's simulation.time_step is {step:g} s; "
            "allowed: the same"
        )
    if robot.reach > radius + TOLERANCE:
        raise StarnavError(
            f"robot.radius is {radius:g} m, and link {robot.farthest} of the station's robot reaches {robot.reach:.3f} "
            "m from its axis; allowed: a radius that holds all of it, folded as the joints' default positions say"
        )


def validated_margins(scenario: Scenario) -> Margins:
    """The margins of a scenario; a `StarnavError` where the guarantees of its controller would not hold."""
    controller, lidar = scenario.controller, scenario.lidar
    margins = derive_margins(scenario)
    if not BY_KIND[controller.kind].shielded:
        return margins
    budget = error_budget(scenario).symbols
    _check_beams(scenario, budget["D"])
    reach = scenario.robot.radius + margins.preferred
    if lidar.range_max <= reach:
        raise StarnavError(
            f"lidar.range_max is {lidar.range_max:g} m, robot.radius with its margin {reach:g} m; allowed: a lidar "
            "that sees farther than the robot reaches"
        )
    backwards = scenario.obstacles.max_speed > 0.0
    check_view(lidar.field_of_view, backwards=backwards)
    _check_range(scenario, reach + budget["F"])
    _check_braking(scenario)
    return margins


def _check_beams(scenario: Scenario, distance: float) -> None:
    """Two beams must be less apart than the radius where the robot must begin to stop (m): walls would seem open."""
    robot, lidar = scenario.robot, scenario.lidar
    if distance * lidar.widest_gap > robot.radius:
        raise StarnavError(
            f"lidar.beams is {lidar.beams}: at {distance:.3g} m, where a robot with robot.max_speed "
            f"{robot.max_speed:g} m/s and robot.max_acceleration {robot.max_acceleration:g} m/s^2 must begin to stop, "
            f"two beams are {distance * lidar.widest_gap:.3g} m apart; allowed: at most robot.radius, "
            f"{robot.radius:g} m"
        )


def _check_braking(scenario: Scenario) -> None:
    """A robot that slides while braking stops later than certified."""
    hardest = scenario.robot.max_acceleration
    if hardest > HARDEST_BRAKING:
        raise StarnavError(
            f"robot.max_acceleration is {hardest:g} m/s^2, with a certificate; allowed: at most "
            f"{HARDEST_BRAKING:g} m/s^2, as wheels that brake harder slide"
        )


def _check_range(scenario: Scenario, needed: float) -> None:
    """The lidar must see obstacles that approach in time for the robot to stand, from `needed`, m."""
    range_max, speed = scenario.lidar.range_max, scenario.obstacles.max_speed
    if speed > 0.0 and range_max < needed:
        raise StarnavError(
            f"lidar.range_max is {range_max:g} m with obstacles that move at up to {speed:g} m/s; allowed: at least "
            f"{needed:.3g} m, as that much of the way is left when one is seen until the robot stands"
        )
