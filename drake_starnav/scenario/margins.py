"""Which margins, smoothing and memory the declared faults call for, so that navigation allows for them.

With the defaults nothing changes.
"""

import dataclasses
import math

from drake_starnav.control import ControllerParameters
from drake_starnav.errors import StarnavError
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.localization.scan_matching import UNSEEN_JUMP
from drake_starnav.planning import PlannerParameters
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.faults import DriveParameters, LocalizationParameters

NOMINAL_NOISE = 0.01
"""Range noise that the margins allow for as they are, m."""
SMOOTHED_DEVIATIONS = 3.0
"""Ranges may be moved by so many standard deviations of the noise beyond the nominal more, when they are smoothed."""
NOISE_PER_DEGREE = 0.015
"""The certificate smooths it over one degree on each side for each so much, m: the margin covers what corners lose."""
FINE_ENOUGH = 0.5
"""The certificate smooths nothing over less of a beam than this: the next beam would take too much off corners."""
AVERAGED_NOISE = 0.04
"""With this noise or more ranges are averaged, too: the nearest of several scans' hits would shut passable gaps, m."""
CORNER = 0.87
"""How far a corner of 60 degrees sticks out between two beams, over their distance there: half of tan 60 degrees."""
NOMINAL_CORNER = 0.01
"""How far a corner may stick out between two beams that the margins allow for as they are, m."""
TRACK_SHARE = 0.65
"""The wheels are no farther than this share of the robot's radius from its axis."""
NOMINAL_STEP = 0.005
"""How far the robot may get off its ramps by commands that are reached at once, that the margins allow for, m."""
TURN_SHARE = 0.04
"""A robot has turned by up to this share of its largest yaw rate less or more than it was told in a second."""
NOMINAL_LATE = 0.003
"""Error of the place where a late command finds the robot that the margins allow for as they are, m."""
DRIFT_MEMORY = 1.0
"""Over so much time, at least, drift is counted against the safety margin: scans and braking, s."""
ASTRAY = 0.4
"""How far a drifting heading leads astray: by this share of drift, speed, yaw rate and time since the scan squared."""
LARGEST_ERROR = 0.5
"""What margins may grow by, m."""


def sensing_error(
    lidar: LidarParameters,
    localization: LocalizationParameters,
    drive: DriveParameters,
    robot: RobotParameters,
    controller: ControllerParameters,
    time_step: float = 0.0,
) -> float:
    """What the declared faults, and rare commands, add to the error that the margins already allow for, m.

        e = 3/4 max(0, noise - 0.01)                         range noise beyond the nominal
          + quantisation / 2                                 ranges rounded up
          + max(0, 0.87 D increment - 0.01)                  a corner of 60 degrees between two beams
          + drift v max(M + lidar.delay, R + 0.4 w R^2)      drift between the oldest scan in use and standing still
          + min(jump, 0.02) (1 + floor((L + T) / interval))  jumps too small to be noticed
          + slip max(v^2 T^2 / 6, S^2 / 2) / r,   T = v / a  sideways deviation until it stands, one wheel slipping
          + slip 0.65 r                                      and while turning round on the spot
          + v max(0, time_step - t / 2)                      a command waits for the next step of the plant
          + max(0, (a + A v^2 / (2 a)) t^2 / 2 - 0.005)      a command is reached at once, not within its period t
          + max(0, 0.04 w d (v d / 2 + v^2 / (2 a)) - 0.003) turning otherwise than told while a command is on its way

    with the robot's radius r, largest speeds v and w (turning) and accelerations a and A (turning), t = 1 /
    controller.rate, d = drive.delay, D of `seen_from`, M = max(1 s, (1 + scan_patience) / lidar.rate + T), L =
    `driven_blind`, R = L + T / 2, and S = v (d + t) + v T / 2. So far as S the robot drives until a command to brake
    stops it, and a heading that errs by slip / r for each metre of it leads S^2 / 2 of that astray. The heading errs by
    drift w for each second, too: at worst the robot turns first, since its last scan, and drives then; 0.4 w R^2 is no
    less than what that adds up to, by numerical search, where it matters beside M. Lost and stray beams, and lost scans
    but for L, need no margin: they are unknown space and a shorter certificate. The servo of the wheels hides the mass.
    Noise counts by less than its standard deviation: the nearest of the hits that several scans leave on a surface
    bounds the robot, or, with much noise, their mean, and it is smoothed.
    """
    v, a, rate = robot.max_speed, robot.max_acceleration, controller.rate
    memory = max(DRIFT_MEMORY, (1.0 + controller.scan_patience) / lidar.rate + v / a)
    blind = driven_blind(lidar, drive, controller)
    run = blind + 0.5 * v / a
    stopping = v * (drive.delay + 1.0 / rate) + 0.5 * v * v / a
    astray = max(v / robot.radius * v * (v / a) ** 2 / 6.0, 0.5 * stopping * stopping / robot.radius)
    jumps = 1 + math.floor((blind + v / a) / localization.jump_interval)
    return (
        0.75 * max(lidar.noise - NOMINAL_NOISE, 0.0)
        + 0.5 * lidar.quantisation
        + max(CORNER * seen_from(lidar, drive, robot, controller) * lidar.angle_increment - NOMINAL_CORNER, 0.0)
        + localization.drift * v * max(memory + lidar.delay, run + ASTRAY * robot.max_yaw_rate * run * run)
        + jumps * min(localization.jump, UNSEEN_JUMP)
        + drive.slip * (astray + TRACK_SHARE * robot.radius)
        + v * max(time_step - 0.5 / rate, 0.0)
        + max(0.5 * (a + robot.max_yaw_acceleration * 0.5 * v * v / a) / rate**2 - NOMINAL_STEP, 0.0)
        + max(TURN_SHARE * robot.max_yaw_rate * drive.delay * 0.5 * v * (drive.delay + v / a) - NOMINAL_LATE, 0.0)
    )


def driven_blind(lidar: LidarParameters, drive: DriveParameters, controller: ControllerParameters) -> float:
    """For how long a robot may drive by one scan before a command brakes it, s.

        L = n / lidar.rate + lidar.delay + drive.delay + t

    It drives on until the next scan has arrived, or the n-th where scans may be lost (n = scan_patience, else 1).
    """
    lost = lidar.scan_loss > 0.0 or lidar.silence_duration > 0.0
    periods = controller.scan_patience if lost else 1.0
    return periods / lidar.rate + lidar.delay + drive.delay + 1.0 / controller.rate


def seen_from(
    lidar: LidarParameters, drive: DriveParameters, robot: RobotParameters, controller: ControllerParameters
) -> float:
    """From how far the lidar may last have looked at what the robot stops in front of, m.

        D = r + min(safety_range, v^2 / (2 a) + v L)

    A motion is accepted by a scan that was taken so far away: the robot drives on for L = `driven_blind` and then
    brakes. What two neighbouring beams leave unseen between them is nowhere wider where it matters.
    """
    v, blind = robot.max_speed, driven_blind(lidar, drive, controller)
    return robot.radius + min(controller.safety_range, 0.5 * v * v / robot.max_acceleration + v * blind)


def tolerating(
    planner: PlannerParameters,
    controller: ControllerParameters,
    error: float,
    localization: LocalizationParameters | None = None,
    lidar: LidarParameters | None = None,
) -> tuple[PlannerParameters, ControllerParameters]:
    """The parameters of planner and controller with an error (m), as from `sensing_error`, added to their margins.

    Where the localisation is not exact, old regions are held against new scans; where the lidar has more
    than the nominal noise, its ranges are smoothed all the more, for the certificate too, and with much noise they are
    averaged over the remembered scans.

    Raises:
        StarnavError: the error is too large for any margin.
    """
    if localization is not None and not localization.exact:
        contradiction = max(planner.contradiction, PlannerParameters.contradiction)  # at least the default
        planner = dataclasses.replace(planner, contradiction=contradiction, drop_seen_through=True)
    if lidar is not None:
        slack = SMOOTHED_DEVIATIONS * max(lidar.noise - NOMINAL_NOISE, 0.0)
        width = math.radians(lidar.noise / NOISE_PER_DEGREE) / lidar.angle_increment
        beams = math.ceil(width - 1e-9) if width >= FINE_ENOUGH else 0
        planner = dataclasses.replace(planner, smoothing_slack=max(planner.smoothing_slack, slack))
        controller = dataclasses.replace(
            controller,
            smoothed_beams=max(controller.smoothed_beams, beams),
            average_scans=controller.average_scans or lidar.noise >= AVERAGED_NOISE,
        )
    if error == 0.0:
        return planner, controller
    if error > LARGEST_ERROR:
        raise StarnavError(
            f"what is declared of lidar, localization and drive adds {error:.3g} m to the margins; allowed: at most "
            f"{LARGEST_ERROR:g} m"
        )
    return (
        dataclasses.replace(planner, margin=planner.margin + error, least_margin=planner.least_margin + error),
        dataclasses.replace(controller, safety_margin=controller.safety_margin + error),
    )
