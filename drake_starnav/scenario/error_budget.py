"""The error of range, pose and motion that follows from what is declared, term by term.

Each term is a text, which is both evaluated here and written into SAFETY.md by `scripts/maintenance/write_tables.py`.
"""

import math
from types import CodeType
from typing import NamedTuple

from drake_starnav.lidar.mounts import ON_AXIS, Mount
from drake_starnav.lidar.sensor_model import LidarParameters
from drake_starnav.localization.scan_matching import UNSEEN_JUMP
from drake_starnav.scenario.schema import Scenario
from drake_starnav.surroundings.margins import SCAN_PATIENCE


class ErrorTerm(NamedTuple):
    """A formula of the error budget: Python, but for ^, of the scenario's sections and of earlier symbols."""

    text: str
    meaning: str

    @property
    def code(self) -> CodeType:
        """To be evaluated."""
        return compile(self.text.replace("^", "**"), self.meaning, "eval")


SYMBOLS: dict[str, ErrorTerm] = {
    "s": ErrorTerm("robot.shape.sampling / 2", "half the distance between two samples of a motion, m"),
    "r": ErrorTerm("robot.radius", "radius, m"),
    "l": ErrorTerm("robot.shape.lever", "radius of a footprint of polygons; 0 for a disc, m"),
    "v": ErrorTerm("robot.max_speed", "largest speed, m/s"),
    "w": ErrorTerm("robot.max_yaw_rate", "largest yaw rate, rad/s"),
    "a": ErrorTerm("robot.max_deceleration or robot.max_acceleration", "largest deceleration, m/s^2"),
    "A": ErrorTerm("robot.max_yaw_acceleration", "largest yaw acceleration, rad/s^2"),
    "o": ErrorTerm("mount.offset", "distance of the lidar from the robot's axis, m"),
    "t": ErrorTerm("1 / controller.rate", "period of the commands, s"),
    "d": ErrorTerm("drive.delay", "time until a command takes effect, s"),
    "T": ErrorTerm("v / a", "braking time from full speed, s"),
    "B": ErrorTerm("v^2 / (2 * a)", "braking distance from full speed, m"),
    "S": ErrorTerm("v * (d + t) + B", "distance until a command to brake has stopped the robot, m"),
    "q": ErrorTerm("min(0.003, 0.00375 * v)", "deviation of the shipped bases from their commands until they stand, m"),
    "n": ErrorTerm(
        f"{SCAN_PATIENCE:g} if lidar.scan_loss or lidar.silence_duration else 1",
        "scan periods until the next scan at the latest",
    ),
    "L": ErrorTerm(
        "n / lidar.rate + lidar.delay + d + t",
        "time for which the robot drives by one scan before a command brakes it, s",
    ),
    "R": ErrorTerm("L + T / 2", "time for which the heading drifts, s"),
    "h": ErrorTerm(
        "L^2 / 2 + L * T / 2 + T^2 / 6 if robot.drive.holonomic else 0.4 * R^2",
        "how far a heading leads astray that drifts by 1 rad/s, for each m/s of the robot, s^2",
    ),
    "M": ErrorTerm(
        f"max(1, (1 + {SCAN_PATIENCE:g}) / lidar.rate + T)",
        "time from the oldest scan or look in use to standing still, s",
    ),
    "J": ErrorTerm(
        "1 + floor(max(L + T, M) / localization.jump_interval)", "most jumps in the longer of the times L + T and M"
    ),
    "C": ErrorTerm("s + min(3/4 * lidar.noise, 3/2 * s)", "what may stick out between beams without further margin, m"),
    "E": ErrorTerm(
        "max(4.8 * robot.shape.cover_radius, min(1.25 * (B + v * L), C / (0.87 * lidar.widest_gap) - r - o)) + r "
        "- robot.shape.cover_radius",
        "extent of a certified star that only corners limit, m",
    ),
    "g": ErrorTerm(
        "lidar.widest_gap + (w / (lidar.rate * lidar.beams) if lidar.rolling else 0)",
        "angle between two beams of a robot that turns, rad",
    ),
    "G": ErrorTerm(
        "min(E, obstacles.min_width / g - r - o) if obstacles.min_width else E",
        "extent of the certified star, m",
    ),
    "D": ErrorTerm("r + o + min(G, B + v * L)", "distance from the lidar up to which a scan accepts a motion, m"),
    "W": ErrorTerm(
        "obstacles.min_width or (D if lidar.field_of_view.full_circle else D + r) * g "
        "* (2 if lidar.dropout or lidar.outliers else 1)",
        "width of the thinnest obstacle that is certain to be seen, also beside a lost beam, m",
    ),
    "b": ErrorTerm(
        "L + simulation.time_step + (1 / lidar.rate if lidar.rolling else 0)",
        "age of a scan that just missed an obstacle when a command that knows of it takes effect, s",
    ),
    "F": ErrorTerm(
        "v * b + B + obstacles.max_speed * (b + T) + obstacles.stopping_distance",
        "distance from the robot at which an obstacle must be seen for the robot to stand in time, m",
    ),
}
"""What the texts of the terms call by a letter, each after those that its own text names.

At full speed a robot that is too fast for its beams slows down near the edge of its certified star, of extent G,
instead of keeping so far from corners.
"""

TERMS: tuple[ErrorTerm, ...] = (
    ErrorTerm("s", "half the distance between two samples of a motion that the certificate checks"),
    ErrorTerm("q", "deviation of the shipped bases from their commands until they stand"),
    ErrorTerm("3/4 * lidar.noise", "range noise"),
    ErrorTerm("lidar.quantisation / 2", "ranges that are rounded up"),
    ErrorTerm("D * mount.tilt^2", "ranges and bearings in the plane of a tilted lidar"),
    ErrorTerm("max(0, 0.87 * D * lidar.widest_gap - C)", "a corner of 60 degrees between two beams"),
    ErrorTerm(
        "localization.drift * v * max(M + lidar.delay, R + w * h)",
        "drift of position and heading until the robot stands",
    ),
    ErrorTerm(
        "l * (0.01 + localization.drift * w * (M + lidar.delay))",
        "error of the heading of the shipped bases, and its drift, until the robot stands",
    ),
    ErrorTerm(
        f"J * min(localization.jump, {UNSEEN_JUMP} * robot.shape.cover_radius"
        " + (2 * v * t if robot.drive.holonomic else 0))",
        "jumps too small to be detected",
    ),
    ErrorTerm("drive.error", "a base that strays farther than the shipped ones"),
    ErrorTerm(
        "drive.slip * (max(v^2 * T^2 / 6, S^2 / 2) / robot.shape.cover_radius + 0.65 * r)",
        "sideways deviation of a robot that brakes with one slipping wheel, and that of turning on the spot",
    ),
    ErrorTerm(
        "l * drive.slip * (S / robot.shape.cover_radius + w * (d + t) + w^2 / (2 * A))",
        "heading of a footprint of polygons whose wheels slip until it stands",
    ),
    ErrorTerm("v * max(0, simulation.time_step - t / 2)", "a command waits for the next step of the plant"),
    ErrorTerm(
        "max(0, (a + A * v^2 / (2 * a)) * t^2 / 2 - min(s, 0.004))",
        "a command is reached at once, where the certificate assumes its whole period",
    ),
    ErrorTerm(
        "max(0, 0.04 * w * d * (v * d / 2 + v^2 / (2 * a)) - q)",
        "turning that differs from the command while commands are delayed",
    ),
)
"""Terms of the sum, each in m.

Corners: 0.87 is half of tan 60 degrees. Drift: the heading errs by drift times w for each second, too. In the worst
case the robot turns first, since its last scan, and then drives; 0.4 w R^2 is no less than the resulting error, by
numerical search, where it matters beside M. One that drives straight on while it turns gets h w v astray. Slip: wheels
of both sides are no nearer to each other than the cover radius, so a heading that errs by slip over that for each
metre leads astray by S^2 / 2 of it; they are no farther than 0.65 r from the robot's axis. Tilt: along its plane
ranges are longer by half of its square, and bearings err by a quarter of it at most. Lost and stray beams, and lost
scans except for L, need no margin: they are unknown space and shorten the certificate. The wheels' servo hides an error
of the mass. Shipped bases stray by 2.1 ms of their speed at most, with radii of 0.08 to 1 m, up to 0.8 m/s.
Noise counts less than its standard deviation: the nearest of the hits that several scans leave on a surface bounds the
robot, or, with much noise, their mean, and it is smoothed.
"""


class ErrorBudget(NamedTuple):
    """What the formulas give: the value of each of `SYMBOLS`, in its unit, and of each of `TERMS`, m."""

    symbols: dict[str, float]
    terms: tuple[float, ...]

    @property
    def total(self) -> float:
        """The sum of the terms: the safety margin, which the certificate keeps beyond the robot's radius, m."""
        total = 0.0
        for term in self.terms:  # sum() rounds otherwise from Python 3.12 on
            total += term
        return total


_CODES = {name: term.code for name, term in SYMBOLS.items()}, tuple(term.code for term in TERMS)


def evaluate_error_budget(
    scenario: Scenario, mount: Mount = ON_AXIS, lidar: LidarParameters | None = None
) -> ErrorBudget:
    """The formulas, evaluated for what a scenario declares, and for one of its lidars; None: for `lidar`."""
    symbols, term_codes = _CODES
    known_symbols = {"__builtins__": {"max": max, "min": min, "floor": math.floor}, **vars(scenario), "mount": mount}
    known_symbols["lidar"] = lidar or scenario.lidar
    for name, code in symbols.items():
        known_symbols[name] = eval(code, known_symbols)
    return ErrorBudget(
        {name: known_symbols[name] for name in symbols}, tuple(float(eval(code, known_symbols)) for code in term_codes)
    )
