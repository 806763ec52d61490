"""From a scan to the planner's star-shaped region and the controller's certified region."""

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.footprint import Footprint
from drake_starnav.lidar.deskew import deskewed
from drake_starnav.lidar.field_of_view import TURN
from drake_starnav.lidar.laser_scan import LaserScan
from drake_starnav.lidar.mounts import ON_AXIS, Mount, unturned
from drake_starnav.lidar.outlier_filter import HitHistory, without_outliers
from drake_starnav.regions.chords import hits_behind
from drake_starnav.regions.erosion import smoothed_distances
from drake_starnav.regions.margins import Margins
from drake_starnav.regions.observation import Observation
from drake_starnav.regions.safe_region import CertifiedRegion, ScanMemory, certified_region
from drake_starnav.regions.scan_averaging import AVERAGED_WITHIN, averaged
from drake_starnav.regions.star_region import NO_HITS, scan_region
from drake_starnav.regions.views import hits_seen, merged, view_range
from drake_starnav.utils.snapshot import snapshot

SCAN_MEMORY = 5
"""Number of scans from which the certified region is made."""
DISTINCT_PLACE, DISTINCT_TURN = 0.1, 0.3
"""Regions of earlier scans are kept that differ by so much, m or rad."""
FRONT_VIEW, WIDE_VIEW = math.pi, math.radians(260.0)
"""Smallest fields of view with the certificate, rad; the wide one among moving obstacles, where it may reverse."""
FEWEST_BEAMS = 36
"""Beams that a lidar needs per turn: with fewer, hits on one wall are not recognised as connected."""


def check_views(scans: Sequence[LaserScan], mounts: Sequence[Mount], footprint: Footprint, *, backwards: bool) -> None:
    """Raise a `StarnavError` if lidars observe too little for a certificate.

    Args:
        scans: of each lidar, any.
        mounts: of the lidars.
        footprint: of the robot.
        backwards: whether the robot may reverse.
    """
    views = [mount.view(scan.field_of_view) for scan, mount in zip(scans, mounts, strict=True)]
    for each, mount in zip(views, mounts, strict=True):
        if each.angle_increment > TURN / FEWEST_BEAMS + 1e-9:
            raise StarnavError(
                f"lidar.beams is {each.beams}, one every {math.degrees(each.angle_increment):.3g} degrees, with "
                f"a certificate; allowed: at least {FEWEST_BEAMS} a turn"
            )
        if mount.offset > footprint.radius:
            raise StarnavError(
                f"a lidar is mounted {mount.offset:g} m from the robot's axis; allowed: up to {footprint.radius:g} m, "
                "the farthest point of the robot: a robot.radius or robot.footprint that reaches the lidar"
            )
    if len(mounts) > 1 or mounts[0].offset > 0.0:
        _check_cover(scans, mounts, footprint)
        return
    (lone,), wanted = views, 0.5 * (WIDE_VIEW if backwards else FRONT_VIEW)
    if min(lone.sides) < wanted - 1e-6:
        raise StarnavError(
            f"lidar.angle_min {lone.angle_min:g} and lidar.angle_max {lone.angle_max:g} with a certificate; "
            f"allowed: a view that reaches {math.degrees(wanted):.0f} degrees to each side of straight ahead, as "
            "space that no beam has observed is not certified"
        )


def _check_cover(scans: Sequence[LaserScan], mounts: Sequence[Mount], footprint: Footprint) -> None:
    """Raise a `StarnavError` unless the views of lidars, in an empty world, meet all around as far as each sees."""
    blank = [dataclasses.replace(scan, ranges=np.full(len(scan.ranges), math.inf), motion=None) for scan in scans]
    around = merged([unturned(*each) for each in zip(blank, mounts, strict=True)], mounts, footprint)
    least = min(view_range(*each) for each in zip(scans, mounts, strict=True))
    unseen = np.flatnonzero(around.lost & (around.distances < least))
    if len(unseen):
        middle = np.exp(1j * around.bearings[unseen]).sum()
        raise StarnavError(
            f"the lidars' views end at the robot's own body for {360 * len(unseen) / len(around.lost):.0f} degrees, "
            f"around {math.degrees(math.atan2(middle.imag, middle.real)):.0f} degrees from straight ahead; allowed: "
            "views that meet all around: a second lidar there, or the lidar on the robot's axis"
        )


@snapshot
class Perceived:
    """Perception's state after a scan. Immutable.

    Attributes:
        observation: the scan, its pose, and its region with the planning margin.
        safety: the certified region of the last scans.
        memory: the scans from which the certified region is made.
        histories: for each lidar, hits of its last scans, which confirm or refute new ones.
    """

    observation: Observation
    safety: CertifiedRegion
    memory: ScanMemory
    histories: tuple[HitHistory, ...]

    @staticmethod
    def nothing() -> "Perceived":
        """The state before the first scan."""
        return Perceived(Observation.none(), CertifiedRegion.none(), ScanMemory(), ())


class PerceptionSettings(NamedTuple):
    """What perception needs to know about robot and sensor.

    Attributes:
        margins: of the planner's region and of the certified region.
        footprint: of the robot.
        outlier_noise: standard deviation of the ranges at which outliers are removed, see `without_outliers`, m; None:
            they are not.
        mounts: of the lidars.
    """

    margins: Margins
    footprint: Footprint
    outlier_noise: float | None = None
    mounts: tuple[Mount, ...] = (ON_AXIS,)


Perceive = Callable[[Perceived, Sequence[LaserScan], np.ndarray, PerceptionSettings], Perceived]
"""Perception as a pure function: `perceive`, or the paper's."""


def perceive(
    before: Perceived,
    scans: Sequence[LaserScan],
    pose: np.ndarray,
    settings: PerceptionSettings,
) -> Perceived:
    """Process new scans.

    Args:
        before: state before the scans.
        scans: one of each lidar in its sensor frame S, all taken at one time; rolling ones are de-skewed.
        pose: (x, y, yaw) of the robot in the world frame W at that time, m and rad.
        settings: of robot and sensors.
    """
    margins, footprint, noise, mounts = settings
    robot_radius = footprint.narrow
    scans = [unturned(*each) for each in zip(scans, mounts, strict=True)]
    scans = _deskewed(before.observation, scans, pose, mounts)
    histories, near = before.histories, scans  # `near` is for the certificate
    if noise is not None:
        histories, near, scans = _without_outliers(before.histories, scans, pose, settings)
    first = before.observation.region
    samples = None if first is None else len(first.free_range)  # though the number of beams may vary
    smoothing = margins.smoothed_beams, margins.smoothing_slack
    hits, around = hits_seen(near, mounts, smoothing), merged(near, mounts, footprint)
    scan = around if near is scans else merged(scans, mounts, footprint)
    safe_radius = robot_radius + margins.safety
    remembered = margins.safety_range + 2.0 * safe_radius, SCAN_MEMORY
    beside = NO_HITS
    if not scan.full_circle:
        seen = before.safety.chords.ends
        beside = hits_behind(before.observation.beside, seen, scan.field_of_view, pose, remembered[0])
    distance = smoothed_distances(scan, margins.smoothing_slack)
    region = scan_region(scan, pose, robot_radius, margins, samples, beside, distance)
    arguments = distance, pose, safe_radius, margins.safety_range, remembered
    safety, memory = certified_region(before.memory, around, *arguments, hits)
    if margins.average_scans and around.motion is None:
        (lone,) = near  # more are refused
        measured = smoothed_distances(lone, margins.smoothing_slack, margins.smoothed_beams)
        lone = dataclasses.replace(lone, ranges=np.where(lone.hits, measured, lone.ranges))
        earlier, lone = averaged(before.memory, lone, pose, safe_radius + AVERAGED_WITHIN)
        safety, _ = certified_region(earlier, lone, *arguments)
    if not scan.full_circle:
        surfaces = NO_HITS if footprint.is_disc else beside
        safety = dataclasses.replace(safety, behind=surfaces, earlier=_earlier(before.safety, pose, remembered[0]))
    return Perceived(Observation(region, scan, pose, beside), safety, memory, histories)


def _earlier(last: CertifiedRegion, pose: np.ndarray, reach: float) -> tuple[CertifiedRegion, ...]:
    """The regions of earlier scans within reach of a pose, m, of which no two successive ones are much the same."""
    if not last.earlier or _apart(last, last.earlier[0]):
        kept = dataclasses.replace(last, earlier=()), *last.earlier
    else:
        kept = last.earlier
    return tuple(star for star in kept if star.seen and math.dist(star.center, pose[:2]) < reach)


def _apart(star: CertifiedRegion, other: CertifiedRegion) -> bool:
    """Whether two regions of one lidar are of different places or directions."""
    turned = math.remainder(star.bearing_0 - other.bearing_0, TURN)
    return math.dist(star.center, other.center) > DISTINCT_PLACE or abs(turned) > DISTINCT_TURN


def _deskewed(
    last: Observation, scans: Sequence[LaserScan], pose: np.ndarray, mounts: Sequence[Mount]
) -> Sequence[LaserScan]:
    """The scans of lidars parallel to the robot, each as if taken at one time, since the last observation."""
    if last.region is None or not any(scan.time_increment for scan in scans):
        return scans
    return [
        deskewed(scan, mount.unturned(last.pose), last.scan.time, mount.unturned(pose)) if scan.time_increment else scan
        for scan, mount in zip(scans, mounts, strict=True)
    ]


def _without_outliers(
    before: tuple[HitHistory, ...], scans: Sequence[LaserScan], pose: np.ndarray, settings: PerceptionSettings
) -> tuple[tuple[HitHistory, ...], list[LaserScan], list[LaserScan]]:
    """The histories with the scans, and the scans without doubted hits, for the certificate and for the roadmap."""
    histories: list[HitHistory] = []
    near: list[LaserScan] = []
    sure: list[LaserScan] = []
    before = before or (HitHistory(),) * len(scans)
    for scan, mount, history in zip(scans, settings.mounts, before, strict=True):
        place = mount.unturned(pose)
        body = settings.footprint.narrow - mount.offset
        histories.append(history.remembered(scan.points(place)))
        kept, trusted = without_outliers(scan, place, history, settings.outlier_noise or 0.0, body)
        near.append(kept)
        sure.append(trusted)
    return tuple(histories), near, sure
