"""What the perception of free space allows for; `scenario.margins` derives it from what is declared."""

from dataclasses import dataclass


@dataclass(frozen=True)
class StarParameters:
    """How a scan becomes a star-shaped region of free robot positions.

    Attributes:
        margin: clearance kept beyond the robot's radius where there is room, m.
        least_margin: clearance kept in passages that `margin` would close, m; from `margin` on none is entered.
        smoothing_slack: additional range step allowed within a surface, and additional change allowed by smoothing, m.
    """

    margin: float = 0.0295
    least_margin: float = 0.0105
    smoothing_slack: float = 0.0


@dataclass(frozen=True)
class SafetyParameters:
    """How the last scans become the safety star, within which the certificate keeps the robot.

    Attributes:
        safety_margin: clearance that the certificate keeps beyond the robot's radius, m.
        safety_range: extent of the safety star, m.
        smoothed_beams: half width of a moving average over the ranges, in beams, which reduces the error of the nearest
            hit; 0: none.
        average_scans: average ranges over the remembered scans instead of using the nearest hit of all; not with moving
            obstacles.
    """

    safety_margin: float = 0.0145
    safety_range: float = 1.2
    smoothed_beams: int = 0
    average_scans: bool = False
