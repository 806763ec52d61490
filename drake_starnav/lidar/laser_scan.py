"""One planar laser scan, with the field names and conventions of ROS `sensor_msgs/LaserScan`."""

import math
from functools import cached_property, lru_cache

import numpy as np
from numba import njit

from drake_starnav.errors import StarnavError
from drake_starnav.utils.snapshot import snapshot

LARGEST_UNSEEN = 0.25
"""Between two beams that say something, a thing of this width is taken to stand where the gap would hide it, m."""
STAYS, UNKNOWN, MOVES = 0, 1, 2
"""What is known about the motion of what a beam hit."""
_NUMBERS = ("time", "angle_min", "angle_increment", "range_min", "range_max", "time_increment", "scan_time")


@snapshot
class LaserScan:
    """Ranges measured in the x-y plane of the sensor frame S, counter-clockwise from `angle_min`.

    Range values follow REP-117: `+inf` no return within `range_max`, `-inf` an object nearer than
    `range_min`. NaN, REP-117's invalid measurement, is refused unless `lost_beams` says that the sensor may lose
    beams: a lost beam says nothing, neither hit nor free.

    Attributes:
        time: time of the measurement on the simulation's clock, s; of the last beam, if beams have their own times.
        angle_min: bearing of the first beam, rad.
        angle_increment: bearing step between beams, rad, positive.
        range_min, range_max: limits of the sensor, m.
        ranges: shape (n,), m.
        time_increment: time from beam to beam, s; 0 when all are measured at once.
        scan_time: time between scans, s; 0 when there is no rate.
        lost_beams: whether ranges may be NaN.
        motion: shape (n,), what somebody has told about what each beam hit: STAYS, UNKNOWN or MOVES. Beams of the last
            kind saw free space as far as that, but no obstacle that stays. None: nothing moves.

    What the properties count a beam as, by where it ended:

    ```
                                   hits  moving  lost  silent  lasting
    on what stays                   x                             x
    on what may move (UNKNOWN)      x
    on what moves (MOVES)                  x              x
    nowhere (+inf)                                                x
    nobody knows (NaN)                             x      x
    ```
    """

    time: float
    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    ranges: np.ndarray
    time_increment: float = 0.0
    scan_time: float = 0.0
    lost_beams: bool = False
    motion: np.ndarray | None = None

    def __post_init__(self) -> None:
        ranges = np.array(self.ranges, dtype=float)
        ranges.flags.writeable = False
        object.__setattr__(self, "ranges", ranges)
        for name in _NUMBERS:
            if not math.isfinite(getattr(self, name)):
                raise StarnavError(f"laser scan: {name} is {getattr(self, name)}; allowed: a finite number")
        for name in ("time_increment", "scan_time"):
            if getattr(self, name) < 0.0:
                raise StarnavError(f"laser scan: {name} is {getattr(self, name):g}; allowed: 0 <= {name}")
        if ranges.ndim != 1 or len(ranges) < 3:
            raise StarnavError(f"laser scan: ranges has shape {ranges.shape}; allowed: (n,) with n >= 3")
        if not 0.0 <= self.range_min < self.range_max:
            raise StarnavError(
                f"laser scan: range_min {self.range_min:g}, range_max {self.range_max:g}; "
                "allowed: 0 <= range_min < range_max"
            )
        span = self.angle_increment * (len(ranges) - 1)
        if not 0.0 < span <= 2.0 * math.pi + 1e-9:
            raise StarnavError(
                f"laser scan: angle_increment {self.angle_increment:g} over {len(ranges)} beams spans {span:g} rad; "
                "allowed: more than 0, at most one turn"
            )
        if not self.lost_beams and not self.complete:
            bad = np.flatnonzero(self.lost)
            raise StarnavError(
                f"laser scan: ranges[{bad[0]}] is NaN ({len(bad)} of {len(ranges)} beams); "
                "allowed: metres, +inf (no return), -inf (too close), and NaN (lost) only with lost_beams=True"
            )

    @staticmethod
    def nothing() -> "LaserScan":
        """A scan that saw nothing, as the model value of ports."""
        return LaserScan(0.0, -math.pi, 0.5 * math.pi, 0.0, 1.0, np.full(4, math.inf))

    @property
    def angle_max(self) -> float:
        """Bearing of the last beam, rad."""
        return self.angle_min + self.angle_increment * (len(self.ranges) - 1)

    @property
    def full_circle(self) -> bool:
        """Whether the last beam's neighbour is the first one."""
        return abs(self.angle_increment * len(self.ranges) - 2.0 * math.pi) < 1e-6

    @property
    def bearings(self) -> np.ndarray:
        """Bearing of every beam in S, shape (n,), rad."""
        return _beams(self.angle_min, self.angle_increment, len(self.ranges))[0]

    @cached_property
    def hits(self) -> np.ndarray:
        """Which beams came back from something that stays, shape (n,), bool; -inf (too close) is a hit, NaN is none."""
        hits = self.ranges < self.range_max
        return hits if self.motion is None else hits & ~self.moving

    @cached_property
    def lost(self) -> np.ndarray:
        """Which beams say nothing (NaN), shape (n,), bool."""
        return np.isnan(self.ranges)

    @cached_property
    def silent(self) -> np.ndarray:
        """Which beams say nothing of what stays: lost, or stopped by something that moves; shape (n,), bool."""
        return self.lost if self.motion is None else self.lost | self.moving

    @cached_property
    def moving(self) -> np.ndarray:
        """Which beams were stopped by something that moves, shape (n,), bool."""
        return np.zeros(len(self.ranges), bool) if self.motion is None else self.motion == MOVES

    @cached_property
    def lasting(self) -> np.ndarray:
        """Which beams are worth remembering: not lost, nor stopped by what moves or may move; shape (n,), bool."""
        return ~self.lost if self.motion is None else ~self.lost & (self.motion == STAYS)

    @cached_property
    def complete(self) -> bool:
        """Whether every beam says something."""
        return not math.isnan(np.minimum.reduce(self.ranges))  # NaN is the least of all

    @cached_property
    def distances(self) -> np.ndarray:
        """Ranges as plain distances, shape (n,), m: no return is `range_max`, too close is 0.

        A lost beam is bounded by its neighbours: it counts as free no farther than the nearer of the beams on both
        sides of the run of lost ones, nor than where a thing of LARGEST_UNSEEN could stand between these two.
        """
        distance = np.minimum(np.maximum(self.ranges, 0.0), self.range_max)
        if self.complete:
            return distance
        return _bounded(distance, self.range_max, self.angle_increment, self.full_circle)

    def points(self, pose: np.ndarray | tuple[float, float, float] = (0.0, 0.0, 0.0)) -> np.ndarray:
        """The hits as points, shape (k, 2), m.

        Args:
            pose: (x, y, yaw) of S in the frame wanted, W for the world; default S itself.
        """
        return self.points_at(self.distances, self.hits, pose)

    def points_at(
        self, distance: np.ndarray, chosen: np.ndarray, pose: np.ndarray | tuple[float, float, float]
    ) -> np.ndarray:
        """Points at given distances along the chosen beams, shape (k, 2), m.

        Args:
            distance: shape (n,), m, one a beam.
            chosen: shape (n,), bool.
            pose: (x, y, yaw) of S in the frame wanted.
        """
        x, y, yaw = pose
        directions = _beams(self.angle_min, self.angle_increment, len(self.ranges))[1]
        return _placed(directions, distance, chosen, x, y, math.cos(yaw), math.sin(yaw))


@njit(cache=True)
def _bounded(distance, range_max, increment, wrap):
    n = len(distance)
    out = distance.copy()
    for i in range(n):
        if not math.isnan(distance[i]):
            continue
        bound, steps = range_max, 0
        sides = 0
        for side in (-1, 1):
            for k in range(1, n):
                j = i + side * k
                if not wrap and not 0 <= j < n:
                    break
                if not math.isnan(distance[j % n]):
                    bound = min(bound, distance[j % n])
                    steps += k
                    sides += 1
                    break
        if sides == 0:
            out[i] = 0.0
        else:
            out[i] = min(bound, LARGEST_UNSEEN / (steps * increment))
    return out


@njit(cache=True)
def _placed(directions, distance, chosen, x, y, cosine, sine):
    points = np.empty((len(distance), 2))
    n = 0
    for i in range(len(distance)):
        if chosen[i]:
            a, b = directions[i, 0] * distance[i], directions[i, 1] * distance[i]
            points[n, 0] = x + a * cosine - b * sine
            points[n, 1] = y + a * sine + b * cosine
            n += 1
    return points[:n].copy()


@lru_cache(maxsize=16)
def _beams(angle_min: float, angle_increment: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Bearings (n,) and unit vectors (n, 2) of the beams in S, the same for every scan of a sensor."""
    bearings = angle_min + angle_increment * np.arange(count)
    directions = np.column_stack((np.cos(bearings), np.sin(bearings)))
    bearings.flags.writeable = directions.flags.writeable = False
    return bearings, directions


@njit(cache=True)
def chord(a, b, cosine):
    """Distance between two hits, m, by the law of cosines.

    Args:
        a, b: their ranges, m.
        cosine: of the angle between their beams.
    """
    return math.sqrt(max(a * a + b * b - 2.0 * a * b * cosine, 0.0))
