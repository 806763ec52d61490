"""What perception, planner, controller and shield allow for; `scenario.margins` derives it from what is declared."""

import math
from dataclasses import dataclass
from typing import NamedTuple

SCAN_PATIENCE = 3.0
"""Scan periods that a certificate lasts beyond the lidar's delay; without a new scan the robot then brakes."""
VIEW_TURN = 0.1
"""Past views that are nearer to each other than their spacing are turned by more than this, rad."""


class ViewRetention(NamedTuple):
    """Which views count: a pose whose error grows with the way, the turn or the time makes old ones void.

    Attributes:
        reach: largest distance of a view from the robot, m.
        spacing: least distance between two views, m, unless they are turned by VIEW_TURN.
        way, turn: how far the robot may have driven since, m, and turned, rad.
        age: largest age, s.
        range_error: as of `ViewParams`, m.
    """

    reach: float = math.inf
    spacing: float = 0.0
    way: float = math.inf
    turn: float = math.inf
    age: float = math.inf
    range_error: float = 0.0


@dataclass(frozen=True)
class Margins:
    """The clearances that are kept, and how ranges are smoothed.

    Attributes:
        safety: clearance that the certificate keeps beyond the robot's radius, m.
        preferred: clearance that the planner keeps beyond the robot's radius where there is room, m; the safety margin
            is part of it.
        least: clearance that the planner keeps in passages that `preferred` would close, m; from `preferred` on none is
            entered.
        safety_range: extent of the certified star, m.
        thinnest: width of the thinnest obstacle that is certain to be seen, m.
        smoothing_slack: additional range step allowed within a surface, and additional change allowed by smoothing, m.
        smoothed_beams: half width of a moving average over the certificate's ranges, in beams, which reduces the error
            of the nearest hit; 0: none.
        average_scans: average the certificate's ranges over the recent scans instead of using the nearest hit of all;
            not with moving obstacles.
        drop_seen_through: discard nodes whose hits a new scan sees through.
        retention: which past views the certificate counts with.
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
    retention: ViewRetention

    def hit_range(self, radius: float) -> float:
        """Return up to which distance hits matter to the certificate of a body of this radius, m."""
        return self.safety_range + 2.0 * (radius + self.safety)
