"""What may go wrong with a robot: declared bounds, the seeded errors they stand for, and the margins they call for.

The faults of the lidar are parameters of the lidar, `mass_error` one of the robot; those of localisation and drive are
here. A declared fault is simulated, and `tolerating` raises margins and memory so that navigation allows for it; what
is not declared is neither simulated nor allowed for. With the defaults nothing changes.
"""

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from drake_starnav.control import ControllerParameters
from drake_starnav.errors import StarnavError
from drake_starnav.lidar import LidarParameters
from drake_starnav.parameters import check_parameters, parameter
from drake_starnav.planar import composed, now_in
from drake_starnav.roadmap import PlannerParameters
from drake_starnav.robot import RobotParameters
from drake_starnav.scan_matching import UNSEEN_JUMP

NOMINAL_NOISE = 0.01
"""Range noise that the margins allow for as they are, m."""
SMOOTHED_DEVIATIONS = 3.0
"""More noise than that is smoothed, as far as so many times its standard deviation..."""
NOISE_PER_DEGREE = 0.015
"""... for the certificate over one degree on each side for each so much, m: the margin covers what corners lose."""
FINE_ENOUGH = 0.5
"""Over less of a beam than this nothing is smoothed: the next beam would take too much off corners."""
AVERAGED_NOISE = 0.04
"""With this noise or more ranges are averaged, too: the nearest of several scans' hits would shut passable gaps, m."""
CORNER = 0.87
"""How far a corner of 60 degrees sticks out between two beams, over their distance there: half of tan 60 degrees."""
NOMINAL_CORNER = 0.01
"""How far a corner may stick out between two beams that the margins allow for as they are, m."""
NOMINAL_STEP = 0.005
"""How far the robot may get off its ramps by commands that are reached at once, that the margins allow for, m."""
TURN_SHARE = 0.04
"""A robot has turned by up to this share of its largest yaw rate less or more than it was told in a second."""
NOMINAL_LATE = 0.003
"""Error of the place where a late command finds the robot that the margins allow for as they are, m."""
CONTRADICTION = 0.2
"""Where the pose may be wrong, regions that a new scan contradicts by more than this are not kept, m.

Twice the distance of two beams at 5 m: less is contradicted by what the older scan saw too coarsely.
"""
DRIFT_MEMORY = 1.0
"""Over so much time drift is counted against the safety margin: scans, their delay and braking, s."""
LARGEST_ERROR = 0.5
"""What margins may grow by, m."""


@dataclass(frozen=True)
class LocalizationParameters:
    """How the pose that the robot believes differs from the truth."""

    drift: float = parameter(
        0.0,
        "error of the believed position as a share of the distance travelled, and of the heading as a share of the "
        "angle turned",
        low=0.0,
        high=0.5,
    )
    jump: float = parameter(0.0, "how far the believed position jumps at times", unit="m", low=0.0, high=5.0)
    jump_interval: float = parameter(10.0, "time from jump to jump", unit="s", low=0.1, high=1e6)
    matching: bool = parameter(
        True,
        "where the believed pose errs, new scans are aligned with old ones to correct it (methods that follow the "
        "planner's guidance)",
    )

    def __post_init__(self) -> None:
        check_parameters(self, "localization")

    @property
    def exact(self) -> bool:
        """Whether the believed pose is the truth."""
        return self.drift == 0.0 and self.jump == 0.0


@dataclass(frozen=True)
class DriveParameters:
    """How the robot's motion differs from what is commanded."""

    delay: float = parameter(
        0.0, "time from a command to its effect, rounded up to whole plant steps", unit="s", low=0.0, high=1.0
    )
    slip: float = parameter(
        0.0, "largest share of its speed that a wheel loses; drawn for each wheel anew every second", low=0.0, high=0.5
    )

    def __post_init__(self) -> None:
        check_parameters(self, "drive")


def drifted(believed: np.ndarray, before: np.ndarray, now: np.ndarray, drift: float, seed: int) -> np.ndarray:
    """The believed pose after the robot went from one true pose to another.

    The error has one direction relative to the robot, and one sign of the heading, for a whole trial, so that it adds
    up as that of a badly calibrated odometry does.

    Args:
        believed: (x, y, yaw) at the true pose `before`, m and rad.
        before, now: true poses (x, y, yaw) in W; little motion lies between them.
        drift: error as a share of the distance travelled and of the angle turned.
        seed: a non-negative whole number below 2**64.

    Returns:
        shape (3,).
    """
    along, across, turn = now_in(before, now)
    angle, sign = _direction(seed)
    along, across = along + drift * along * math.cos(angle), across + drift * along * math.sin(angle)
    return composed(believed, (along, across, turn * (1.0 + drift * sign)))


def jumped(jump: float, seed: int, index: int) -> np.ndarray:
    """By how much the believed position jumps, shape (2,), m: its size is given, its direction drawn.

    Args:
        jump: size, m.
        seed: a non-negative whole number below 2**64.
        index: number of the jump.
    """
    angle = np.random.Generator(np.random.Philox(key=np.array([seed, 3], np.uint64), counter=index)).uniform(
        -math.pi, math.pi
    )
    return jump * np.array((math.cos(angle), math.sin(angle)))


def wheel_shares(slip: float, seed: int, index: int) -> np.ndarray:
    """Which share of its speed each wheel keeps, shape (2,): left and right.

    Args:
        slip: largest share that is lost.
        seed: a non-negative whole number below 2**64.
        index: number of the second.
    """
    return 1.0 - slip * np.random.Generator(np.random.Philox(key=np.array([seed, 4], np.uint64), counter=index)).random(
        2
    )


def sensing_error(
    lidar: LidarParameters,
    localization: LocalizationParameters,
    drive: DriveParameters,
    robot: RobotParameters,
    rate: float,
) -> float:
    """What the declared faults, and rare commands, add to the error that the margins already allow for, m.

        e = 3/4 max(0, noise - 0.01)                         range noise beyond the nominal
          + quantisation / 2                                 ranges rounded up
          + max(0, 0.87 r increment - 0.01)                  a corner of 60 degrees between two beams
          + drift v (1 s + lidar.delay)                      drift between the oldest scan in use and standing still
          + min(jump, 0.02)                                  a jump too small to be noticed
          + slip v / r  v T^2 / 6,   T = v / a               sideways deviation while braking, one wheel slipping
          + max(0, (a + A v^2 / (2 a)) t^2 / 2 - 0.005)      a command is reached at once, not within its period t
          + max(0, 0.04 w d (v d / 2 + v^2 / (2 a)) - 0.003) turning otherwise than told while a command is on its way

    with the robot's radius r, largest speeds v and w (turning) and accelerations a and A (turning), t = 1 /
    controller.rate and d = drive.delay. Lost and stray beams, delays of scans and lost scans need no margin: they
    are unknown space, predicted motion and a shorter certificate. The servo of the wheels hides the mass. Noise
    counts by less than its standard deviation: it is smoothed, and the nearest of the hits that several scans leave
    on a surface bounds the robot, or, with much noise, their mean.
    """
    v, a = robot.max_speed, robot.max_acceleration
    return (
        0.75 * max(lidar.noise - NOMINAL_NOISE, 0.0)
        + 0.5 * lidar.quantisation
        + max(CORNER * robot.radius * lidar.angle_increment - NOMINAL_CORNER, 0.0)
        + localization.drift * v * (DRIFT_MEMORY + lidar.delay)
        + min(localization.jump, UNSEEN_JUMP)
        + drive.slip * v / robot.radius * v * (v / a) ** 2 / 6.0
        + max(0.5 * (a + robot.max_yaw_acceleration * 0.5 * v * v / a) / rate**2 - NOMINAL_STEP, 0.0)
        + max(TURN_SHARE * robot.max_yaw_rate * drive.delay * 0.5 * v * (drive.delay + v / a) - NOMINAL_LATE, 0.0)
    )


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
        planner = dataclasses.replace(planner, contradiction=max(planner.contradiction, CONTRADICTION))
    if lidar is not None and lidar.noise > NOMINAL_NOISE:
        noise = lidar.noise - NOMINAL_NOISE
        slack = SMOOTHED_DEVIATIONS * noise
        width = math.radians(noise / NOISE_PER_DEGREE) / lidar.angle_increment
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
        dataclasses.replace(planner, margin=planner.margin + error),
        dataclasses.replace(controller, safety_margin=controller.safety_margin + error),
    )


def _direction(seed: int) -> tuple[float, float]:
    """Direction of a trial's drift relative to the robot, rad, and the sign of its heading's."""
    generator = np.random.Generator(np.random.Philox(key=np.array([seed, 2], np.uint64)))
    return generator.uniform(-math.pi, math.pi), 1.0 if generator.random() < 0.5 else -1.0
