"""Parameters for which the guarantees would not hold; they are refused before anything is wired."""

import dataclasses
import warnings
from collections.abc import Sequence

import numpy as np

from drake_starnav.control.path_following import GOAL_REACHED
from drake_starnav.errors import StarnavError, counted, said_by, shown
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.mounts import ON_AXIS, Mount
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.navigation.robot import DECLARED, Robot
from drake_starnav.robot import Limits, RobotParameters
from drake_starnav.scenario.error_budget import evaluate_error_budget
from drake_starnav.scenario.margins import AVERAGED_NOISE, derive_margins
from drake_starnav.scenario.schema import Scenario
from drake_starnav.station.navigation_station import StationInterface
from drake_starnav.station.robot_body import HOLDS_ALL
from drake_starnav.station.robot_geometry import TOLERANCE
from drake_starnav.station.robot_interface import POSE_PORTS, RobotInterface
from drake_starnav.station.unseen import warn_of_unseen
from drake_starnav.surroundings.erosion import BEARINGS
from drake_starnav.surroundings.margins import Margins
from drake_starnav.surroundings.perception import check_fields_of_view
from drake_starnav.surroundings.unseen import find_initial_disc_radius
from drake_starnav.systems.star_perception import lidar_names
from drake_starnav.worlds.view import scan_from, visible_shapes
from drake_starnav.worlds.world import World

HARDEST_BRAKING = 6.0
"""Deceleration up to which the shipped robots' wheels do not slide, m/s^2; braking unloads them."""
TIGHTEST_CIRCLE, QUICKEST_LOCK = 0.2, 0.5
"""Least radius of a car's circles, m, or half of its lever if that is more, and least time from one lock of its wheels
to the other, s: what samples of a motion miss is bounded for no others (docs/proof.md)."""


def check_interface(scenario: Scenario, station: Robot) -> None:
    """Raise a `StarnavError` where a station was made with parameters that navigation does not expect."""
    robot = station.scenario
    scans = [f"{lidar}.scan" for lidar in lidar_names("lidar", len(station.mounts))]
    for name in (*scans, *(f"localization.{each}" for each in POSE_PORTS)):
        try:
            station.GetOutputPort(name)
        except RuntimeError as error:
            raise StarnavError(f"station: {said_by(error)}; allowed: a Robot, which has {name}") from None
    counts = len(robot.all_lidars), len(scenario.all_lidars), len(station.mounts)
    if len(set(counts)) > 1:
        raise StarnavError(
            f"the station declares {counted(counts[0], 'lidar')} and mounts {counts[2]}, the scenario declares "
            f"{counts[1]}; allowed: the same number"
        )
    pairs = [("lidar", *each) for each in zip(robot.all_lidars, scenario.all_lidars, strict=True)]
    pairs += [(name, getattr(robot, name), getattr(scenario, name)) for name in DECLARED]
    for section, made_section, declared_section in pairs:
        for field in dataclasses.fields(declared_section):
            value, declared_value = getattr(made_section, field.name), getattr(declared_section, field.name)
            if value != declared_value and (section != "robot" or field.name in Limits._fields):
                raise StarnavError(
                    f"the station has {section}.{field.name} {value}, the scenario {declared_value}; allowed: "
                    "the same, as "
                    "margins and predictions follow from it"
                )
    step, has = scenario.simulation.time_step, robot.simulation.time_step
    if has != step:
        raise StarnavError(
            f"the station has time_step {has:g} s, the scenario's simulation.time_step is {step:g} s; allowed: the same"
        )
    if isinstance(station, StationInterface):
        _check_body(scenario.robot, station.robot_interface)


def _check_body(declared_robot: RobotParameters, robot: RobotInterface) -> None:
    by, link = robot.sticking_out(declared_robot)
    if by > TOLERANCE:
        raise StarnavError(
            f"link {link} of the station's robot sticks out of {declared_robot.said_of_shape} by {1e3 * by:.0f} mm; "
            f"allowed: {HOLDS_ALL}"
        )


def check_own_plant(robot: RobotInterface, world: World) -> None:
    """Check what the station of a scenario has by itself: a floor, the start, and that lidars see what may be hit.

    Raises:
        StarnavError: the plant has no floor on which the robot's wheels stand.
    """
    if not robot.robot.drive.holonomic and not robot.floor:
        raise StarnavError(
            "the plant has no floor, and the robot falls; allowed: add_ground(plant, world.extent), or a fixed shape "
            "whose top is the plane z = 0"
        )
    plant = robot.plant
    X_WB = plant.EvalBodyPoseInWorld(plant.CreateDefaultContext(), plant.GetBodyByName("base_link", robot.model))
    place, start = X_WB.translation()[:2], np.array(world.start[:2])
    if np.hypot(*(place - start)) > robot.robot.radius:
        warnings.warn(
            f"world {world.name}.start is {shown(world.start[:2])}, the robot begins at "
            f"{shown(tuple(place.round(3).tolist()))}; allowed: the start that add_robot was given",
            stacklevel=4,
        )
    warn_of_unseen(plant, robot.scene_graph, world, [robot], own_plant=True)


def check_time_step(robot: RobotInterface) -> None:
    """Raise a `StarnavError` where a discrete plant's steps are too long for a robot."""
    step, longest = robot.plant.time_step(), robot.longest_step
    if step > longest:
        raise StarnavError(
            f"the plant's time step is {step:g} s (simulation.time_step); allowed: at most {longest:.3g} s, "
            "as so small a robot would hop in longer ones, or a continuous plant"
        )


def check_and_derive_margins(
    scenario: Scenario, mounts: Sequence[Mount] = (ON_AXIS,), certified: bool = True
) -> Margins:
    """The margins of a scenario, by the mounts of its lidars; a `StarnavError` where no guarantee would hold.

    `certified`: whether the parts that drive ask for any.
    """
    lidars = scenario.all_lidars
    margins = derive_margins(scenario, mounts)
    _check_mounts(scenario, margins, mounts)
    _check_base(scenario)
    if not certified:
        return margins
    _check_tolerance(scenario)
    reach, backwards = scenario.robot.radius + margins.preferred, scenario.obstacles.max_speed > 0.0
    blank = [LaserScan(0.0, ranges=np.full(lidar.beams, np.inf), **lidar.scan_fields) for lidar in lidars]
    for lidar, mount in zip(lidars, mounts, strict=True):
        budget = evaluate_error_budget(scenario, mount, lidar).symbols
        _check_beams(scenario, lidar, budget["D"])
        if lidar.range_max <= reach + mount.offset:
            raise StarnavError(
                f"lidar.range_max is {lidar.range_max:g} m, robot.radius with its margin {reach + mount.offset:g} m; "
                "allowed: a lidar that sees farther than the robot reaches"
            )
        _check_range(scenario, lidar, reach + mount.offset + budget["F"])
    check_fields_of_view(blank, mounts, scenario.robot.shape, backwards=backwards)
    _check_braking(scenario)
    if scenario.robot.limits.steers:
        _check_steering(scenario.robot)
    return margins


def check_start(world: World, scenario: Scenario, mounts: Sequence[Mount], margin: float) -> None:
    """Raise a `StarnavError` if an obstacle stands, where no lidar looks, in the disc that a robot takes for free.

    `margin` is the safety margin, m.
    """
    lidars = scenario.all_lidars
    views = [mount.view(lidar.field_of_view) for lidar, mount in zip(lidars, mounts, strict=True)]
    if all(view.full_circle for view in views):
        return
    free = find_initial_disc_radius(scenario.robot.shape, margin, max(0.0, *(mount.x for mount in mounts)))
    full_circle_lidar = LidarParameters(beams=BEARINGS, noise=0.0, range_min=0.0, range_max=2.0 * free)
    hits = scan_from(visible_shapes(world), np.array(world.start), full_circle_lidar).points()
    hit_distance = np.hypot(*hits.T)
    bearings = [np.arctan2(hits[:, 1] - mount.y, hits[:, 0] - mount.x) for mount in mounts]
    is_looked_at = np.any([view.looks_at(each) for view, each in zip(views, bearings, strict=True)], axis=0)
    if (hit_distance[~is_looked_at] < free).any():
        raise StarnavError(
            f"an obstacle is {hit_distance[~is_looked_at].min():.2f} m from the start of world {world.name}, "
            "where no lidar looks; "
            f"allowed: nothing nearer than {free:.2f} m there, which the robot takes for free where it begins"
        )


def _check_base(scenario: Scenario) -> None:
    """Raise a `StarnavError` if slip is declared for a base without wheels."""
    robot, slip = scenario.robot, scenario.drive.slip
    if robot.drive.holonomic and slip > 0.0:
        raise StarnavError(
            f"drive.slip is {slip:g} with robot.base {robot.base}, an ideal one without wheels; allowed: 0, and "
            "drive.error for how far yours strays"
        )


def _check_tolerance(scenario: Scenario) -> None:
    """Raise a `StarnavError` if a robot that stops near its goal, as it believes, would not be within the tolerance."""
    tolerance, stops = scenario.simulation.goal_tolerance, GOAL_REACHED * scenario.robot.shape.cover_radius
    least = stops + scenario.localization.jump
    if tolerance <= least:
        raise StarnavError(
            f"simulation.goal_tolerance is {tolerance:g} m; allowed: more than {least:g} m, as the robot stops where "
            f"it believes to be {stops:.3g} m from the goal, localization.jump aside"
        )


def _check_mounts(scenario: Scenario, margins: Margins, mounts: Sequence[Mount]) -> None:
    """Raise a `StarnavError` where scans are averaged, for any lidars but one on the axis."""
    lone = len(mounts) == 1 and mounts[0].offset == 0.0
    if not lone and margins.average_scans:
        raise StarnavError(
            f"lidar.noise is {max(lidar.noise for lidar in scenario.all_lidars):g} with "
            f"{_describe_mounts(mounts)}; allowed: "
            "one on the axis, whose scans are averaged, or less than "
            f"{AVERAGED_NOISE * scenario.robot.shape.cover_radius:g} m"
        )


def check_lidar_on_axis(scenario: Scenario, mounts: Sequence[Mount]) -> None:
    """Raise a `StarnavError` for a method that reads one lidar on the axis, with another one."""
    if tuple(mounts) != (ON_AXIS,):
        raise StarnavError(
            f"method {scenario.method} with {_describe_mounts(mounts)}; allowed: one on the axis, unturned, or star"
        )


def _describe_mounts(mounts: Sequence[Mount]) -> str:
    if len(mounts) > 1:
        return f"{len(mounts)} lidars"
    place = f"at x {mounts[0].x:g}, y {mounts[0].y:g} m, yaw {mounts[0].yaw:g} rad"
    return f"a lidar {place}{', upside down' if mounts[0].upside_down else ''}"


def _check_beams(scenario: Scenario, lidar: LidarParameters, distance: float) -> None:
    """Raise a `StarnavError` if beams are farther apart than the radius where the robot must begin to stop, m."""
    robot, is_masked = scenario.robot, lidar.widest_gap > lidar.field_of_view.widest_gap
    cause_text = f"lidar.mask is {shown(lidar.mask)}" if is_masked else f"lidar.beams is {lidar.beams}"
    if distance * lidar.widest_gap > robot.radius:
        raise StarnavError(
            f"{cause_text}: at {distance:.3g} m, where a robot with robot.max_speed "
            f"{robot.max_speed:g} m/s that brakes by {robot.limits.max_deceleration:g} m/s^2 must begin to stop, "
            f"two beams are {distance * lidar.widest_gap:.3g} m apart; allowed: at most robot.radius, "
            f"{robot.radius:g} m{', or angle_min and angle_max that leave it out' if is_masked else ''}"
        )


def _check_braking(scenario: Scenario) -> None:
    """Raise a `StarnavError` if the wheels would slide while braking: the robot would stop later than certified."""
    for name in ("max_acceleration", "max_deceleration"):
        hardest = getattr(scenario.robot, name)
        if hardest > HARDEST_BRAKING:
            raise StarnavError(
                f"robot.{name} is {hardest:g} m/s^2, with a certificate; allowed: at most "
                f"{HARDEST_BRAKING:g} m/s^2, as wheels that brake harder slide"
            )


def _check_steering(car: RobotParameters) -> None:
    """Raise a `StarnavError` if a car steers more quickly than its motion is sampled for."""
    limits, tightest = car.limits, max(TIGHTEST_CIRCLE, 0.5 * car.shape.lever)
    if 1.0 / limits.max_yaw_rate < tightest:
        raise StarnavError(
            f"robot.least_radius is {car.least_radius:.3g} m with robot.base car; allowed: at least {tightest:.3g} m, "
            "and half of how far the robot reaches from its axis, as its motion is not sampled finely enough for less"
        )
    top_steering_rate = 2.0 * limits.max_yaw_rate / QUICKEST_LOCK * car.max_speed
    if car.max_yaw_acceleration > top_steering_rate:
        raise StarnavError(
            f"robot.max_yaw_acceleration is {car.max_yaw_acceleration:.3g} rad/s^2 with robot.base car; allowed: at "
            f"most {top_steering_rate:.3g} rad/s^2, with which it steers from lock to lock in "
            f"{QUICKEST_LOCK:g} s at robot.max_speed"
        )


def _check_range(scenario: Scenario, lidar: LidarParameters, needed_range: float) -> None:
    """Raise a `StarnavError` if, among obstacles that move, the lidar sees less far than `needed_range`, m: too late to
    stand."""
    range_max, speed = lidar.range_max, scenario.obstacles.max_speed
    if speed > 0.0 and range_max < needed_range:
        raise StarnavError(
            f"lidar.range_max is {range_max:g} m with obstacles that move at up to {speed:g} m/s; allowed: at least "
            f"{needed_range:.3g} m, as that much of the way is left when one is seen until the robot stands"
        )
