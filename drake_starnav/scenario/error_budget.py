"""The error of range, pose and motion that follows from what is declared, term by term.

The block of SAFETY.md is written from `TERMS` and `SYMBOLS` by `scripts/maintenance/write_tables.py`.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from operator import attrgetter
from typing import NamedTuple

from drake_starnav.control import ControllerParameters
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.localization.scan_matching import UNSEEN_JUMP
from drake_starnav.regions.safe_region import SCAN_PATIENCE
from drake_starnav.robot import RobotParameters
from drake_starnav.scenario.faults import DriveParameters, LocalizationParameters
from drake_starnav.scenario.schema import Scenario

SAMPLED = 0.004
"""Half the distance between two samples of a motion that the certificate checks, m."""
STRAYING = 0.003
"""How far the simulated bases stray from their commands until they stand, m."""
NOISE_SHARE = 0.75
"""Part of the standard deviation of the noise that counts, see `error_budget`."""
CORNER = 0.87
"""How far a corner of 60 degrees sticks out between two beams, over their distance there: half of tan 60 degrees."""
BESIDE_A_CORNER = 0.006
"""So much of the margin for noise also serves where a corner sticks out between two beams, m."""
LEAST_RANGE = 1.2
"""The safety star reaches at least so far, m."""
SPARE_RANGE = 1.25
"""It reaches this many times as far as the robot needs to stop, if the beams are fine enough."""
TRACK_SHARE = 0.65
"""The wheels are no farther than this share of the robot's radius from its axis."""
NOMINAL_STEP = 0.004
"""Deviation from the ramps by commands that are reached at once, which the other terms allow for, m."""
TURN_SHARE = 0.04
"""The angle turned in a second differs from the commanded one by up to this share of the largest yaw rate."""
NOMINAL_LATE = 0.003
"""Error of the position at which a late command finds the robot, which the other terms allow for, m."""
DRIFT_MEMORY = 1.0
"""Drift counts against the safety margin over at least this time: scans and braking, s."""
ASTRAY = 0.4
"""A drifting heading leads astray by this share of drift, speed, yaw rate and time since the scan squared."""


@dataclass(frozen=True)
class Declared:
    """What a scenario declares that the error depends on, and what follows from it; `time_step` of the plant in s."""

    lidar: LidarParameters
    localization: LocalizationParameters
    drive: DriveParameters
    robot: RobotParameters
    controller: ControllerParameters
    time_step: float = 0.0

    @classmethod
    def of(cls, scenario: Scenario) -> "Declared":
        """Of a scenario."""
        parts = scenario.lidar, scenario.localization, scenario.drive, scenario.robot, scenario.controller
        return cls(*parts, scenario.simulation.time_step)

    @property
    def period(self) -> float:
        """From command to command, s."""
        return 1.0 / self.controller.rate

    @property
    def braking_time(self) -> float:
        """From full speed, s."""
        return self.robot.max_speed / self.robot.max_acceleration

    @property
    def braking_distance(self) -> float:
        """From full speed, m."""
        return 0.5 * self.robot.max_speed * self.robot.max_speed / self.robot.max_acceleration

    @property
    def stopping_distance(self) -> float:
        """Driven until a command to brake has stopped the robot, m."""
        return self.robot.max_speed * (self.drive.delay + self.period) + self.braking_distance

    @property
    def scans_awaited(self) -> float:
        """Periods of the lidar until the next scan at the latest; scans may be lost."""
        lost = self.lidar.scan_loss > 0.0 or self.lidar.silence_duration > 0.0
        return SCAN_PATIENCE if lost else 1.0

    @property
    def driven_blind(self) -> float:
        """For how long the robot may drive by one scan before a command brakes it, s."""
        return self.scans_awaited / self.lidar.rate + self.lidar.delay + self.drive.delay + self.period

    @property
    def drifting_time(self) -> float:
        """For which a heading that drifts since the last scan leads astray, s; half of braking counts."""
        return self.driven_blind + 0.5 * self.robot.max_speed / self.robot.max_acceleration

    @property
    def memory(self) -> float:
        """From the oldest scan in use until the robot stands, s."""
        return max(DRIFT_MEMORY, (1.0 + SCAN_PATIENCE) / self.lidar.rate + self.braking_time)

    @property
    def jumps(self) -> int:
        """Most jumps of the pose between the last scan and standing still."""
        return 1 + math.floor((self.driven_blind + self.braking_time) / self.localization.jump_interval)

    @property
    def seeing_distance(self) -> float:
        """Driven by one scan until the robot stands, m."""
        return self.braking_distance + self.robot.max_speed * self.driven_blind

    def seen_coming(self, speed: float) -> float:
        """How far from its hull the robot must see an obstacle of a speed (m/s) to stand before the two meet, m.

        It comes into range just after a scan. The robot drives on at full speed until a command that knows the next
        scan takes effect, which waits for a step of the plant, and then brakes; both move all the while. The beams of a
        rolling scan may be one period older still.
        """
        blind = self.driven_blind + self.time_step + (1.0 / self.lidar.rate if self.lidar.rolling else 0.0)
        return self.robot.max_speed * blind + self.braking_distance + speed * (blind + self.braking_time)

    @property
    def corner_allowance(self) -> float:
        """What may stick out between two beams without a margin of its own, m."""
        return SAMPLED + min(NOISE_SHARE * self.lidar.noise, BESIDE_A_CORNER)

    @property
    def safety_range(self) -> float:
        """Extent of the safety star, m: farther than the robot needs to stop, as near its edge the robot is slower.

        A robot that is too fast for its beams slows down instead of keeping so far from corners.
        """
        fine = self.corner_allowance / (CORNER * self.lidar.widest_gap) - self.robot.radius
        return max(LEAST_RANGE, min(SPARE_RANGE * self.seeing_distance, fine))

    @property
    def seen_from(self) -> float:
        """Distance from which the last scan may have seen the obstacle that the robot stops in front of, m.

        A motion is accepted by a scan that was taken so far away: the robot drives on for `driven_blind` and then
        brakes. Where it matters, the gap between two neighbouring beams is nowhere wider.
        """
        return self.robot.radius + min(self.safety_range, self.seeing_distance)


class Entry(NamedTuple):
    """One value of the error budget; a test evaluates `text` and compares it with `value`."""

    text: str
    meaning: str
    value: Callable[[Declared], float]


SYMBOLS: dict[str, Entry] = {
    "r": Entry("robot.radius", "radius, m", attrgetter("robot.radius")),
    "v": Entry("robot.max_speed", "largest speed, m/s", attrgetter("robot.max_speed")),
    "w": Entry("robot.max_yaw_rate", "largest yaw rate, rad/s", attrgetter("robot.max_yaw_rate")),
    "a": Entry("robot.max_acceleration", "largest acceleration, m/s^2", attrgetter("robot.max_acceleration")),
    "A": Entry("robot.max_yaw_acceleration", "that of the yaw rate, rad/s^2", attrgetter("robot.max_yaw_acceleration")),
    "t": Entry("1 / controller.rate", "period of the commands, s", attrgetter("period")),
    "d": Entry("drive.delay", "time until a command takes effect, s", attrgetter("drive.delay")),
    "T": Entry("v / a", "braking time from full speed, s", attrgetter("braking_time")),
    "B": Entry("v^2 / (2 * a)", "braking distance from full speed, m", attrgetter("braking_distance")),
    "S": Entry("v * (d + t) + B", "distance until a command to brake has stopped the robot, m",
               attrgetter("stopping_distance")),
    "n": Entry("3 if lidar.scan_loss or lidar.silence_duration else 1",
               "scan periods until the next scan at the latest", attrgetter("scans_awaited")),
    "L": Entry("n / lidar.rate + lidar.delay + d + t",
               "time for which the robot drives by one scan before a command brakes it, s", attrgetter("driven_blind")),
    "R": Entry("L + T / 2", "time for which a drifting heading leads astray, s", attrgetter("drifting_time")),
    "M": Entry("max(1, (1 + 3) / lidar.rate + T)",
               "time from the oldest scan in use to standing still, s", attrgetter("memory")),
    "J": Entry("1 + floor((L + T) / localization.jump_interval)", "most jumps in the time L + T", attrgetter("jumps")),
    "C": Entry("0.004 + min(3/4 * lidar.noise, 0.006)", "what may stick out between beams without further margin, m",
               attrgetter("corner_allowance")),
    "G": Entry("max(1.2, min(1.25 * (B + v * L), C / (0.87 * lidar.widest_gap) - r))",
               "extent of the safety star, m", attrgetter("safety_range")),
    "D": Entry("r + min(G, B + v * L)",
               "distance of the last scan by which a motion was accepted, m", attrgetter("seen_from")),
}  # fmt: skip
"""What the texts of the terms call by a letter, each after those that its own text names."""

TERMS: tuple[Entry, ...] = (
    Entry(
        "0.004",
        "half the distance between two samples of a motion that the certificate checks",
        lambda given: SAMPLED,
    ),
    Entry("0.003", "a base of the shipped kind strays from its commands until it stands", lambda given: STRAYING),
    Entry(
        "3/4 * lidar.noise",
        "range noise",
        lambda given: NOISE_SHARE * given.lidar.noise,
    ),
    Entry("lidar.quantisation / 2", "ranges that are rounded up", lambda given: 0.5 * given.lidar.quantisation),
    Entry(
        "max(0, 0.87 * D * lidar.widest_gap - C)",
        "a corner of 60 degrees between two beams",
        lambda given: max(
            CORNER * given.seen_from * given.lidar.widest_gap - given.corner_allowance,
            0.0,
        ),
    ),
    Entry(
        "localization.drift * v * max(M + lidar.delay, R + 0.4 * w * R^2)",
        "drift of position and heading until the robot stands",
        lambda given: (
            given.localization.drift
            * given.robot.max_speed
            * max(
                given.memory + given.lidar.delay,
                given.drifting_time + ASTRAY * given.robot.max_yaw_rate * given.drifting_time * given.drifting_time,
            )
        ),
    ),
    Entry(
        "J * min(localization.jump, 0.02)",
        "jumps too small to be detected",
        lambda given: given.jumps * min(given.localization.jump, UNSEEN_JUMP),
    ),
    Entry("drive.error", "a base that strays farther", lambda given: given.drive.error),
    Entry(
        "drive.slip * (max(v^2 * T^2 / 6, S^2 / 2) / r + 0.65 * r)",
        "sideways deviation of a robot that brakes with one slipping wheel, and that of turning on the spot",
        lambda given: given.drive.slip * (_slipping_aside(given) + TRACK_SHARE * given.robot.radius),
    ),
    Entry(
        "v * max(0, simulation.time_step - t / 2)",
        "a command waits for the next step of the plant",
        lambda given: given.robot.max_speed * max(given.time_step - 0.5 / given.controller.rate, 0.0),
    ),
    Entry(
        "max(0, (a + A * v^2 / (2 * a)) * t^2 / 2 - 0.004)",
        "a command is reached at once, where the certificate assumes its whole period",
        lambda given: max(_early(given) - NOMINAL_STEP, 0.0),
    ),
    Entry(
        "max(0, 0.04 * w * d * (v * d / 2 + v^2 / (2 * a)) - 0.003)",
        "turning that differs from the command while commands are delayed",
        lambda given: max(_turned_otherwise(given) - NOMINAL_LATE, 0.0),
    ),
)


def error_budget(declared: Declared) -> float:
    """The sum of `TERMS`: the safety margin, which the certificate keeps beyond the robot's radius, m.

    Drift: the heading errs by drift times w for each second, too. In the worst case the robot turns first, since its
    last scan, and then drives; 0.4 w R^2 is no less than the resulting error, by numerical search, where it matters
    beside M. Slip: a heading that errs by slip / r for each metre leads astray by S^2 / 2 of that. Lost and stray
    beams, and lost scans except for L, need no margin: they are unknown space and shorten the certificate. The wheels'
    servo hides an error of the mass. Noise counts less than its standard deviation: the nearest of the hits that
    several scans leave on a surface bounds the robot, or, with much noise, their mean, and it is smoothed.
    """
    error = 0.0
    for term in TERMS:  # sum() rounds otherwise from Python 3.12 on
        error += term.value(declared)
    return error


def _slipping_aside(given: Declared) -> float:
    """Sideways deviation of the robot while it brakes, per share of slip, m."""
    v, radius, distance = given.robot.max_speed, given.robot.radius, given.stopping_distance
    return max(v / radius * v * given.braking_time**2 / 6.0, 0.5 * distance * distance / radius)


def _early(given: Declared) -> float:
    """How far the robot gets from its ramps, as a command is reached at once and not within its period, m."""
    robot = given.robot
    turning = robot.max_yaw_acceleration * 0.5 * robot.max_speed * robot.max_speed / robot.max_acceleration
    return 0.5 * (robot.max_acceleration + turning) / given.controller.rate**2


def _turned_otherwise(given: Declared) -> float:
    """Error of the position at which a late command finds the robot, m."""
    robot, delay = given.robot, given.drive.delay
    return TURN_SHARE * robot.max_yaw_rate * delay * 0.5 * robot.max_speed * (delay + given.braking_time)
