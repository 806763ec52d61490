"""From a scan to the planner's star-shaped region and the controller's certified region."""

import dataclasses
import math
import operator
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from drake_starnav.errors import StarnavError
from drake_starnav.geometry.compiled import kernel
from drake_starnav.geometry.footprint import Footprint
from drake_starnav.geometry.se2 import now_in, placed
from drake_starnav.lidar.deskew import deskewed
from drake_starnav.lidar.field_of_view import ROUNDING, TURN
from drake_starnav.lidar.laser_scan import Beams, LaserScan
from drake_starnav.lidar.mounts import ON_AXIS, Mount, newest, unturned
from drake_starnav.lidar.outlier_filter import HitHistory, without_lone_close_hits, without_outliers
from drake_starnav.surroundings.erosion import SMOOTHING_BEAMS, Disc, disc_range, moving_average, smoothed_distances
from drake_starnav.surroundings.looks import KEPT_EVERY, Known, Look, remembered
from drake_starnav.surroundings.margins import Margins
from drake_starnav.surroundings.observation import Observation
from drake_starnav.surroundings.piecewise_cubic import JUMP, TOLERANCE, PiecewiseCubic, adaptive_fit
from drake_starnav.surroundings.safe_region import (
    SCAN_PATIENCE,
    Asked,
    CertifiedRegion,
    ScanMemory,
    certified_by,
    star,
)
from drake_starnav.surroundings.scan_averaging import AVERAGED_WITHIN, averaged
from drake_starnav.surroundings.star_region import StarRegion, clear_of
from drake_starnav.surroundings.start import Start
from drake_starnav.surroundings.unseen import start_radius
from drake_starnav.surroundings.views import hit_points, hits_beside, hits_seen, merged, surround
from drake_starnav.utils.snapshot import replaced, snapshot
from drake_starnav.utils.timing import EARLY

SCAN_MEMORY = 5
"""Number of scans from which the certified region is made."""
FRONT_VIEW, WIDE_VIEW = math.pi, math.radians(260.0)
"""Smallest views of all lidars with the certificate, rad; the wide one among moving obstacles, where the robot may
reverse."""
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
    wanted = 0.5 * (WIDE_VIEW if backwards else FRONT_VIEW) - ROUNDING
    for bearing in np.linspace(-wanted, wanted, FEWEST_BEAMS):
        if not any(each.full_circle or (bearing - each.angle_min) % TURN <= each.span for each in views):
            seen = ", ".join(
                f"{math.degrees(each.angle_min):.0f} to {math.degrees(each.angle_max):.0f}" for each in views
            )
            raise StarnavError(
                f"a lidar sees from {seen} degrees, counted from straight ahead, with a certificate; "
                f"allowed: views that reach {math.degrees(wanted):.0f} degrees to each side of straight ahead, as "
                "space that no beam has observed is not certified"
            )


@snapshot
class LastScan:
    """The last scan of one lidar. Immutable.

    Attributes:
        near, sure: its scan as `unturned`, de-skewed, without doubted hits: for the certificate, which counts with the
            thinnest obstacle, and for the roadmap.
        pose: (x, y, yaw) of the robot when it was taken, W, m and rad.
        history: hits of its last scans, which confirm or refute new ones.
    """

    near: LaserScan
    sure: LaserScan
    pose: np.ndarray
    history: HitHistory

    def seen_from(self, pose: np.ndarray, time: float, mount: Mount) -> tuple[LaserScan, LaserScan, Mount]:
        """Both scans and the mount as if taken at a later time, s, and pose of the robot in surroundings that stand."""
        if self.near.time == time:
            return self.near, self.sure, mount
        moved = Mount(*now_in(pose, mount.unturned(self.pose)), upside_down=False)
        near = unturned(dataclasses.replace(self.near, time=time), moved)
        return near, near if self.sure is self.near else unturned(self.sure, moved), moved


@snapshot
class Perceived:
    """Perception's state after a scan. Immutable.

    Attributes:
        observation: the scan, its pose, and its region with the planning margin.
        safety: the certified region of the last scans.
        memory: the scans from which the certified region is made.
        looks: of each lidar, None before its first; empty before that of all.
    """

    observation: Observation
    safety: CertifiedRegion
    memory: ScanMemory
    looks: tuple[LastScan | None, ...]

    def lacks(self, scans: Sequence[LaserScan]) -> bool:
        """Whether some of the `newest` scans were not processed."""
        return any(_new(self.looks, scans))

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
        plans: whether somebody plans: without, no region is observed, only the certified one is made.
    """

    margins: Margins
    footprint: Footprint
    outlier_noise: float | None = None
    mounts: tuple[Mount, ...] = (ON_AXIS,)
    plans: bool = True


Perceive = Callable[[Perceived, Sequence[LaserScan], np.ndarray, PerceptionSettings], Perceived]
"""Perception as a pure function, as `perceive`."""


def perceive(
    before: Perceived, scans: Sequence[LaserScan], pose: np.ndarray, settings: PerceptionSettings
) -> Perceived:
    """Process new scans.

    Lidars may have different rates: of one without a new scan the last look counts, from where it was taken, for
    SCAN_PATIENCE of its periods. Until all have looked, nothing is observed.

    Args:
        before: state before the scans.
        scans: the last of each lidar in its sensor frame S; new are the `newest`. Rolling ones are de-skewed.
        pose: (x, y, yaw) of the robot in the world frame W at the time of the newest, m and rad.
        settings: of robot and sensors.
    """
    margins, footprint, _, mounts, plans = settings
    robot_radius = footprint.narrow
    time, looks = newest(scans), _looks(before.looks, scans, pose, settings)
    seen = [
        look.seen_from(pose, time, mount)
        for look, mount in zip(looks, mounts, strict=True)
        if look is not None and time - look.near.time <= SCAN_PATIENCE * look.near.scan_time + EARLY
    ]
    if len(seen) < len(mounts):
        return replaced(before, looks=looks)
    near, scans, mounts = zip(*seen, strict=True)
    first = before.observation.region
    samples = 0 if first is None else len(first.free_range)  # though the number of beams may vary
    slack, smoothing = margins.smoothing_slack, (margins.smoothed_beams, margins.smoothing_slack)
    alone = len(near) == 1 and mounts[0].offset == 0.0
    surrounded = surround(near, mounts, footprint)
    known = [] if surrounded else before.safety.seen_from(pose)
    around = merged(near, mounts, footprint, known)
    scan = around if all(map(operator.is_, near, scans)) else merged(scans, mounts, footprint, known)
    safe_radius, memory = robot_radius + margins.safety, before.memory.latest(SCAN_MEMORY - 1)
    sizes = safe_radius, margins.safety_range, margins.safety_range + 2.0 * safe_radius
    hits = None if alone else hits_seen(near, mounts, smoothing)
    asked = Asked.of(memory, around, pose, sizes, hits, smoothing)
    plan = Disc.of(scan, robot_radius, (margins.preferred, margins.least), samples=samples)
    distance, profile, boundary, found = _observed(tuple(plan), tuple(asked), slack, plans)
    region, beside, (values, limit, margin) = None, np.zeros((0, 2)), profile
    if plans:
        region = StarRegion(pose[:2], asked.bearing_0, PiecewiseCubic(*boundary), values, limit, margin, robot_radius)
        if alone and known:
            beside = hits_beside(near, mounts, known)[0]
            beside = placed(pose, beside[np.hypot(*beside.T) < sizes[2]])
            region = clear_of(region, beside, robot_radius)
    after = memory.and_then(around, found)
    if margins.average_scans and around.motion is None:
        (lone,) = near  # more are refused
        measured = smoothed_distances(lone, slack, margins.smoothed_beams)
        lone = dataclasses.replace(lone, ranges=np.where(lone.hits, measured, lone.ranges))
        memory, around = averaged(before.memory, lone, pose, safe_radius + AVERAGED_WITHIN * robot_radius)
        memory = memory.latest(SCAN_MEMORY - 1)
        asked = Asked.of(memory, around, pose, sizes)
        found = star(distance, *asked)
    look = asked.look(around, found, footprint, margins.looks.short)
    views = (look,) if alone else _views(look, (near, mounts), pose, smoothing)
    ahead = None if alone and surrounded else 0.0 if surrounded else max(0.0, *(mount.x for mount in mounts))
    earlier, driven = _seen_before(before, pose, time, views[0], ahead, settings)
    latest = Known.of(views, [each.place for each in views], time, driven)
    safety = certified_by(memory, around, asked, found, latest, earlier)
    if not (alone or surrounded):
        safety = replaced(safety, sight=(0.0, 0.0))  # earlier looks are in the star
    return Perceived(Observation(region, scan, pose, beside), safety, after, looks)


@kernel
def _observed(plan, asked, slack, plans):
    """Smoothed distances; values, limit and margin of the planner's region and its boundary, if it plans; the `star`.

    `plan` is the planner's `Disc`, `asked` an `Asked`, both plain tuples, `slack` as of `smoothed_distances`.
    """
    distance, none = moving_average(Beams(*plan[0]), np.int64(SMOOTHING_BEAMS), slack), np.zeros(0)
    profile, fit = (none, none, 0.0), (np.zeros(0, np.int64), none, none)
    if plans:
        profile, radius = disc_range(distance, plan), plan[2]
        fit = adaptive_fit(profile[0], (JUMP * radius, TOLERANCE * radius), True)
    return distance, profile, fit, star(distance, *asked)


def _seen_before(
    before: Perceived, pose: np.ndarray, time: float, view: Look, ahead: float | None, settings: PerceptionSettings
) -> tuple[Known, tuple[float, float]]:
    """What was seen before a scan, and how far the robot has come since the first one, m, and turned, rad.

    Args:
        before: state before the scan.
        pose: (x, y, yaw) of the robot, W, m and rad.
        time: of the scan, s.
        view: what its first lidar saw; its surfaces bound the start disc.
        ahead: how far ahead of the axis lidars are that do not see all around the robot, m, else 0; None: the scan is
            of one that does, on the axis, and no start disc is needed.
        settings: of robot and sensors.
    """
    last, margins, footprint, place = before.safety, settings.margins, settings.footprint, tuple(pose.tolist())
    earlier, driven = Known(), (0.0, 0.0)
    if last.seen:
        x, y, yaw = (pose - before.observation.pose).tolist()
        driven = last.driven[0] + math.hypot(x, y), last.driven[1] + abs(math.remainder(yaw, TURN))
        reach = margins.safety_range + 2.0 * (footprint.radius + margins.safety)
        kept = margins.looks._replace(reach=reach, apart=KEPT_EVERY * footprint.radius)
        earlier = remembered(last.earlier, last.newest, driven, (place, time), kept)
    elif ahead is not None:
        earlier = Known.of((Start.of(start_radius(footprint, margins.safety, ahead)),), (place,), time, driven)
    begun = earlier.looks[-1] if earlier.looks else None
    if isinstance(begun, Start):
        begun = begun.cut(tuple(earlier.rows[-1, :3].tolist()), view.chords)
        earlier = earlier._replace(looks=(*earlier.looks[:-1], begun))
    return earlier, driven


def _views(
    look: Look, lidars: tuple[Sequence[LaserScan], Sequence[Mount]], pose: np.ndarray, smoothing: tuple[int, float]
) -> tuple[Look, ...]:
    """What each lidar sees, of what all see, with the robot at a pose; `smoothing` as of `hits_seen`."""
    first, views = look.own[0], []
    for scan, mount in zip(*lidars, strict=True):
        count = int((np.hypot(*hit_points(scan, mount, smoothing)[0].T) < look.reach).sum())
        x, y, yaw = mount.unturned(pose).tolist()
        robot = now_in(np.array((x, y, yaw)), pose)
        own, within = (first, first + count), min(look.reach - mount.offset, scan.range_max, scan.beams.sight)
        views.append(replaced(look, own=own, beams=scan.beams, place=(x, y, yaw), reach=within, robot=robot))
        first += count
    return tuple(views)


def _looks(
    before: tuple[LastScan | None, ...], scans: Sequence[LaserScan], pose: np.ndarray, settings: PerceptionSettings
) -> tuple[LastScan | None, ...]:
    """The last look of each lidar, with its new scan if it has one."""
    rows = zip(_new(before, scans), before or (None,) * len(scans), scans, settings.mounts, strict=True)
    return tuple([_look(look, scan, mount, pose, settings) if new else look for new, look, scan, mount in rows])


def _new(looks: tuple[LastScan | None, ...], scans: Sequence[LaserScan]) -> list[bool]:
    """Which lidars' scans are the newest, and not their last looks yet."""
    time, rows = newest(scans), zip(looks or (None,) * len(scans), scans, strict=True)
    return [scan.measured_at == time and (last is None or last.near.time != time) for last, scan in rows]


def _look(
    before: LastScan | None, scan: LaserScan, mount: Mount, pose: np.ndarray, settings: PerceptionSettings
) -> LastScan:
    """A new scan of a lidar whose last look is given."""
    narrow, thinnest = settings.footprint.narrow, settings.margins.thinnest
    if (scan.body, scan.thinnest) != (narrow, thinnest):
        scan = dataclasses.replace(scan, body=narrow, thinnest=thinnest)
    body = narrow - mount.offset
    if settings.outlier_noise is None:
        scan = without_lone_close_hits(scan, body)
    scan, place = unturned(scan, mount), mount.unturned(pose)
    if before is not None and scan.time_increment:
        scan = deskewed(scan, mount.unturned(before.pose), before.near.time, place, body)
    history, near, sure = HitHistory() if before is None else before.history, scan, scan
    if settings.outlier_noise is not None:
        near, sure = without_outliers(scan, place, history, settings.outlier_noise, body)
        history = history.remembered(scan.points(place))
    if near is not sure or not near.beams.complete:
        sure = sure.again(sure.ranges, thinnest=math.inf)
    return LastScan(near, sure, pose, history)
