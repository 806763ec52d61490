"""What a planar lidar is, and how its measurement differs from the truth."""

import math
from dataclasses import dataclass

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.parameters import check_parameters, parameter


@dataclass(frozen=True)
class LidarParameters:
    """A planar laser scanner."""

    beams: int = parameter(360, "number of beams in a scan", low=3, high=100000)
    angle_min: float = parameter(-math.pi, "bearing of the first beam", unit="rad", low=-7.0, high=7.0)
    angle_max: float = parameter(
        math.pi,
        "bearing of the last beam; one turn from angle_min means a full circle without its end point",
        unit="rad",
        low=-7.0,
        high=7.0,
    )
    range_min: float = parameter(0.02, "hits nearer than this are reported as -inf", unit="m", low=0.0)
    range_max: float = parameter(5.0, "hits from here on are reported as +inf", unit="m", above=0.0, high=1000.0)
    rate: float = parameter(20.0, "scans per second", unit="Hz", above=0.0, high=10000.0)
    noise: float = parameter(0.01, "standard deviation of the range error of hits", unit="m", low=0.0, high=10.0)
    dropout: float = parameter(0.0, "probability that a beam measures nothing and reports +inf", low=0.0, high=1.0)
    quantisation: float = parameter(0.0, "hits are rounded to multiples of this; 0 for none", unit="m", low=0.0)
    rolling: bool = parameter(False, "sweep the beams over the period before the scan, as a spinning sensor does")

    def __post_init__(self) -> None:
        check_parameters(self, "lidar")
        span = self.angle_max - self.angle_min
        if not 0.0 < span <= 2.0 * math.pi + 1e-9:
            raise StarnavError(
                f"lidar.angle_max is {self.angle_max:g} with lidar.angle_min {self.angle_min:g}, a span of {span:g} "
                "rad; allowed: more than 0, at most one turn"
            )
        if not self.range_min < self.range_max:
            raise StarnavError(
                f"lidar.range_min is {self.range_min:g} with lidar.range_max {self.range_max:g}; "
                "allowed: range_min < range_max"
            )

    @property
    def full_circle(self) -> bool:
        """Whether the last beam's neighbour is the first one."""
        return self.angle_max - self.angle_min > 2.0 * math.pi - 1e-9

    @property
    def angle_increment(self) -> float:
        """Bearing step between beams, rad."""
        if self.full_circle:
            return 2.0 * math.pi / self.beams
        return (self.angle_max - self.angle_min) / (self.beams - 1)


def scan_index(time: float, rate: float) -> int:
    """The number of the scan that is held at a time: 0 in [0, 1/rate), and so on.

    Args:
        time: s.
        rate: scans per second, Hz.
    """
    return math.floor(time * rate + 1e-6)  # event times are multiples of the period up to rounding


def measure(distances: np.ndarray, parameters: LidarParameters, seed: int, index: int) -> np.ndarray:
    """The ranges a lidar reports for true distances, as REP-117 has them.

    The noise is a function of `(seed, index)` only: a scan has the same noise whatever was measured before it,
    and a beam the same noise whatever the other beams hit.

    Args:
        distances: true distance along each beam, shape (n,), m, `+inf` for none.
        parameters: of the sensor.
        seed: a non-negative whole number below 2**64.
        index: number of the scan, see `scan_index`.

    Returns:
        shape (n,), m: `-inf` nearer than `range_min`, `+inf` from `range_max` on or dropped, otherwise
        within [range_min, range_max).
    """
    low, high = parameters.range_min, parameters.range_max
    ranges = distances
    if parameters.noise > 0.0 or parameters.dropout > 0.0:
        # The highest counter word is the scan's own, so that no two scans share numbers.
        counter = np.array([0, 0, 0, index & 0xFFFFFFFFFFFFFFFF], dtype=np.uint64)
        generator = np.random.Generator(np.random.Philox(key=seed, counter=counter))
        errors = generator.standard_normal(len(distances))
        ranges = distances + parameters.noise * errors
    if parameters.quantisation > 0.0:
        ranges = np.round(ranges / parameters.quantisation) * parameters.quantisation
    ranges = np.clip(ranges, low, np.nextafter(high, 0.0))
    ranges[distances < low] = -np.inf
    ranges[distances >= high] = np.inf
    if parameters.dropout > 0.0:
        ranges[generator.random(len(distances)) < parameters.dropout] = np.inf
    return ranges
