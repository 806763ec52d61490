"""Margins, smoothing and averaging that the declared faults require."""

import dataclasses
import math

import numpy as np
import pytest

from drake_starnav.control import ControllerParameters
from drake_starnav.errors import StarnavError
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.planning import PlannerParameters
from drake_starnav.regions.erosion import smoothed_distances
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.error_budget import Declared, error_budget
from drake_starnav.scenario.faults import DriveParameters, LocalizationParameters
from drake_starnav.scenario.margins import with_margins
from drake_starnav.worlds.world import World
from tests.helpers.scans import RADIUS, cast

COMMANDS = ControllerParameters()
NO_FAULT = (LidarParameters(), LocalizationParameters(), DriveParameters(), RobotParameters())


@pytest.mark.parametrize(
    ("localization", "before", "contradiction", "drops"),
    [
        (LocalizationParameters(), 0.0, 0.0, False),
        (LocalizationParameters(drift=0.01), 0.0, 0.2, True),
        (LocalizationParameters(jump=0.1), 0.5, 0.5, True),
    ],
)
def test_without_an_exact_localization_old_regions_are_held_against_new_scans(
    localization, before, contradiction, drops
):
    planner = PlannerParameters(contradiction=before)
    planner, _ = with_margins(planner, COMMANDS, 0.0, localization)
    assert (planner.contradiction, planner.drop_seen_through) == (contradiction, drops)


def test_what_no_margin_can_cover_is_refused():
    error = error_budget(Declared(LidarParameters(noise=2.0), *NO_FAULT[1:], COMMANDS))
    with pytest.raises(StarnavError, match="what is declared of lidar, localization and drive adds 1.49 m"):
        with_margins(PlannerParameters(), ControllerParameters(), error)


def test_a_fine_lidar_with_noise_is_smoothed_too():
    _, controller = with_margins(
        PlannerParameters(), ControllerParameters(), 0.0, lidar=LidarParameters(noise=0.05, beams=10000)
    )
    assert controller.smoothed_beams == 93


def test_noise_is_smoothed_with_slack_beyond_the_nominal_and_much_is_averaged():
    for noise, slack, beams in (
        (0.0, 0.0, 0),
        (0.007, 0.0, 0),
        (0.01, 0.0, 1),
        (0.02, 0.03, 2),
        (0.03, 0.06, 2),
        (0.05, 0.12, 4),
    ):
        lidar = LidarParameters(noise=noise)
        planner, controller = with_margins(PlannerParameters(), ControllerParameters(), 0.0, lidar=lidar)
        assert planner.smoothing_slack == pytest.approx(slack) and controller.smoothed_beams == beams
        assert controller.average_scans == (noise == 0.05)
    averaging = ControllerParameters(average_scans=True)
    assert with_margins(PlannerParameters(), averaging, 0.0, lidar=LidarParameters(noise=0.02))[1].average_scans
    chosen = PlannerParameters(smoothing_slack=0.2)
    assert (
        with_margins(chosen, ControllerParameters(), 0.0, lidar=LidarParameters(noise=0.03))[0].smoothing_slack == 0.2
    )


def wedge_scans(angle, distance, lidar):
    """Scans of a wedge of an angle (degrees) that points at the robot from a distance (m), turned in many ways."""
    tip = np.array((distance, 0.0))
    for axis in np.linspace(-0.6, 0.6, 9):
        sides = axis + np.radians(0.5 * angle) * np.array((-1.0, 1.0))
        back = tip + 0.5 * np.column_stack((np.cos(sides), np.sin(sides)))
        wedge = World("wedge", (0, 0, 0), (0, 0), polygons=(np.vstack((tip, back)),), bounds=(-3.0, -3.0, 3.0, 3.0))
        for yaw in np.linspace(0.0, max(np.radians(1.0), lidar.angle_increment), 5):
            yield cast(wedge, np.array((0.0, 0.0, yaw)), beams=lidar.beams)


@pytest.mark.parametrize("noise", [0.005, 0.01, 0.02, 0.03, 0.05])
@pytest.mark.parametrize("angle", [60.0, 90.0])
@pytest.mark.parametrize("beams", [36, 60, 72, 90, 120, 180, 360, 720])
def test_the_margin_covers_what_smoothing_takes_off_a_corner(noise, angle, beams):
    lidar = LidarParameters(noise=noise, beams=beams)
    error = error_budget(Declared(lidar, *NO_FAULT[1:], COMMANDS))
    planner, controller = with_margins(PlannerParameters(), ControllerParameters(), error, lidar=lidar)
    if not controller.smoothed_beams:
        assert math.radians(noise / 0.015) < 0.5 * lidar.angle_increment  # nothing is taken off
        return
    smoothing = dataclasses.replace(planner, smoothing_beams=controller.smoothed_beams)
    for scan in wedge_scans(angle, RADIUS + controller.safety_margin, lidar):
        lost = smoothed_distances(scan, smoothing).min() - scan.distances.min()
        assert lost < controller.safety_margin


@pytest.mark.parametrize("beams", [36, 48, 60, 90, 120, 180, 360])
def test_the_margin_covers_what_sticks_out_between_two_beams(beams):
    lidar = LidarParameters(beams=beams)
    error = error_budget(Declared(lidar, *NO_FAULT[1:], COMMANDS))
    _, controller = with_margins(PlannerParameters(), ControllerParameters(), error, lidar=lidar)
    distance = RADIUS + controller.safety_margin
    for scan in wedge_scans(90.0, distance, lidar):
        assert scan.distances.min() - distance < controller.safety_margin


def test_the_margin_covers_a_corner_seen_from_where_the_robot_must_begin_to_stop():
    """A scan from there sees a corner of 60 degrees, pointing at the robot, too far away by the margin at most.

    By first order in the angle between two beams, that is.
    """
    robot, controller = RobotParameters(max_speed=2.0, max_acceleration=1.5), COMMANDS
    for beams in (90, 180, 360):
        lidar = LidarParameters(beams=beams)
        distance = Declared(lidar, *NO_FAULT[1:3], robot, controller).seen_from
        assert distance == pytest.approx(0.25 + min(1.2, 4.0 / 3.0 + 2.0 * 0.07))
        error = error_budget(Declared(lidar, LocalizationParameters(), DriveParameters(), robot, controller))
        for scan in wedge_scans(60.0, distance, lidar):
            too_far = scan.distances.min() - distance
            assert too_far < (error + controller.safety_margin) * (1.0 + 2.0 * lidar.angle_increment)
