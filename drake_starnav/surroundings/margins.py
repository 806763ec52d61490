"""What perception, planner, controller and shield allow for; `scenario.margins` derives it from what is declared."""

from dataclasses import dataclass

from drake_starnav.surroundings.looks import Kept


@dataclass(frozen=True)
class Margins:
    """The clearances that are kept, and how ranges are smoothed.

    Attributes:
        safety: clearance that the certificate keeps beyond the robot's radius, m.
        preferred: clearance that the planner keeps beyond it where there is room, m.
        least: clearance that the planner keeps in passages that `preferred` would close, m; from `preferred` on none is
            entered.
        safety_range: extent of the certified region, m.
        thinnest: width of the thinnest obstacle that is certain to be seen, m.
        smoothing_slack: additional range step allowed within a surface, and additional change allowed by smoothing, m.
        smoothed_beams: half width of a moving average over the certificate's ranges, in beams, which reduces the error
            of the nearest hit; 0: none.
        average_scans: average the certificate's ranges over the remembered scans instead of using the nearest hit of
            all; not with moving obstacles.
        drop_seen_through: discard nodes whose hits a new scan sees through.
        looks: which earlier looks the certificate counts with.
    """

    safety: float
    preferred: float
    least: float
    safety_range: float
    thinnest: float
    smoothing_slack: float
    smoothed_beams: int
    average_scans: bool
    drop_seen_through: bool
    looks: Kept
