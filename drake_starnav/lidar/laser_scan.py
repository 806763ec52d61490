"""One planar laser scan, with the field names and conventions of ROS `sensor_msgs/LaserScan`."""

import dataclasses
import math
import operator
from collections.abc import Sequence
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.compiled import kernel
from drake_starnav.lidar.field_of_view import SEAM, TURN, FieldOfView, read_sectors
from drake_starnav.utils.snapshot import replace_fields, snapshot

USUAL_COVER_RADIUS = 0.25
"""Cover radius of the default robot, m."""
LARGEST_UNSEEN = 0.25
"""Where nobody needs certainty, an obstacle of this width is assumed wherever lost beams would hide it, m."""
STATIC, STANDING, UNKNOWN, DYNAMIC = range(4)
"""What is known about the motion of the obstacle that a beam hit; STANDING: it is static now, and may start to move."""
HIT, MOVING, LOST, MAPPABLE, MAY_LEAVE = 1, 2, 4, 8, 16
"""What a beam may be, as bits; see `Beams`."""
NOT_TRACKED, NO_BOUNDS = np.zeros(0, np.int8), np.zeros(0)
LEAST = math.ulp(0.0)
"""Ranges of 0 and less are no measurement: this is the least that is one, m."""
_NUMBERS = ("time", "angle_min", "angle_increment", "range_min", "range_max", "time_increment", "scan_time")
_numbers = operator.attrgetter(*_NUMBERS)


class Beams(NamedTuple):
    """The beams of one scan, for compiled loops as well; unpack what a loop reads before it.

    Attributes:
        directions: unit vectors, S, shape (n, 2).
        range_max: of the sensor, m.
        increment: bearing step between beams, rad.
        seam: angle from the last beam on to the first, rad; infinite if they are no neighbours.
        cover_radius: as of `LaserScan`.
        distances: ranges as plain distances, shape (n,), m: no return is `range_max`, too close is 0. Unless the scan
            says up to where a lost beam is free, it counts as free up to the shorter of the beams on both sides of the
            run of lost beams, and no farther than where the thinnest obstacle fits between these two. At the end of a
            view, where there is only one of them, it is not free.
        kinds: what each beam is, shape (n,), uint8, bits of the following.
            HIT: it hit a static or possibly moving obstacle; includes -inf (too close), not NaN.
            MOVING: on a moving obstacle. LOST: without a measurement (NaN).
            MAPPABLE: to be remembered: neither lost nor on a moving or possibly moving obstacle.
            MAY_LEAVE: on an obstacle that moves, may do so, or may start to.
        complete: whether no beam is lost.
        certain_range: up to where the thinnest obstacle does not fit between two neighbouring beams, m.

    What a beam is, by where it ended; lost ones and those on a moving obstacle tell nothing of static obstacles:

    ```
                                      HIT  MOVING  LOST  MAPPABLE  MAY_LEAVE
    static obstacle (STATIC)           x                    x
    one that may start (STANDING)      x                    x          x
    possibly moving one (UNKNOWN)      x                               x
    moving obstacle (DYNAMIC)                x                         x
    no return (+inf)                                        x
    no measurement (NaN)                            x
    no measurement, DYNAMIC                  x      x                  x
    ```
    """

    directions: np.ndarray
    range_max: float
    increment: float
    seam: float
    cover_radius: float
    distances: np.ndarray
    kinds: np.ndarray
    complete: bool
    certain_range: float


@kernel
def classify_ranges(ranges, motion, free, thinnest, range_max, increment, seam):
    """The fields of `Beams` from `distances` on; `range_max`, `increment` and `seam` are as there.

    Args:
        ranges: shape (n,), m.
        motion: shape (n,), of the obstacle that each beam hit; empty if everything is static.
        free: shape (n,), up to where lost beams are free, m; empty if their neighbours bound them.
        thinnest: width of the thinnest obstacle, m; infinite: as of `LaserScan`.
    """
    n = len(ranges)
    distance, kinds = np.empty(n), np.empty(n, np.uint8)
    complete = True
    for i in range(n):
        is_lost, known_motion = math.isnan(ranges[i]), motion[i] if len(motion) else STATIC
        kinds[i] = (
            MOVING * (known_motion == DYNAMIC) | LOST * is_lost | MAPPABLE * (known_motion <= STANDING and not is_lost)
        )
        kinds[i] |= HIT * (ranges[i] < range_max and known_motion != DYNAMIC)  # never if lost
        kinds[i] |= MAY_LEAVE * (known_motion == DYNAMIC or (known_motion != STATIC and not is_lost))
        distance[i] = min(max(ranges[i], 0.0), range_max)
        if is_lost:
            complete = False
            distance[i] = min(max(free[i], 0.0), range_max) if len(free) else math.nan
    if not complete and len(free) == 0:
        distance = _bound_distances(distance, thinnest, range_max, increment, seam)
    return distance, kinds, complete, thinnest / (max(increment, seam) if seam < np.inf else increment)


@kernel
def _bound_distances(distance, thinnest, range_max, increment, seam):
    """The distances with those of lost beams (NaN) bounded by the beams on both sides."""
    n = len(distance)
    wrap, out = seam < np.inf, distance.copy()
    width, needed_beams = (thinnest, 2) if thinnest < np.inf else (LARGEST_UNSEEN, 1)
    for i in range(n):
        if not math.isnan(distance[i]):
            continue
        bound, steps, bearing_beyond, sides = range_max, 0, 0.0, 0
        for side in (-1, 1):
            for k in range(1, n):
                j = i + side * k
                if not wrap and not 0 <= j < n:
                    break
                if not math.isnan(distance[j % n]):
                    bound = min(bound, distance[j % n])
                    steps += k
                    bearing_beyond += 0.0 if 0 <= j < n else seam - increment
                    sides += 1
                    break
        out[i] = min(bound, width / (steps * increment + bearing_beyond)) if sides >= needed_beams else 0.0
    return out


@snapshot
class LaserScan:
    """Ranges measured in the x-y plane of the sensor frame S, counter-clockwise from `angle_min`.

    Range values follow REP-117: `+inf`, or `range_max` and more, is no return, `-inf` an object nearer than
    `range_min`, and NaN no measurement. What is below `range_min`, 0 or negative is no measurement either: drivers
    write it instead, and it becomes NaN. A beam without a measurement is rejected unless `lost_beams` declares that the
    sensor may lose beams: a lost beam is neither a hit nor free.

    A negative `angle_increment`, of beams that turn clockwise, is allowed when a scan is made: its beams are reversed.

    Attributes:
        time: time of the measurement on the simulation's clock, s; that of the last beam in a rolling scan.
        angle_min: bearing of the first beam, rad.
        angle_increment: bearing step between beams, rad, positive.
        range_min, range_max: limits of the sensor, m.
        ranges: shape (n,), m.
        time_increment: time from beam to beam, s; 0: all at once; negative: the last is measured first.
        scan_time: time between scans, s; 0 when there is no rate.
        lost_beams: whether beams may have no measurement.
        motion: shape (n,), motion of the obstacle that each beam hit: STATIC, STANDING, UNKNOWN or DYNAMIC. A beam of
            the last kind saw free space up to the obstacle, but no static obstacle. None: everything is static.
        free: shape (n,), distance up to which space is free along each lost beam, m. None: its neighbours bound it.
        cover_radius: of the robot, by which surfaces are told apart, m; set by `make_view`.
        thinnest: width of the thinnest obstacle that must not be missed, m; set by `make_view` for the certificate.
            Infinite: nobody relies on it, and lost beams may hide what is thinner than LARGEST_UNSEEN.
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
    free: np.ndarray | None = None
    cover_radius: float = USUAL_COVER_RADIUS
    thinnest: float = math.inf

    def __post_init__(self) -> None:
        ranges = np.array(self.ranges, dtype=float)
        if not all(map(math.isfinite, _numbers(self))):
            name = next(name for name in _NUMBERS if not math.isfinite(getattr(self, name)))
            raise StarnavError(f"laser scan: {name} is {getattr(self, name)}; allowed: a finite number")
        if self.scan_time < 0.0:
            raise StarnavError(f"laser scan: scan_time is {self.scan_time:g}; allowed: 0 <= scan_time")
        if ranges.ndim != 1 or len(ranges) < 3:
            raise StarnavError(f"laser scan: ranges has shape {ranges.shape}; allowed: (n,) with n >= 3")
        if not 0.0 <= self.range_min < self.range_max:
            raise StarnavError(
                f"laser scan: range_min {self.range_min:g}, range_max {self.range_max:g}; "
                "allowed: 0 <= range_min < range_max"
            )
        span = self.angle_increment * (len(ranges) - 1)
        if not 0.0 < abs(span) <= TURN + SEAM:
            raise StarnavError(
                f"laser scan: angle_increment {self.angle_increment:g} over {len(ranges)} beams spans {span:g} rad; "
                "allowed: not 0, at most one turn in either direction"
            )
        if self.angle_increment < 0.0:
            ranges = ranges[::-1].copy()
            turned_fields = {
                "angle_min": self.angle_min + span,
                "angle_increment": -self.angle_increment,
                "time_increment": -self.time_increment,
                "motion": None if self.motion is None else np.asarray(self.motion)[::-1],
                "free": None if self.free is None else np.asarray(self.free)[::-1],
            }
            for name, value in turned_fields.items():
                object.__setattr__(self, name, value)
        least = max(self.range_min, LEAST)
        if not ranges[ranges.argmin()] >= least:  # `min` takes much longer
            bad = np.flatnonzero(~((ranges >= least) | (ranges == -math.inf)))
            if not self.lost_beams and len(bad):
                raise StarnavError(
                    f"laser scan: ranges[{bad[0]}] is {ranges[bad[0]]:g} ({len(bad)} of {len(ranges)} beams); allowed: "
                    f"metres from range_min {self.range_min:g} m on, +inf (no return), -inf (too close), and anything "
                    "less or NaN (lost) only with lost_beams=True"
                )
            ranges[bad] = math.nan
        ranges.setflags(write=False)
        object.__setattr__(self, "ranges", ranges)

    def again(self, ranges: np.ndarray, **changes: Any) -> "LaserScan":
        """Another scan of the sensor with ranges (n,) as of `measure`, m, and changes, which are not checked again."""
        ranges.setflags(write=False)
        return replace_fields(self, ranges=ranges, **changes)

    def mask_sectors(self, sectors: Sequence[tuple[float, float]]) -> "LaserScan":
        """The scan without the beams in which the robot sees itself: they are lost.

        Args:
            sectors: pairs of bearings in S, each a sector from the first counter-clockwise to the second, rad.
        """
        is_masked = self.field_of_view.within(read_sectors(sectors, "laser scan: mask"))
        return dataclasses.replace(self, ranges=np.where(is_masked, math.nan, self.ranges), lost_beams=True)

    @staticmethod
    def nothing() -> "LaserScan":
        """A scan without returns, as the model value of ports."""
        return LaserScan(0.0, -math.pi, 0.5 * math.pi, 0.0, 1.0, np.full(4, math.inf))

    @property
    def field_of_view(self) -> FieldOfView:
        """Its beams."""
        return FieldOfView(self.angle_min, self.angle_increment, len(self.ranges))

    @property
    def angle_max(self) -> float:
        """Bearing of the last beam, rad."""
        return self.field_of_view.angle_max

    @cached_property
    def beams(self) -> Beams:
        """What follows from the ranges, derived when it is first asked for."""
        motion = NOT_TRACKED if self.motion is None else np.asarray(self.motion, np.int8)
        free = NO_BOUNDS if self.free is None else np.asarray(self.free, float)
        _, directions, seam = _make_beams(self.angle_min, self.angle_increment, len(self.ranges))
        view = self.range_max, self.angle_increment, seam
        return Beams(
            directions,
            *view,
            float(self.cover_radius),
            *classify_ranges(self.ranges, motion, free, self.thinnest, *view),
        )

    @cached_property
    def measured_at(self) -> float:
        """Its time, s; -inf if all its beams are lost."""
        return self.time if self.beams.complete or not self.lost.all() else -math.inf

    @property
    def full_circle(self) -> bool:
        """Whether the last beam's neighbour is the first one."""
        return self.beams.seam < math.inf

    @property
    def merged(self) -> bool:
        """Whether it joins views of lidars, or is that of one off the robot's axis, as seen from the axis."""
        return self.free is not None

    @property
    def distances(self) -> np.ndarray:
        """As in `Beams`, shape (n,), m."""
        return self.beams.distances

    @property
    def hits(self) -> np.ndarray:
        """Beams that are HIT, see `Beams`, shape (n,), bool."""
        return self.beams.kinds & HIT != 0

    @property
    def moving(self) -> np.ndarray:
        """Beams that are MOVING, see `Beams`, shape (n,), bool."""
        return self.beams.kinds & MOVING != 0

    @property
    def lost(self) -> np.ndarray:
        """Beams that are LOST, see `Beams`, shape (n,), bool."""
        return self.beams.kinds & LOST != 0

    @property
    def mappable(self) -> np.ndarray:
        """Beams that are MAPPABLE, see `Beams`, shape (n,), bool."""
        return self.beams.kinds & MAPPABLE != 0

    @property
    def may_leave(self) -> np.ndarray:
        """Beams that are MAY_LEAVE, see `Beams`, shape (n,), bool."""
        return self.beams.kinds & MAY_LEAVE != 0

    @property
    def bearings(self) -> np.ndarray:
        """Bearing of every beam in S, shape (n,), rad."""
        return _make_beams(self.angle_min, self.angle_increment, len(self.ranges))[0]

    @property
    def mappable_hits(self) -> np.ndarray:
        """Beams that hit a static obstacle, shape (n,), bool."""
        return self.beams.kinds & (HIT | MAPPABLE) == HIT | MAPPABLE

    def points(self, pose: np.ndarray | tuple[float, float, float] = (0.0, 0.0, 0.0)) -> np.ndarray:
        """The hits as points, shape (k, 2), m, for a pose (x, y, yaw) of S in the requested frame; default S itself."""
        return self.points_at(self.distances, self.hits, pose)

    def polar(self, points: np.ndarray, pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distance of points (k, 2) in the frame of a pose of S, m, and the beam to each, a real index; both (k,)."""
        offset = points - pose[:2]
        bearing = np.mod(np.arctan2(offset[:, 1], offset[:, 0]) - pose[2] - self.angle_min, 2.0 * math.pi)
        return np.hypot(offset[:, 0], offset[:, 1]), bearing / self.angle_increment

    def points_at(
        self, distance: np.ndarray, chosen: np.ndarray, pose: np.ndarray | tuple[float, float, float]
    ) -> np.ndarray:
        """Points at distances (n,), one a beam, along the chosen beams (n,), shape (k, 2), m, for a pose of S."""
        x, y, yaw = pose
        return place_ends(self.beams.directions, distance, chosen, x, y, math.cos(yaw), math.sin(yaw))


@kernel
def place_ends(directions, distance, chosen, x, y, cosine, sine):
    """Points at given distances along the chosen beams of a sensor at (x, y) with a yaw of that cosine and sine."""
    points, n = np.empty((len(distance), 2)), 0
    for i in range(len(distance)):
        if chosen[i]:
            a, b = directions[i, 0] * distance[i], directions[i, 1] * distance[i]
            points[n, 0] = x + a * cosine - b * sine
            points[n, 1] = y + a * sine + b * cosine
            n += 1
    return points[:n].copy()


@lru_cache(maxsize=16)
def _make_beams(angle_min: float, angle_increment: float, count: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Bearings (n,), unit vectors (n, 2) and seam of the beams in S; computed once per sensor."""
    bearings = angle_min + angle_increment * np.arange(count)
    directions = np.column_stack((np.cos(bearings), np.sin(bearings)))
    bearings.flags.writeable = directions.flags.writeable = False
    return bearings, directions, FieldOfView(angle_min, angle_increment, count).seam
