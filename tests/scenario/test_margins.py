"""Declared faults: what they do to a pose, and what margin they call for."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.systems.analysis import Simulator

from drake_starnav.control import ControllerParameters
from drake_starnav.control.delay_compensation import predicted_pose
from drake_starnav.control.heading_controller import limited_twist
from drake_starnav.errors import StarnavError
from drake_starnav.geometry.se2 import composed, now_in
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.planning import PlannerParameters
from drake_starnav.regions.erosion import smoothed_distances
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario import load_scenario
from drake_starnav.scenario.faults import DriveParameters, LocalizationParameters
from drake_starnav.scenario.margins import TRACK_SHARE, seen_from, sensing_error, tolerating
from drake_starnav.station.fault_models import drifted, jumped, wheel_shares
from drake_starnav.station.navigation_station import NavigationStation
from drake_starnav.validation import check_promises
from drake_starnav.worlds.world import World
from tests.helpers.scans import RADIUS, cast, seeds

COMMANDS = ControllerParameters()
RATE = COMMANDS.rate
NO_FAULT = (LidarParameters(), LocalizationParameters(), DriveParameters(), RobotParameters())
poses = st.tuples(st.floats(-9.0, 9.0), st.floats(-9.0, 9.0), st.floats(-3.1, 3.1)).map(np.array)


@given(seeds, poses, st.floats(0.0, 0.3), st.floats(0.0, 0.5), st.floats(-0.5, 0.5))
def test_drift_is_the_declared_share_of_distance_and_angle(seed, before, drift, way, turn):
    now = composed(before, (way, 0.0, turn))
    error = now_in(now, drifted(before, before, now, drift, seed))
    assert math.hypot(*error[:2]) == pytest.approx(drift * way, abs=1e-9)
    assert abs(error[2]) == pytest.approx(drift * abs(turn), abs=1e-9)


@given(seeds, st.floats(0.0, 2.0), st.integers(0, 1000))
def test_jumps_have_the_declared_size(seed, jump, index):
    assert np.hypot(*jumped(jump, seed, index)) == pytest.approx(jump)
    assert np.array_equal(jumped(jump, seed, index), jumped(jump, seed, index))


@given(seeds, st.floats(0.0, 0.5), st.integers(0, 1000))
def test_wheels_keep_at_least_what_is_not_declared_lost(seed, slip, index):
    shares = wheel_shares(slip, seed, index)
    assert ((1.0 - slip <= shares) & (shares <= 1.0)).all()


def test_without_faults_nothing_changes():
    planner, controller = PlannerParameters(), ControllerParameters()
    assert sensing_error(*NO_FAULT, COMMANDS) == 0.0
    assert tolerating(planner, controller, 0.0) == (planner, controller)


@pytest.mark.parametrize(
    "index, changes, error",
    [
        (0, {"noise": 0.03}, 0.015),
        (0, {"noise": 0.005}, 0.0),
        (0, {"quantisation": 0.1}, 0.05),
        (0, {"beams": 36}, 0.87 * (0.57 + 0.8 * 0.07) * math.pi / 18 - 0.01),
        (0, {"beams": 345}, 0.0),
        (0, {"beams": 720, "dropout": 0.5, "outliers": 0.1, "delay": 0.2, "scan_loss": 0.3}, 0.0),
        (0, {"delay": 0.1}, 0.87 * (0.57 + 0.8 * 0.17) * math.pi / 180 - 0.01),
        (0, {"scan_loss": 0.1}, 0.87 * (0.57 + 0.8 * 0.17) * math.pi / 180 - 0.01),
        (0, {"silence_duration": 1.0}, 0.87 * (0.57 + 0.8 * 0.17) * math.pi / 180 - 0.01),
        (1, {"drift": 0.02}, 0.02 * 0.8),
        (1, {"jump": 0.01}, 0.01),
        (1, {"jump": 1.0}, 0.02),
        (2, {"delay": 0.1}, 0.87 * (0.57 + 0.8 * 0.17) * math.pi / 180 - 0.01),
        (
            2,
            {"delay": 0.5},
            0.04 * 2.0 * 0.5 * (0.5 * 0.8 * 0.5 + 0.32) - 0.003 + 0.87 * (0.57 + 0.8 * 0.57) * math.pi / 180 - 0.01,
        ),
        (2, {"slip": 0.05}, 0.05 * (0.8 / 0.25 * 0.8 * 0.64 / 6.0 + 0.65 * 0.25)),
        (1, {"jump": 0.015, "jump_interval": 0.2}, 0.015 * (1 + 4)),
        (3, {"mass_error": 0.2}, 0.0),
    ],
)
def test_each_fault_s_part_of_the_margin(index, changes, error):
    declared = list(NO_FAULT)
    declared[index] = dataclasses.replace(declared[index], **changes)
    assert sensing_error(*declared, COMMANDS) == pytest.approx(error)
    planner, controller = tolerating(PlannerParameters(), ControllerParameters(), error)
    assert planner.margin == pytest.approx(PlannerParameters().margin + error)
    assert controller.safety_margin == pytest.approx(ControllerParameters().safety_margin + error)


@pytest.mark.parametrize(
    ("rate", "changes", "error"),
    [
        (50.0, {}, 0.0),
        (20.0, {}, 0.0),
        (10.0, {}, 0.005 + 0.02 * 0.32 - 0.005),
        (5.0, {}, 0.02 + 0.08 * 0.32 - 0.005),
        (40.0, {"max_speed": 2.0, "max_acceleration": 3.0, "max_yaw_acceleration": 10.0}, 0.0),
    ],
)
def test_rare_commands_need_a_margin(rate, changes, error):
    robot = dataclasses.replace(RobotParameters(), **changes)
    controller = dataclasses.replace(COMMANDS, rate=rate)
    lidar = LidarParameters(beams=720)  # no corner is far enough away
    assert sensing_error(lidar, *NO_FAULT[1:3], robot, controller) == pytest.approx(error, abs=1e-12)


def test_drift_counts_as_long_as_old_scans_do():
    """At 5 Hz scans may be older than a second before the robot stands."""
    lidar, drifting = LidarParameters(beams=3600, rate=5.0, delay=0.1), LocalizationParameters(drift=0.02)
    memory = (1.0 + COMMANDS.scan_patience) / 5.0 + 0.8
    assert memory > 1.0
    assert sensing_error(lidar, drifting, *NO_FAULT[2:], COMMANDS) == pytest.approx(0.02 * 0.8 * (memory + 0.1))


@pytest.mark.parametrize(("time_step", "error"), [(0.005, 0.0), (0.01, 0.0), (0.02, 0.8 * 0.01), (0.03, 0.8 * 0.02)])
def test_commands_that_wait_for_the_plant_need_a_margin(time_step, error):
    assert sensing_error(*NO_FAULT, COMMANDS, time_step) == pytest.approx(error)


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
    planner, _ = tolerating(planner, COMMANDS, 0.0, localization)
    assert (planner.contradiction, planner.drop_seen_through) == (contradiction, drops)


def late_errors(robot: RobotParameters, delay: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """By how much a driven robot is elsewhere, m, and turned otherwise, rad, than its late commands let expect."""
    world, drive, period = World("open", (0, 0, 0), (5, 0)), DriveParameters(delay=delay), 1.0 / RATE
    station = NavigationStation(world, robot, LidarParameters(beams=36, rate=1.0), drive=drive)
    simulator, rng = Simulator(station), np.random.default_rng(seed)
    context, command = simulator.get_mutable_context(), station.GetInputPort("drive.twist_command")
    twist, wanted, sent = np.zeros(2), np.zeros(2), [np.zeros(2)] * round(delay / period)
    poses, expected = [], []
    command.FixValue(context, twist)
    for k in range(600):
        if rng.random() < 0.03:
            wanted = rng.uniform((0.0, -robot.max_yaw_rate), (robot.max_speed, robot.max_yaw_rate))
        simulator.AdvanceTo(k * period)
        poses.append(station.GetOutputPort("localization.pose").Eval(context).copy())
        expected.append(predicted_pose(poses[-1], np.array(sent), delay, period))
        twist = limited_twist(twist, wanted, robot, period)
        command.FixValue(context, twist)
        sent = [*sent[1:], twist]
    late = len(sent)
    off = np.array(poses)[late:] - np.array(expected)[:-late]
    return np.hypot(*off[:, :2].T), np.abs((off[:, 2] + math.pi) % (2.0 * math.pi) - math.pi)


@pytest.mark.parametrize("delay", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("model", ["starbot", "jackal"])
def test_the_margin_covers_where_late_commands_find_the_robot(model, delay):
    quick = {"max_speed": 2.0, "max_acceleration": 3.0, "max_yaw_rate": 4.0, "max_yaw_acceleration": 10.0}
    robot = RobotParameters(model=model, radius=0.334, **(quick if model == "jackal" else {}))
    away, turned = late_errors(robot, delay, seed=0)
    margin = (
        sensing_error(*NO_FAULT[:2], DriveParameters(delay=delay), robot, COMMANDS)
        + ControllerParameters().safety_margin
    )
    assert (away + turned * 0.5 * robot.max_speed**2 / robot.max_acceleration).max() < margin


def test_what_no_margin_can_cover_is_refused():
    error = sensing_error(LidarParameters(noise=2.0), *NO_FAULT[1:], COMMANDS)
    with pytest.raises(StarnavError, match="what is declared of lidar, localization and drive adds 1.49 m"):
        tolerating(PlannerParameters(), ControllerParameters(), error)


def test_a_fine_lidar_with_noise_is_smoothed_too():
    _, controller = tolerating(
        PlannerParameters(), ControllerParameters(), 0.0, lidar=LidarParameters(noise=0.05, beams=10000)
    )
    assert controller.smoothed_beams == 93


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: RobotParameters(radius=-1.0), "robot.radius is -1"),
        (lambda: RobotParameters(max_acceleration=math.nan), "robot.max_acceleration is nan"),
        (lambda: PlannerParameters(erosion="dics"), "planner.erosion is 'dics'"),
        (lambda: PlannerParameters(margin=-0.2), "planner.margin is -0.2"),
        (lambda: DriveParameters(delay=-1.0), "drive.delay is -1"),
        (lambda: LocalizationParameters(drift=7.0), "localization.drift is 7"),
        (lambda: LidarParameters(quantisation=2.0), "lidar.quantisation is 2"),
    ],
)
def test_parameters_are_checked_wherever_they_are_made(make, words):
    with pytest.raises(StarnavError, match=words):
        make()


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
        planner, controller = tolerating(PlannerParameters(), ControllerParameters(), 0.0, lidar=lidar)
        assert planner.smoothing_slack == pytest.approx(slack) and controller.smoothed_beams == beams
        assert controller.average_scans == (noise == 0.05)
    averaging = ControllerParameters(average_scans=True)
    assert tolerating(PlannerParameters(), averaging, 0.0, lidar=LidarParameters(noise=0.02))[1].average_scans
    chosen = PlannerParameters(smoothing_slack=0.2)
    assert tolerating(chosen, ControllerParameters(), 0.0, lidar=LidarParameters(noise=0.03))[0].smoothing_slack == 0.2


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
    error = sensing_error(lidar, *NO_FAULT[1:], COMMANDS)
    planner, controller = tolerating(PlannerParameters(), ControllerParameters(), error, lidar=lidar)
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
    error = sensing_error(lidar, *NO_FAULT[1:], COMMANDS)
    _, controller = tolerating(PlannerParameters(), ControllerParameters(), error, lidar=lidar)
    distance = RADIUS + controller.safety_margin
    for scan in wedge_scans(90.0, distance, lidar):
        assert scan.distances.min() - distance < controller.safety_margin


@given(st.floats(0.0, 0.05), st.floats(0.0, 0.05), st.floats(-1.0, 1.0))
def test_the_slip_s_part_bounds_the_sideways_deviation_of_braking(slip, other, start):
    """One wheel loses `slip`, the other `other`, of a robot that brakes straight from full speed."""
    robot = RobotParameters()
    wheels, step = robot.radius * np.array((-0.5, 0.5)), 1e-3
    pose, v = np.zeros(3), robot.max_speed
    while v > 0.0:
        left, right = v * (1.0 - slip), v * (1.0 - other)
        pose = composed(pose, (0.5 * (left + right) * step, 0.0, (right - left) / np.ptp(wheels) * step))
        v -= robot.max_acceleration * step
    drive = DriveParameters(slip=max(slip, other))
    bound = sensing_error(LidarParameters(), LocalizationParameters(), drive, robot, COMMANDS)
    bound -= drive.slip * TRACK_SHARE * robot.radius  # that of turning on the spot
    assert abs(pose[1]) <= bound * 1.01 + 1e-6


@pytest.mark.parametrize("delay", [0.1, 0.5, 1.0])
def test_the_slip_s_part_bounds_the_sideways_deviation_of_late_braking(delay):
    """One wheel slips, and what brakes the robot from full speed is on its way."""
    robot, slip, step = RobotParameters(), 0.05, 1e-3
    pose, v, late = np.zeros(3), robot.max_speed, delay + 1.0 / RATE
    while v > 0.0:
        pose = composed(pose, (v * step, 0.0, slip * v / robot.radius * step))
        late -= step
        v -= robot.max_acceleration * step if late < 0.0 else 0.0
    drive = DriveParameters(slip=slip, delay=delay)
    bound = sensing_error(LidarParameters(beams=1440), LocalizationParameters(), drive, robot, COMMANDS)
    bound -= sensing_error(LidarParameters(beams=1440), *NO_FAULT[1:2], DriveParameters(delay=delay), robot, COMMANDS)
    bound -= slip * TRACK_SHARE * robot.radius
    assert pose[1] <= bound * 1.01


@pytest.mark.parametrize("turning", [0.25, 0.5, 0.75])
@pytest.mark.parametrize("rate, lost, yaw_rate", [(20.0, 0.0, 2.0), (20.0, 0.5, 2.0), (5.0, 0.7, 15.0), (1.0, 0.0, 6)])
def test_the_drift_s_part_bounds_how_far_the_believed_heading_leads_astray(rate, lost, yaw_rate, turning):
    """Since the last scan the robot has turned on the spot for a share of the time, then it drives on, and brakes."""
    robot = RobotParameters(max_acceleration=4.0, max_yaw_rate=yaw_rate)
    lidar, drift = LidarParameters(beams=1440, rate=rate, scan_loss=lost), 0.05
    time = (COMMANDS.scan_patience if lost else 1.0) / rate + 1.0 / RATE
    turned = yaw_rate * time * turning
    way = robot.max_speed * time * (1.0 - turning) + 0.5 * robot.max_speed**2 / robot.max_acceleration
    astray = way * 2.0 * math.sin(0.5 * drift * turned)
    bound = sensing_error(lidar, LocalizationParameters(drift=drift), DriveParameters(), robot, COMMANDS)
    assert math.hypot(astray, drift * way) <= bound


@given(st.floats(0.001, 0.1))
def test_the_slip_s_part_bounds_how_far_the_robot_gets_by_turning_round_on_the_spot(slip):
    """The left wheel keeps what it is told, the right one loses its share, for half a turn."""
    robot, step = RobotParameters(), 1e-3
    half_track, speed = TRACK_SHARE * robot.radius, 0.3
    pose, away = np.zeros(3), 0.0
    while pose[2] < math.pi:
        left, right = -speed, speed * (1.0 - slip)
        pose = composed(pose, (0.5 * (left + right) * step, 0.0, 0.0))
        pose[2] += (right - left) / (2.0 * half_track) * step
        away = max(away, float(np.hypot(*pose[:2])))
    bound = sensing_error(LidarParameters(), LocalizationParameters(), DriveParameters(slip=slip), robot, COMMANDS)
    assert 0.9 * slip * half_track < away <= bound * 1.01


@pytest.mark.parametrize("beams, speed, fits", [(36, 0.8, False), (36, 3.0, True), (90, 3.0, True), (360, 3.0, False)])
def test_a_robot_that_fits_between_two_beams_where_it_must_stop_is_refused(beams, speed, fits):
    changes = [f"lidar.beams={beams}", f"robot.max_speed={speed}", "controller.safety_range=6"]
    scenario = load_scenario("room", overrides=changes)
    if fits:
        with pytest.raises(StarnavError, match=f"lidar.beams is {beams}: at [0-9.]+ m, .* at most robot.radius"):
            check_promises(scenario)
    else:
        check_promises(scenario)


def test_the_margin_covers_a_corner_seen_from_where_the_robot_must_begin_to_stop():
    """A scan from there sees a corner of 60 degrees, pointing at the robot, too far away by the margin at most.

    By first order in the angle between two beams, that is.
    """
    robot, controller = RobotParameters(max_speed=2.0, max_acceleration=1.5), COMMANDS
    for beams in (90, 180, 360):
        lidar = LidarParameters(beams=beams)
        distance = seen_from(lidar, DriveParameters(), robot, controller)
        assert distance == pytest.approx(0.25 + min(1.2, 4.0 / 3.0 + 2.0 * 0.07))
        error = sensing_error(lidar, LocalizationParameters(), DriveParameters(), robot, controller)
        for scan in wedge_scans(60.0, distance, lidar):
            too_far = scan.distances.min() - distance
            assert too_far < (error + controller.safety_margin) * (1.0 + 2.0 * lidar.angle_increment)
