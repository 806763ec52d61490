"""From a scan to the planner's star-shaped region and the controller's certified region."""

import dataclasses
import math
from collections.abc import Callable
from dataclasses import field
from typing import NamedTuple

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.footprint import Footprint
from drake_starnav.lidar.deskew import deskewed
from drake_starnav.lidar.field_of_view import TURN, FieldOfView
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.outlier_filter import HitHistory, without_outliers
from drake_starnav.regions.chords import hits_behind
from drake_starnav.regions.erosion import smoothed_distances
from drake_starnav.regions.margins import Margins
from drake_starnav.regions.observation import Observation
from drake_starnav.regions.safe_region import CertifiedRegion, ScanMemory, certified_region
from drake_starnav.regions.scan_averaging import averaged
from drake_starnav.regions.star_region import smoothed_scan_region
from drake_starnav.utils.snapshot import snapshot
from drake_starnav.utils.stopwatch import Stopwatch

SCAN_MEMORY = 5
"""Number of scans from which the certified region is made."""
AVERAGED = 0.5
"""With `average_scans`, hits are averaged up to this distance from the robot's hull, m: only these restrict it."""

FRONT_VIEW, WIDE_VIEW = math.pi, math.radians(260.0)
"""Smallest fields of view with the certificate, rad; the wide one among moving obstacles, where it may reverse."""
FEWEST_BEAMS = 36
"""Beams that a lidar needs per turn: with fewer, hits on one wall are not recognised as connected."""


def check_view(view: FieldOfView, *, backwards: bool) -> None:
    """Raise a `StarnavError` if a lidar observes too little for a certificate.

    Args:
        view: of the lidar.
        backwards: whether the robot may reverse.
    """
    wanted = 0.5 * (WIDE_VIEW if backwards else FRONT_VIEW)
    if min(view.sides) < wanted - 1e-6:
        raise StarnavError(
            f"lidar.angle_min {view.angle_min:g} and lidar.angle_max {view.angle_max:g} with a certificate; "
            f"allowed: a view that reaches {math.degrees(wanted):.0f} degrees to each side of straight ahead, as "
            "space that no beam has observed is not certified"
        )
    if view.angle_increment > TURN / FEWEST_BEAMS + 1e-9:
        raise StarnavError(
            f"lidar.beams is {view.beams}, one every {math.degrees(view.angle_increment):.3g} degrees, with "
            f"a certificate; allowed: at least {FEWEST_BEAMS} a turn"
        )


@snapshot
class Perceived:
    """Perception's state after a scan. Immutable.

    Attributes:
        observation: the scan, its pose, and its region with the planning margin.
        safety: the certified region of the last scans.
        memory: the scans from which the certified region is made.
        history: hits of the last scans, which confirm or refute new ones.
        behind: hits of all earlier scans near the robot where the last one did not look, shape (m, 2), W, m; only with
            a limited view, and for polygons, which sweep what lies there when they turn.
    """

    observation: Observation
    safety: CertifiedRegion
    memory: ScanMemory
    history: HitHistory
    behind: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))

    @staticmethod
    def nothing() -> "Perceived":
        """The state before the first scan."""
        return Perceived(Observation.none(), CertifiedRegion.none(), ScanMemory(), HitHistory())


class PerceptionSettings(NamedTuple):
    """What perception needs to know about robot and sensor.

    Attributes:
        margins: of the planner's region and of the certified region.
        footprint: of the robot.
        outlier_noise: standard deviation of the ranges at which outliers are removed, see `without_outliers`, m; None:
            they are not.
    """

    margins: Margins
    footprint: Footprint
    outlier_noise: float | None = None


Perceive = Callable[[Perceived, LaserScan, np.ndarray, PerceptionSettings, Stopwatch | None], Perceived]
"""Perception as a pure function: `perceive`, or the paper's."""


def perceive(
    before: Perceived,
    scan: LaserScan,
    pose: np.ndarray,
    settings: PerceptionSettings,
    stopwatch: Stopwatch | None = None,
) -> Perceived:
    """Process a new scan.

    Args:
        before: state before the scan.
        scan: in the sensor frame S, whose origin is the robot's centre; a rolling scan is de-skewed.
        pose: (x, y, yaw) of S in the world frame W at the time of the scan, m and rad.
        settings: of robot and sensor.
        stopwatch: records the times `scan` and `fit`; None: no times are recorded.
    """
    margins, footprint, noise = settings
    robot_radius = footprint.narrow
    stopwatch = stopwatch or Stopwatch()
    with stopwatch.measure("scan"):
        if scan.time_increment and before.observation.region is not None:
            scan = deskewed(scan, before.observation.pose, before.observation.scan.time, pose)
        history, near = before.history, scan  # `near` is the scan for the certificate
        if noise is not None:
            history = history.remembered(scan.points(pose))
            near, scan = without_outliers(scan, pose, before.history, noise, robot_radius)
        first = before.observation.region
        samples = None if first is None else len(first.free_range)  # though the number of beams may vary
        distance, region = smoothed_scan_region(scan, pose, robot_radius, margins, samples)
        measured = near.distances
        if margins.smoothed_beams > 0:
            smooth = smoothed_distances(near, margins.smoothing_slack, margins.smoothed_beams)
            measured = np.where(near.hits, smooth, measured)
        safe_radius = robot_radius + margins.safety
        kept = margins.safety_range + 2.0 * safe_radius, SCAN_MEMORY
        looked = distance, pose, safe_radius, margins.safety_range, kept
        safety, memory = certified_region(before.memory, near, *looked, measured)
        if margins.average_scans and near.motion is None:
            near = dataclasses.replace(near, ranges=np.where(near.hits, measured, near.ranges))
            earlier, near = averaged(before.memory, near, pose, safe_radius + AVERAGED)
            safety, _ = certified_region(earlier, near, *looked)
        behind = before.behind
        if not footprint.is_disc and not scan.full_circle:
            behind = hits_behind(behind, before.safety.hits, scan.field_of_view, pose, kept[0])
            safety = dataclasses.replace(safety, behind=behind)
    return Perceived(Observation(region, scan, pose), safety, memory, history, behind)
