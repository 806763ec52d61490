"""Parameters of a planar lidar, and its measurement errors."""

import enum
import math
import struct
import threading
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.compiled import kernel
from drake_starnav.lidar.field_of_view import ROUNDING, TURN, FieldOfView, read_sectors
from drake_starnav.parameters import Checked, parameter


@dataclass(frozen=True)
class LidarParameters(Checked, place="lidar"):
    """A planar laser scanner."""

    beams: int = parameter(360, "number of beams in a scan", low=3, high=100000)
    angle_min: float = parameter(-math.pi, "bearing of the first beam", unit="rad", low=-13.0, high=13.0)
    angle_max: float = parameter(
        math.pi,
        "bearing of the last beam; one turn from angle_min means a full circle without its end point, less than "
        "angle_min beams that turn clockwise",
        unit="rad",
        low=-13.0,
        high=13.0,
    )
    range_min: float = parameter(0.02, "hits nearer than this are reported as -inf", unit="m", low=0.0)
    range_max: float = parameter(
        5.0,
        "hits from here on are reported as +inf",
        unit="m",
        above=0.0,
        high=1000.0,
        when="set it to what your sensor measures of dark surfaces",
    )
    rate: float = parameter(20.0, "scans per second", unit="Hz", low=0.1, high=10000.0)
    noise: float = parameter(
        0.01,
        "standard deviation of the range error of hits",
        unit="m",
        low=0.0,
        high=10.0,
        when="set it to your sensor's, from its data sheet or a scan of a flat wall",
    )
    dropout: float = parameter(0.0, "probability that a beam is lost and reports NaN", low=0.0, high=1.0)
    outliers: float = parameter(
        0.0,
        "probability that a beam reports a random distance short of the true one; if declared, a hit without a "
        "neighbour counts once two earlier scans confirm it",
        low=0.0,
        high=1.0,
    )
    delay: float = parameter(0.0, "time from a scan to its arrival", unit="s", low=0.0, high=1.0)
    scan_loss: float = parameter(0.0, "probability that a whole scan does not arrive", low=0.0, high=1.0)
    silence_start: float = parameter(0.0, "when an outage of the sensor begins", unit="s", low=0.0, high=1e6)
    silence_duration: float = parameter(
        0.0, "duration of that outage, in which no scans are taken", unit="s", low=0.0, high=1e6
    )
    quantisation: float = parameter(
        0.0, "hits are rounded to multiples of this; 0 for none", unit="m", low=0.0, high=1.0
    )
    rolling: bool = parameter(False, "sweep the beams over the period before the scan, as a spinning sensor does")
    frame: str = parameter(
        "lidar",
        "link or frame of the robot's model in whose x-y plane it scans",
        when="your model calls it otherwise: laser, base_scan, ...",
    )
    mask: list[Any] = field(
        default_factory=list,
        metadata={
            "help": "bearings [[first, last], ...], rad, counter-clockwise, between which it sees the robot itself: "
            "beams there are lost",
            "when": "a post or a cable is in its way; `starnav calibrate` proposes it",
        },
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        span = self.angle_max - self.angle_min
        if not 0.0 < abs(span) <= TURN + ROUNDING:
            raise StarnavError(
                f"lidar.angle_max is {self.angle_max:g} with lidar.angle_min {self.angle_min:g}, a span of {span:g} "
                "rad; allowed: not 0, at most one turn in either direction"
            )
        if not self.range_min < self.range_max:
            raise StarnavError(
                f"lidar.range_min is {self.range_min:g} with lidar.range_max {self.range_max:g}; "
                "allowed: range_min < range_max"
            )
        read_sectors(self.mask, "lidar.mask")

    @property
    def field_of_view(self) -> FieldOfView:
        """Its beams."""
        span = abs(self.angle_max - self.angle_min)
        step = TURN / self.beams if span > TURN - ROUNDING else span / (self.beams - 1)
        last = self.angle_min - step * (self.beams - 1)
        return FieldOfView(last if self.clockwise else self.angle_min, step, self.beams)

    @property
    def scan_fields(self) -> dict[str, Any]:
        """All fields of its `LaserScan` but the time and the ranges, which are counter-clockwise."""
        view = self.field_of_view
        return {
            "angle_min": view.angle_min,
            "angle_increment": view.angle_increment,
            "range_min": self.range_min,
            "range_max": self.range_max,
            "time_increment": self.time_increment,
            "scan_time": 1.0 / self.rate,
            "lost_beams": True,
        }

    @property
    def clockwise(self) -> bool:
        """Whether the beams turn clockwise."""
        return self.angle_max < self.angle_min

    @property
    def range_deviation(self) -> float:
        """Standard deviation of the range error of hits, by noise and rounding, m."""
        return math.hypot(self.noise, self.quantisation / math.sqrt(12.0))

    @property
    def release_offset(self) -> float:
        """Time from a multiple of the period to the release of delayed scans, s."""
        rest = math.fmod(self.delay, 1.0 / self.rate)
        # 0.1 us later: Drake may skip a periodic event that coincides with another up to rounding
        return rest + 1e-7 if 1e-9 < rest < 1.0 / self.rate - 1e-9 else 0.0

    @property
    def waiting_scans(self) -> int:
        """Largest number of scans in transit at once."""
        return math.ceil(self.delay * self.rate) + 1 if self.delay > 0.0 else 0

    @property
    def time_increment(self) -> float:
        """Time from each beam to the next counter-clockwise, s; 0 unless the scan is rolling."""
        sweep = 1.0 / (self.rate * self.beams) if self.rolling else 0.0
        return -sweep if self.clockwise else sweep

    @property
    def angle_increment(self) -> float:
        """Bearing step between beams, rad, positive."""
        return self.field_of_view.angle_increment

    @property
    def widest_gap(self) -> float:
        """Largest angle between two neighbouring beams, or those on both sides of a masked sector, rad."""
        widest_mask = max(
            (width + self.angle_increment for _, width in read_sectors(self.mask, "lidar.mask")), default=0.0
        )
        return max(self.field_of_view.widest_gap, widest_mask)


_NO_ERRORS, _NONE_LOST = np.zeros(0), np.zeros(0, bool)


def find_scan_index(time: float, rate: float) -> int:
    """Index of the latest scan at a time, s, for a rate in Hz: 0 in [0, 1/rate), and so on."""
    return math.floor(time * rate + 1e-6)  # event times are multiples of the period only up to rounding


def measure(distances: np.ndarray, parameters: LidarParameters, seed: int, index: int) -> np.ndarray:
    """The ranges (n,) that a lidar reports for true distances (n,), `+inf` for none, with the conventions of REP-117,
    m.

    The noise is a function of `(seed, index)` only, of the run, below 2**64, and of the scan, see `find_scan_index`:
    that of a scan does not depend on earlier measurements, and that of a beam not on what the other beams hit.

    Returns:
        `-inf` nearer than `range_min`, `+inf` from `range_max` on, NaN where lost, otherwise within
        [range_min, range_max).
    """
    p = parameters
    count = len(distances)
    errors, strays, is_lost = _NO_ERRORS, _NO_ERRORS, _NONE_LOST
    if p.noise > 0.0 or p.dropout > 0.0 or p.outliers > 0.0:
        generator = _of_scan(seed, index, Stream.NOISE)
        errors = p.noise * generator.standard_normal(count)
        if p.dropout > 0.0 or p.outliers > 0.0:
            is_lost = generator.random(count) < p.dropout
        if p.outliers > 0.0:
            strays = np.where(generator.random(count) < p.outliers, generator.random(count), np.nan)
    high = math.nextafter(p.range_max, 0.0)
    ranges = _report_ranges(distances, errors, is_lost, strays, p.quantisation, p.range_min, high)
    if p.mask:
        ranges[p.field_of_view.within(read_sectors(p.mask, "lidar.mask"))] = math.nan
    return ranges


def arrives(parameters: LidarParameters, seed: int, index: int) -> bool:
    """Whether a scan arrives; a function of its index and the seed only, as for `measure`."""
    p = parameters
    silent = p.silence_start - 1e-9 <= index / p.rate < p.silence_start + p.silence_duration - 1e-9
    return not silent and (p.scan_loss == 0.0 or _of_scan(seed, index, Stream.ARRIVAL).random() >= p.scan_loss)


def find_released(parameters: LidarParameters, seed: int, time: float) -> int | None:
    """Index of the scan that was taken `delay` before a time, s; None if there is none or it does not arrive."""
    index = find_scan_index(time - parameters.delay, parameters.rate)
    return index if index >= 0 and arrives(parameters, seed, index) else None


class Stream(enum.IntEnum):
    """Streams of random numbers of one seed."""

    NOISE, ARRIVAL, DRIFT, JUMP, SLIP = range(5)


class _Workbench(threading.local):
    """One generator per thread: to make one takes six times as long as to set its state."""

    def __init__(self) -> None:
        self.generator = np.random.Generator(np.random.Philox(key=0))


_workbench = _Workbench()


def draw_random_numbers(seed: int, stream: Stream, counter: int = 0) -> np.random.Generator:
    """The random numbers of a seed, a non-negative whole number below 2**64, and a stream from a place in it on.

    To be drawn before the next call: it returns the same generator, set to another place.
    """
    _workbench.generator.bit_generator.state = {
        "bit_generator": "Philox",
        "state": {"counter": struct.unpack("<4Q", counter.to_bytes(32, "little")), "key": (seed, stream)},
        "buffer": (0, 0, 0, 0),
        "buffer_pos": 4,  # empty
        "has_uint32": 0,
        "uinteger": 0,
    }
    return _workbench.generator


def _of_scan(seed: int, index: int, stream: Stream) -> np.random.Generator:
    """Random numbers that no two scans share: the index is the highest word of the counter."""
    return draw_random_numbers(seed, stream, index << 192)


@kernel
def _report_ranges(distances, errors, lost, strays, quantisation, low, high):
    """Ranges (n,) of true distances with their errors; hits are clamped to [low, high]; empty: no such fault."""
    ranges = np.empty(len(distances))
    for i in range(len(distances)):
        distance = distances[i]
        if len(strays) and not math.isnan(strays[i]):
            distance = low + strays[i] * max(min(distance, high) - low, 0.0)
        if distance < low:
            ranges[i] = -np.inf
        elif distance > high:
            ranges[i] = np.inf
        else:
            if len(errors):
                distance += errors[i]
            if quantisation > 0.0:
                distance = np.rint(distance / quantisation) * quantisation
            ranges[i] = min(max(distance, low), high) if max(distance, low) > 0.0 else -np.inf
        if len(lost) and lost[i]:
            ranges[i] = np.nan
    return ranges
