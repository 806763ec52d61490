"""What a scan tells: the planner's star-shaped region, and the controller's safety star from the last scans."""

import dataclasses
import math

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.lidar.deskew import taken_at_once
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.outlier_filter import HitHistory, without_strays
from drake_starnav.regions.erosion import free_range, smoothed_distances
from drake_starnav.regions.observation import Observation
from drake_starnav.regions.parameters import SafetyParameters, StarParameters
from drake_starnav.regions.safe_region import SafetyStar, ScanMemory, safety_star
from drake_starnav.regions.scan_averaging import averaged
from drake_starnav.regions.star_region import fit_region
from drake_starnav.utils.snapshot import snapshot
from drake_starnav.utils.stopwatch import Stopwatch

AVERAGED = 0.5
"""With `average_scans`, hits nearer to the robot than this are averaged, m: they hem it in."""

FRONT_VIEW, WIDE_VIEW = math.pi, math.radians(260.0)
"""Least views with the certificate, rad; the wide one where the robot may go backwards, with points or movers."""
FEWEST_BEAMS = 36
"""Of a lidar, in a turn: between fewer of them walls are not seen as such."""


def check_view(angle_min: float, angle_max: float, angle_increment: float, beams: int, *, backwards: bool) -> None:
    """Raise a `StarnavError` where the beams of a lidar look at too little for a certificate.

    Args:
        angle_min, angle_max: bearings of the first and the last beam, rad.
        angle_increment: bearing step, rad.
        beams: how many.
        backwards: whether the robot may go backwards.
    """
    view = WIDE_VIEW if backwards else FRONT_VIEW
    turns = 2.0 * math.pi * round(0.5 * (angle_min + angle_max) / (2.0 * math.pi))
    least = min(turns - angle_min, angle_max - turns)
    all_around = beams * angle_increment > 2.0 * math.pi - 1e-6
    if not all_around and least < 0.5 * view - 1e-6:
        raise StarnavError(
            f"lidar.angle_min {angle_min:g} and lidar.angle_max {angle_max:g} with controller.certificate; "
            f"allowed: a view that reaches {math.degrees(0.5 * view):.0f} degrees to each side of straight ahead, as "
            "what no beam has looked at is not certified"
        )
    if angle_increment > 2.0 * math.pi / FEWEST_BEAMS + 1e-9:
        raise StarnavError(
            f"lidar.beams is {beams}, one every {math.degrees(angle_increment):.3g} degrees, with "
            f"controller.certificate; allowed: at least {FEWEST_BEAMS} a turn"
        )


@snapshot
class Perceived:
    """What is known once a scan has been looked at; immutable.

    Attributes:
        observation: the scan, its pose, and its region with the planning margin.
        safety: the safety star of the last scans.
        memory: the last scans that the safety star is of.
        history: the last scans' hits by which stray ones are sorted out.
    """

    observation: Observation
    safety: SafetyStar
    memory: ScanMemory
    history: HitHistory

    @staticmethod
    def nothing() -> "Perceived":
        """Before the first scan."""
        return Perceived(Observation.none(), SafetyStar.none(), ScanMemory(), HitHistory())


def perceive(
    before: Perceived,
    scan: LaserScan,
    pose: np.ndarray,
    planner: StarParameters,
    controller: SafetyParameters,
    robot_radius: float,
    *,
    confirm: float | None = None,
    stopwatch: Stopwatch | None = None,
) -> Perceived:
    """Look at a new scan.

    Args:
        before: what was known.
        scan: in the sensor frame S, whose origin is the robot's centre; a rolling one is made into one taken at once.
        pose: (x, y, yaw) of S in the world frame W at the time of the scan, m and rad.
        planner: of the region.
        controller: of the safety star.
        robot_radius: m.
        confirm: where not None, stray hits are sorted out as `without_strays` does at this noise, m.
        stopwatch: where to note `scan` and `fit` times, if anywhere.
    """
    stopwatch = stopwatch or Stopwatch()
    with stopwatch.measure("scan"):
        if scan.time_increment > 0.0 and before.observation.region is not None:
            scan = taken_at_once(scan, before.observation.pose, before.observation.scan.time, pose)
        history, near = before.history, scan  # `near` is what the certificate sees
        if confirm is not None:
            history = history.remembered(scan.points(pose))
            near, scan = without_strays(scan, pose, before.history, confirm, robot_radius)
        distance = smoothed_distances(scan, planner)
        if controller.smoothed_beams > 0:
            smoothing = StarParameters(
                smoothing_beams=controller.smoothed_beams, smoothing_slack=planner.smoothing_slack
            )
            near = dataclasses.replace(
                near, ranges=np.where(near.hits, smoothed_distances(near, smoothing), near.ranges)
            )
        profile = free_range(scan, distance, robot_radius, planner)
        with stopwatch.measure("fit"):
            region = fit_region(profile, pose[:2], pose[2] + scan.angle_min, planner)
        safe_radius = robot_radius + controller.safety_margin
        kept = controller.safety_range + 2.0 * safe_radius, controller.scan_memory, controller.scan_spacing
        memory = known = before.memory.remembered(near, pose, *kept)
        if controller.average_scans and near.motion is None:
            earlier, near = averaged(before.memory, near, pose, safe_radius + AVERAGED)
            known = earlier.remembered(near, pose, *kept)
        safety = safety_star(known, near, distance, pose, safe_radius, controller.safety_range, planner)
        safety = dataclasses.replace(safety, previous=before.safety.time)
    return Perceived(Observation(region, scan, pose), safety, memory, history)
